"""Laws whose internal states are those of an implicit stage, found from the motion of their own element alone."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jax import Array, lax
from jax.flatten_util import ravel_pytree

from ..math._newton import newton_root
from ..typing import Scalar
from ._base import AbstractScalarLaw
from ._internal_state import States

_MOST_ITERATIONS = 20


class ImplicitLaw(eqx.Module):
    """A law at the states `s = start + step rate(x, v, s, t)`, for the ports; it stores nothing."""

    law: Any
    s: States
    step: Array

    def effort(self, *args: Any) -> Any:
        """Effort, of (x, v, t)."""
        return self.law.effort(*self._with_states(args))

    def wrench(self, *args: Any) -> Any:
        """Force and moment, of (x, v, t)."""
        return self.law.wrench(*self._with_states(args))

    line_force = AbstractScalarLaw.line_force

    def rate(self, *args: Any) -> States:
        """Rates of the states by name, of (x, v, t)."""
        return self.law.rate(*self._with_states(args))

    def potential(self, *args: Any) -> Scalar:
        """Nothing [J]: powers are evaluated at the states that were found."""
        return jnp.zeros((), self.step.dtype)

    line_potential = potential

    def state_power(self, *args: Any) -> Scalar:
        """Nothing [W]."""
        return jnp.zeros((), self.step.dtype)

    def _with_states(self, args):
        """The arguments with the states of the stage before the time."""
        *motion, t = args
        start, unravel = ravel_pytree(self.s)

        def residual(values):
            rates = self.law.rate(*motion, unravel(values), t)
            return values - start - self.step * ravel_pytree({name: rates[name] for name in self.s})[0]

        declared = self.law.internal_states
        scale = ravel_pytree({name: jnp.broadcast_to(declared[name].scale, x.shape) for name, x in self.s.items()})[0]
        residual = eqx.filter_closure_convert(residual, start)
        guess, scale = lax.stop_gradient((start, scale.astype(start.dtype)))
        limit = jnp.finfo(start.dtype).eps ** 0.75
        found, size = newton_root(residual, guess, scale, None, limit, _MOST_ITERATIONS, 1.0)
        return *motion, unravel(jnp.where(size <= limit, found, jnp.nan)), t
