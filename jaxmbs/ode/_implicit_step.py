"""The derivative of a step of diffrax's diagonally implicit Runge-Kutta methods, by the implicit function theorem.

diffrax differentiates the root of every stage through LAPACK's LU, and a batch of those may stop a process for good
(`runtime/_lapack.py`).  Here the stages are solved by `square.solve`, one after the other.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jax.flatten_util import ravel_pytree

from ..math import _square as square
from ._diffrax_internals import butcher_arrays, stage_increments


@eqx.filter_custom_jvp
def step(start, times, solver, term, memory, jumped):
    """The solver's step from start = (y, args) over times = (t0, t1), which have no derivatives.

    Nor has its memory: the derivative of the first stage is evaluated anew from y.

    Returns: what the solver's `step` returns.
    """
    (y, args), (t0, t1) = start, times
    return solver.step(term, t0, t1, y, args, memory, jumped)


@step.def_jvp
def _step_jvp(primals, tangents):
    (y0, args), (t0, t1), solver, term, *_ = primals
    y_dot, args_dot = tangents[0]
    y1, error, dense, memory, result = step(*primals)
    dtype = jax.tree.leaves(y0)[0].dtype
    A, b, c = (jnp.asarray(x, dtype) for x in butcher_arrays(solver))
    h, (flat, unravel) = t1 - t0, ravel_pytree(y0)
    flat_dot = ravel_pytree(jax.tree.map(lambda y, d: jnp.zeros_like(y) if d is None else d, y0, y_dot))[0]
    K = jax.vmap(lambda k: ravel_pytree(k)[0])(stage_increments(solver, dense))

    def stage(K_dot, i):
        t = jnp.where(c[i] == 1.0, t1, t0 + c[i] * h)
        y = flat + A[i] @ K

        def increment(y, args):
            return h * ravel_pytree(term.vf(t, unravel(y), args))[0]

        # change of the stage before its own equation is solved; entries of K_dot that are not found yet are zero
        change = eqx.filter_jvp(increment, (y, args), (flat_dot + A[i] @ K_dot, args_dot))[1]
        matrix = jnp.eye(y.size, dtype=y.dtype) - A[i, i] * jax.jacfwd(increment)(y, args)
        return K_dot.at[i].set(square.solve(matrix, change)), None

    K_dot = lax.scan(stage, jnp.zeros_like(K), jnp.arange(len(K)))[0]
    y0_dot, y1_dot = unravel(flat_dot), unravel(flat_dot + b @ K_dot)
    dense_dot = {"y0": y0_dot, "y1": y1_dot}
    if "k" in dense:
        dense_dot["k"] = jax.vmap(unravel)(K_dot)
    return (y1, error, dense, memory, result), (
        y1_dot,
        _zero_tangents(error),
        dense_dot,
        _zero_tangents(memory),
        _zero_tangents(result),
    )


def _zero_tangents(tree):
    return jax.tree.map(lambda x: jnp.zeros_like(x) if eqx.is_inexact_array(x) else None, tree)
