"""Rank of the constraint rows at a pose, of concrete rows and within a trace."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_concrete, is_sparse
from ..model._system import System
from ._linear_rows import FrontalRows
from ._sparse_rank import scaled_columns, sparse_spaces

_RANK_TOLERANCE = {
    8: 1e-7,
    4: 1e-3,
}  # singular values or pivots, relative, that count as zero: about the root of rounding
_MORE_MOTIONS = 4  # than the build counted that are looked at where a rank is counted by iteration
_PASSES = 4  # of this iteration, as in `_sparse_rank`
_SEED = 11  # of the motions that it starts from: any, but always the same


def column_weights(system: System):
    """Weights (nv,) that make velocities comparable: 1 for turning columns, the length of the system for sliding."""
    spins, length = np.asarray(system.topology.spins), system.length
    return spins + (1.0 - spins) * (np.asarray(length) if is_concrete(length) else lax.stop_gradient(length))


def weighted_columns(system: System, A: Any) -> Any:
    """Rows A (rows, nv) of a concrete system, dense or sparse, by comparable velocities."""
    weights = np.asarray(column_weights(system)).astype(A.dtype)
    return scaled_columns(A, weights) if is_sparse(A) else A * weights[None]


def constraint_spaces(A: Any, length: float) -> tuple[int, np.ndarray, np.ndarray]:
    """Rank of weighted rows A (rows, nv), their null space (nv, freedoms) and that of A^T (rows, redundant).

    Of sparse rows, random vectors of the null space of A^T, eight at most.
    """
    if A.shape[0] == 0:
        return 0, np.eye(A.shape[1]), np.zeros((0, 0))
    if is_sparse(A):
        return sparse_spaces(A, _RANK_TOLERANCE[A.dtype.itemsize], _least_size(length))
    U, s, Vt = np.linalg.svd(A)
    rank = int(np.sum(s > _threshold(A, length, s[0]))) if s.size else 0
    return rank, Vt[rank:].T, U[:, rank:]


def constraint_rank(system: System, A):
    """Rank () of the rows A (rows, nv) of a system; by singular values on the host, within a trace by elimination, of
    `FrontalRows` by inverse iteration.

    No derivative: a rank has none.
    """
    if isinstance(A, FrontalRows):
        return _rank_by_iteration(system, A)
    if isinstance(A, np.ndarray) or is_sparse(A):
        return constraint_spaces(weighted_columns(system, A), float(system.length))[0]
    A = lax.stop_gradient(A * jnp.asarray(column_weights(system), A.dtype)[None])
    return _rank_by_elimination(A, _threshold(A, lax.stop_gradient(system.length), jnp.max(jnp.abs(A), initial=0.0)))


def _rank_by_iteration(system, rows):
    """As `sparse_spaces` counts, in a trace: the motions that change the rows least, and how many of them do.

    The count of the build and some more motions are looked at, so that a rank that is lower still shows as less.
    """
    top, counted = system.topology, system.topology.analysis
    n, dtype = top.num_velocities, rows.at.psi.dtype
    k = min(n, (n - counted.rank if counted else n) + _MORE_MOTIONS)
    weight = jnp.asarray(column_weights(system), dtype)
    values = rows.entries()[2] * weight[rows.entries()[1]]
    least = _threshold(values, lax.stop_gradient(system.length), jnp.max(jnp.abs(values), initial=0.0))
    Z = jnp.asarray(np.random.default_rng(_SEED).normal(size=(k, n)), dtype)
    solve = rows.normal_solver(weight, 10.0 * least**2)
    Z = lax.fori_loop(0, _PASSES, lambda _, Z: _orthonormal(jax.vmap(solve)(Z)), Z)
    changes = jax.vmap(lambda z: rows.rates(weight * z))(Z)
    return n - k + _rank_by_elimination(changes, least)


def _orthonormal(Z):
    """Vectors (k, n) by Gram-Schmidt, twice."""

    def take(k, Z):
        q = Z[k] * lax.rsqrt(jnp.sum(Z[k] ** 2))
        later = (jnp.arange(len(Z)) > k).astype(Z.dtype)
        return (Z - later[:, None] * (Z @ q)[:, None] * q[None]).at[k].set(q)

    return lax.fori_loop(0, 2, lambda _, Z: lax.fori_loop(0, len(Z), take, Z), Z)


def _threshold(A, length, largest):
    """Threshold of rank, relative to the largest value or 1e-3 of the size of a row, if that is larger.

    Rows have the size of 1 (angles) or of the model's length [m]; where all of them nearly cancel, rounding must not
    count as rank.
    """
    xp = np if isinstance(length, float) else jnp
    return _RANK_TOLERANCE[A.dtype.itemsize] * xp.maximum(largest, _least_size(length))


def _least_size(length):
    """The least size [m] of a row whose rounding must not count as rank."""
    return 1e-3 * (np if isinstance(length, float) else jnp).minimum(1.0, length)


def _rank_by_elimination(A, least):
    """Number of pivots larger than `least` in a Gaussian elimination with complete pivoting: cheaper to compile than
    singular values, and the same under `vmap`."""
    if not min(A.shape):
        return jnp.zeros((), int)
    places = np.arange(A.size).reshape(A.shape)

    def eliminate(carry, _):
        A, rank = carry
        here = (lax.argmax(jnp.abs(A).reshape(-1), 0, places.dtype) == places).astype(A.dtype)  # 1 at the pivot
        row, column, pivot = here.sum(1) @ A, A @ here.sum(0), jnp.sum(here * A)
        counts = (jnp.abs(pivot) > least).astype(A.dtype)
        A = A - column[:, None] * (counts * row / (pivot + 1.0 - counts))[None]
        return (A, rank + counts), None

    return lax.scan(eliminate, (A, jnp.zeros((), A.dtype)), length=min(A.shape))[0][1].astype(int)
