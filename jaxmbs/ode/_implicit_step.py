"""The derivative of a step of diffrax's diagonally implicit Runge-Kutta methods, by the implicit function theorem.

diffrax would differentiate the root of every stage through LAPACK's LU, and a batch of those may stop a process for
good (`lapack.py`).  Here the stages are solved by `square.solve`, one after the other.
"""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.flatten_util import ravel_pytree

from ..math import _square as square


def is_diagonally_implicit(solver) -> bool:
    """Whether each stage of a solver of diffrax's own is implicit in itself alone."""
    if type(solver) is diffrax.ImplicitEuler:
        return True
    single = isinstance(solver, diffrax.AbstractDIRK) and isinstance(solver.tableau, diffrax.ButcherTableau)
    return single and type(solver).step is diffrax.AbstractDIRK.step


@eqx.filter_custom_jvp
def step(start, times, solver, term, memory, jumped):
    """The solver's step from start = (y, args) over times = (t0, t1), those held: what its `step` returns.

    Its memory has no derivatives: the first stage's are found anew from y.
    """
    (y, args), (t0, t1) = start, times
    return solver.step(term, t0, t1, y, args, memory, jumped)


@step.def_jvp
def _step_jvp(primals, tangents):
    (y0, args), (t0, t1), solver, term, *_ = primals
    y_dot, args_dot = tangents[0]
    y1, error, dense, memory, result = step(*primals)
    A, b, c = _tableau(solver, y0)
    h, (flat, unravel) = t1 - t0, ravel_pytree(y0)
    flat_dot = ravel_pytree(jax.tree.map(lambda y, d: jnp.zeros_like(y) if d is None else d, y0, y_dot))[0]
    K = jax.vmap(lambda k: ravel_pytree(k)[0])(_stages(solver, dense))

    def stage(K_dot, i):
        t = jnp.where(c[i] == 1.0, t1, t0 + c[i] * h)
        y = flat + A[i] @ K

        def increment(y, args):
            return h * ravel_pytree(term.vf(t, unravel(y), args))[0]

        # what the stage before its own equation is solved changes by; entries of K_dot not found yet are zero
        change = eqx.filter_jvp(increment, (y, args), (flat_dot + A[i] @ K_dot, args_dot))[1]
        matrix = jnp.eye(y.size, dtype=y.dtype) - A[i, i] * jax.jacfwd(increment)(y, args)
        return K_dot.at[i].set(square.solve(matrix, change)), None

    K_dot = lax.scan(stage, jnp.zeros_like(K), jnp.arange(len(K)))[0]
    y0_dot, y1_dot = unravel(flat_dot), unravel(flat_dot + b @ K_dot)
    dense_dot = {"y0": y0_dot, "y1": y1_dot}
    if "k" in dense:
        dense_dot["k"] = jax.vmap(unravel)(K_dot)
    return (y1, error, dense, memory, result), (y1_dot, _still(error), dense_dot, _still(memory), _still(result))


def _still(tree):
    return jax.tree.map(lambda x: jnp.zeros_like(x) if eqx.is_inexact_array(x) else None, tree)


def _tableau(solver, y):
    """A (stages, stages) with its diagonal, b and c, for stages `k_i = h f(t0 + c_i h, y0 + sum a_ij k_j)`."""
    dtype = jax.tree.leaves(y)[0].dtype
    if isinstance(solver, diffrax.ImplicitEuler):
        return (jnp.ones(shape, dtype) for shape in ((1, 1), (1,), (1,)))
    tableau = solver.tableau
    A = np.diag(tableau.a_diagonal)
    for i, row in enumerate(tableau.a_lower):
        A[i + 1, : i + 1] = row
    return (jnp.asarray(x, dtype) for x in (A, tableau.b_sol, np.r_[tableau.c1, tableau.c]))


def _stages(solver, dense):
    """The stages (stages, ...) that a step found."""
    if isinstance(solver, diffrax.ImplicitEuler):
        return jax.tree.map(lambda y0, y1: (y1 - y0)[None], dense["y0"], dense["y1"])
    return dense["k"]
