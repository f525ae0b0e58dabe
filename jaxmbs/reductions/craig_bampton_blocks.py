"""Craig-Bampton reduction of large components in blocks: one factorisation, its solutions in chunks of columns."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix, analyse, factor, solve
from ..checks import known
from ..fem.assembly import hold
from ..linear.block_modes import lowest_modes
from ..linear.condensation import check_held, partition
from ..linear.modes import UNSYMMETRIC
from .base import Reduced, check_num_modes, numbered


def large_craig_bampton(
    stiffness: BlockMatrix,
    mass: BlockMatrix,
    interface: Sequence[int],
    num_modes: int,
    damping: BlockMatrix | None = None,
    chunk: int = 64,
    positions=None,
) -> Reduced:
    """`craig_bampton` of a component whose dense matrices would be too large: block matrices, with derivatives.

    For matrices from elsewhere, once and without derivatives, `craig_bampton_sparse` takes SciPy's as they are.

    Args:
        stiffness, mass, damping: symmetric, on one pattern, as of `structures.assemble_blocks`.
        interface: coordinates `size * block + direction` (a block is a node), in this order.
        num_modes: lowest fixed-interface modes kept; they should not cut a group of equal frequencies.
        chunk: constraint modes solved together; memory beside the results grows with this.
        positions: (blocks, 3) of the nodes on the host, for a better order of elimination.

    Derivatives of first order with respect to the matrices, forward and reverse, solve by the same factor.

    Raises: ValueError for more modes than there are, an interface that is not there and, if concrete, unsymmetric
    matrices and a mechanism with the interface held; under tracing a mechanism gives non-finite values.

    Returns: basis (blocks * size, r).  Source: S1 (4)-(8).
    """
    pattern = stiffness.pattern
    (n, b), outer = pattern.shape, interface_rows(pattern, interface)
    k, dtype = len(outer), stiffness.diagonal.dtype
    check_num_modes(num_modes, int(pattern.sizes.sum()) - k)
    _check_symmetric(stiffness=stiffness, mass=mass)
    held = np.isin(np.arange(n * b), outer).reshape(n, b)
    K = factor(hold(stiffness, held, True), "cholesky", analyse(pattern, positions=positions))
    free = jnp.asarray(~held, dtype)[:, :, None]

    @jax.checkpoint
    def columns(rows):
        E = jnp.zeros((n * b, chunk), dtype).at[rows, np.arange(chunk)].set(1.0, mode="drop").reshape(n, b, chunk)
        T = E - solve(K, (stiffness @ E) * free)
        return T, mass @ T, (stiffness @ T).reshape(n * b, chunk)[outer]

    rows = np.full(-(-k // chunk) * chunk, n * b)
    rows[:k] = outer
    T, inertia, static = (_flat(Y, k) for Y in lax.map(columns, jnp.asarray(rows.reshape(-1, chunk))))
    check_held(T, "the interface")
    shapes = jnp.zeros((n * b, 0), dtype)
    if num_modes:
        shapes = lowest_modes(K, hold(mass, held, False), num_modes).shapes
    basis = jnp.concatenate([T, shapes], axis=1)
    coupling, zero = inertia.T @ shapes, jnp.zeros((k, num_modes), dtype)
    own = _projected(stiffness, shapes)  # not the squared frequencies, whose derivatives miss how a group splits
    return Reduced(
        basis,
        jnp.block([[_even(T.T @ inertia), coupling], [coupling.T, jnp.eye(num_modes, dtype=dtype)]]),
        jnp.block([[static, zero], [zero.T, own]]),
        None if damping is None else _projected(damping, basis),
        jnp.eye(k, k + num_modes, dtype=dtype),
        numbered("interface", k) + numbered("normal", num_modes),
    )


def interface_rows(pattern, interface: Sequence[int]) -> np.ndarray:
    """Interface coordinates; ValueError as `partition`, and for those that fill up a smaller block."""
    outer = partition(pattern.num_blocks * pattern.size, interface)[1]
    absent = outer[pattern.padding.ravel()[outer]]
    if len(absent):
        raise ValueError(f"interface: the blocks of coordinates {absent.tolist()} are smaller than that")
    return outer


def _check_symmetric(**matrices):
    for name, matrix in matrices.items():
        if not known(matrix.diagonal):
            continue
        if not matrix.is_symmetric or matrix.asymmetry > UNSYMMETRIC:
            raise ValueError(f"the {name} is unsymmetric")


def _projected(matrix, basis):
    n, b = matrix.pattern.shape
    return _even(basis.T @ (matrix @ basis.reshape(n, b, -1)).reshape(n * b, -1))


def _even(A):
    return (A + A.T) / 2


def _flat(Y, k):
    """(chunks, ..., columns) -> (rows, k)."""
    return jnp.moveaxis(Y.reshape(len(Y), -1, Y.shape[-1]), 0, 1).reshape(-1, len(Y) * Y.shape[-1])[:, :k]
