"""A step-size controller that makes steps small where they pass a corner of the right side.

A step over a corner, where the right side keeps its value and changes its slope, errs by h^2 in its values, which the
tolerance holds, and by h in their derivatives, which it does not.
"""

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp

#: The error of a step over a corner counts so many times.  Derivatives after four passages of a strap over a wheel at
#: a tolerance of 1e-9: 8e-6 with 1, 2e-7 with 100, 4e-8 with 1000, in 140, 184 and 203 steps.
_WEIGHT = 300.0


class CornerController(diffrax.AbstractAdaptiveStepSizeController):
    """Another controller, for which errors of steps over a corner weigh more, down to rounding.

    Attributes: rtol, atol, norm: of the inner one; inner: controller; sides: of (t, y, args) to numbers (n,) that are
        constant beside corners.
    """

    rtol: Any
    atol: Any
    norm: Callable
    inner: diffrax.PIDController
    sides: Callable

    @classmethod
    def around(cls, inner: diffrax.PIDController, sides: Callable) -> "CornerController":
        """That of an inner controller."""
        return cls(inner.rtol, inner.atol, inner.norm, inner, sides)

    def wrap(self, direction: Any) -> "CornerController":
        """As that of the inner controller."""
        return CornerController.around(self.inner.wrap(direction), self.sides)

    def init(self, terms: Any, t0: Any, t1: Any, y0: Any, dt0: Any, args: Any, func: Any, error_order: Any) -> tuple:
        """The first end of a step, and the state: the inner one's and the sides at the start."""
        t_next, state = self.inner.init(terms, t0, t1, y0, dt0, args, func, error_order)
        return t_next, (state, self.sides(t0, y0, args))

    def adapt_step_size(
        self,
        t0: Any,
        t1: Any,
        y0: Any,
        y1_candidate: Any,
        args: Any,
        y_error: Any,
        error_order: Any,
        controller_state: Any,
    ) -> Any:
        """As that of the inner controller, by a larger error where a side changes."""
        state, before = controller_state
        after = self.sides(t1, y1_candidate, args)
        most = jnp.clip(self.rtol / (100 * jnp.finfo(after.dtype).eps), 1.0, _WEIGHT)
        weight = jnp.where(jnp.any(before != after), most, 1.0).astype(after.dtype)
        error = jax.tree.map(lambda e: weight * e, y_error)
        found: Any = self.inner.adapt_step_size(t0, t1, y0, y1_candidate, args, error, error_order, state)
        keep, begin, end, jump, state, result = found
        return keep, begin, end, jump, (state, jnp.where(keep, after, before)), result
