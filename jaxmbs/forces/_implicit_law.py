"""Laws whose internal states are those of an implicit stage, found from the motion of their own element alone."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax
from jax.flatten_util import ravel_pytree

from ..math import _square as square
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
        return *motion, unravel(_root(residual, guess, scale)), t


@eqx.filter_custom_jvp
def _root(residual, values, scale):
    """Root near values (m,), by Newton's method to rounding; not a number where that does not converge."""
    limit = jnp.finfo(values.dtype).eps ** 0.75

    def iterate(carry):
        values, _, count = carry
        change = _solve(residual, values, residual(values))
        return values - change, jnp.max(jnp.abs(change) / (scale + jnp.abs(values))), count + 1

    def unfinished(carry):
        _, size, count = carry
        return (size > limit) & (count < _MOST_ITERATIONS)

    found, size, _ = lax.while_loop(unfinished, iterate, (values, jnp.asarray(jnp.inf, values.dtype), 0))
    return jnp.where(size <= limit, found, jnp.nan)


@_root.def_jvp
def _root_jvp(primals, tangents):
    residual, values = primals[0], _root(*primals)
    change = eqx.filter_jvp(lambda residual: residual(values), (residual,), (tangents[0],))[1]
    return values, jnp.zeros_like(values) if change is None else -_solve(residual, values, change)


def _solve(residual, values, right):
    """Solution (m,) with the derivative of the residual."""
    matrix = jax.jacfwd(residual)(values)
    return right / matrix[0] if values.size == 1 else square.solve(matrix, right)
