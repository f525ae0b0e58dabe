"""Steps of implicit methods whose stages the equations solve themselves, such as linear ones with their matrices.

A stage of such a method is implicit in itself alone: its rate r is `f(t, y + s r)` with the same s = h a_ii for all
of them, so that one factor serves the step (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.6).
"""

from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import PyTree

from ._diffrax_internals import butcher_arrays, is_diagonally_implicit
from ._gauss import ImplicitMidpoint


class StageStart(NamedTuple):
    """Start of a step: time (), y, and the relative and absolute tolerances () of its stages."""

    t: Array
    y: PyTree
    rtol: Array
    atol: Array


def shared_diagonal(solver: diffrax.AbstractSolver) -> float | None:
    """a_ii of the implicit stages of a method, the same for all; None for a method of another kind."""
    if isinstance(solver, ImplicitMidpoint):
        return float(solver.A[0, 0])
    if not is_diagonally_implicit(solver) or isinstance(solver, diffrax.ImplicitEuler):
        return None
    diagonal = np.diagonal(butcher_arrays(solver)[0])
    implicit = diagonal[diagonal != 0.0]
    return float(implicit[0]) if np.allclose(implicit, implicit[0], rtol=1e-12) else None


def step(problem, t0: Array, t1: Array, y0: PyTree, args: PyTree, memory: PyTree) -> tuple:
    """The results of the solver's `step`; its memory stays."""
    solver, dtype = problem.solver, jax.tree.leaves(y0)[0].dtype
    is_midpoint = isinstance(solver, ImplicitMidpoint)
    tableau = (solver.A, solver.b, solver.c) if is_midpoint else butcher_arrays(solver)
    A, b, c = (jnp.asarray(x, dtype) for x in tableau)
    h, below, share = t1 - t0, A - jnp.diag(jnp.diagonal(A)), shared_diagonal(solver)
    assert share is not None  # else the problem has no stages
    stages = problem.stages(args, h * share, StageStart(t0, y0, *_tolerances(solver, dtype)))
    K = jax.tree.map(lambda y: jnp.zeros((len(c), *y.shape), y.dtype), y0)
    first = 0 if tableau[0][0, 0] else 1  # an explicit one
    if first:
        K = _with_row(K, 0, h, problem.rate(t0, y0, args))

    def stage(K, i):
        t = jnp.where(c[i] == 1.0, t1, t0 + c[i] * h)
        rate, found = stages.rate(t, _plus(y0, below[i], K))
        return _with_row(K, i, h, rate), found

    K, found = lax.scan(stage, K, jnp.arange(first, len(c)))
    found, y1 = jnp.all(found), _plus(y0, b, K)
    result = diffrax.RESULTS.where(found, diffrax.RESULTS.successful, diffrax.RESULTS.nonlinear_divergence)
    if is_midpoint:
        start = jax.tree.map(lambda r: h * r, problem.rate(t0, y0, args))
        end = jax.tree.map(lambda k0, k: 2.0 * k[0] - k0, start, K)
        return y1, None, {"y0": y0, "y1": y1, "k0": start, "k1": end}, memory, result
    weights = jnp.asarray(solver.tableau.b_error, dtype)
    error = jax.tree.map(lambda k: jnp.where(found, jnp.tensordot(weights, k, 1), jnp.inf), K)
    return y1, error, {"y0": y0, "y1": y1, "k": K}, memory, result


def _tolerances(solver, dtype):
    """Tolerances of the stages: those of the root finder, or rounding."""
    finder = getattr(solver, "root_finder", None)
    values = [getattr(finder, name, None) for name in ("rtol", "atol")]
    # 4e-10, of which the last change may have a hundredth: stiff springs and plates leave 1e-13 of what they add
    least = jnp.finfo(dtype).eps ** 0.6
    return tuple(jnp.asarray(x if eqx.is_array_like(x) else least, dtype) for x in values)


def _with_row(K, i, h, rate):
    return jax.tree.map(lambda k, r: k.at[i].set(h * r), K, rate)


def _plus(y, weights, K):
    return jax.tree.map(lambda y, k: y + jnp.tensordot(weights, k, 1), y, K)
