"""Newton's method in a loop, with the derivative of the root by the implicit function theorem."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from . import _square as square


@eqx.filter_custom_jvp
def newton_root(
    residual: Callable[[Array], Array],
    start: Array,
    scale: Array,
    inverse: Array | None,
    tolerance: float,
    most: int,
    relative: float = 0.0,
) -> tuple[Array, Array]:
    """(root (n,) near a start, size () of the last step to it); where that is above the tolerance there is none.

    Args:
        residual: function of (n,) to (n,), a pytree; start and scale have no derivatives.
        scale: (n,) or () of the unknowns; a step is measured by it, plus `relative` times the unknowns.
        inverse: (n, n) of the derivative, which serves all steps; None for the derivative of each.
        most: number of steps at most.
    """

    def iterate(carry):
        z, _, count = carry
        change = _solve(residual, z, residual(z)) if inverse is None else inverse @ residual(z)
        size = jnp.max(jnp.abs(change) / (scale + relative * jnp.abs(z) if relative else scale))
        return z - change, size, count + 1

    def unfinished(carry):
        _, size, count = carry
        return (size > tolerance) & (count < most)

    return lax.while_loop(unfinished, iterate, (start, jnp.asarray(jnp.inf, start.dtype), 0))[:2]


@newton_root.def_jvp
def _newton_root_jvp(primals, tangents):
    residual = primals[0]
    z, size = newton_root(*primals)
    change = eqx.filter_jvp(lambda residual: residual(z), (residual,), (tangents[0],))[1]
    return (z, size), (jnp.zeros_like(z) if change is None else -_solve(residual, z, change), None)


def _solve(residual, z, right):
    """Solution (n,) with the derivative of the residual."""
    matrix = jax.jacfwd(residual)(z)
    return right / matrix[0] if z.size == 1 else square.solve(matrix, right)
