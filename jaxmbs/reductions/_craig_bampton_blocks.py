"""Craig-Bampton reduction of large components in blocks: one factorisation, its solutions in chunks of columns."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import analyse, factor, solve
from ..blocksparse._matrix import constrain
from ..checks import is_concrete
from ..linear._condensation import check_nonsingular, partition
from ..linear._symmetric import ASYMMETRY_TOLERANCE
from ..linear._system import LinearSystem
from ..vibration._lanczos import lowest_modes
from ._base import Reduced, check_num_modes, reduced_labels


def craig_bampton_blocks(system: LinearSystem, num_modes: int, chunk: int) -> Reduced:
    """Craig-Bampton reduction of block matrices with rows `size * block + direction` (a block is a node).

    Derivatives of first order with respect to the matrices, forward and reverse, solve by the same factor.
    Source: S1 (4)-(8).
    """
    stiffness, mass, damping = system.stiffness, system.mass, system.damping
    pattern = stiffness.pattern
    (n, b), outer = pattern.shape, interface_rows(pattern, system.interface)
    k, dtype = len(outer), stiffness.diagonal.dtype
    check_num_modes(num_modes, int(pattern.sizes.sum()) - k)
    _check_symmetric(stiffness=stiffness, mass=mass)
    held = np.isin(np.arange(n * b), outer).reshape(n, b)
    plan = analyse(pattern, positions=_block_positions(system))
    K = factor(constrain(stiffness, held, True), "cholesky", plan)
    free = jnp.asarray(~held, dtype)[:, :, None]

    @jax.checkpoint
    def columns(rows):
        E = jnp.zeros((n * b, chunk), dtype).at[rows, np.arange(chunk)].set(1.0, mode="drop").reshape(n, b, chunk)
        T = E - solve(K, (stiffness @ E) * free)
        return T, mass @ T, (stiffness @ T).reshape(n * b, chunk)[outer]

    rows = np.full(-(-k // chunk) * chunk, n * b)
    rows[:k] = outer
    T, inertia, static = (_flatten_chunks(Y, k) for Y in lax.map(columns, jnp.asarray(rows.reshape(-1, chunk))))
    check_nonsingular(T, "the interface")
    shapes = jnp.zeros((n * b, 0), dtype)
    if num_modes:
        shapes = lowest_modes(K, constrain(mass, held, False), num_modes).shapes
    basis = jnp.concatenate([T, shapes], axis=1)
    coupling, zero = inertia.T @ shapes, jnp.zeros((k, num_modes), dtype)
    own = _project(stiffness, shapes)  # not the squared frequencies, whose derivatives miss how a group splits
    return Reduced(
        system,
        basis,
        mass=jnp.block([[_symmetric_part(T.T @ inertia), coupling], [coupling.T, jnp.eye(num_modes, dtype=dtype)]]),
        stiffness=jnp.block([[static, zero], [zero.T, own]]),
        damping=None if damping is None else _project(damping, basis),
        coordinates=reduced_labels(system, normal=num_modes),
    )


def _block_positions(system):
    """Positions (blocks, 3) of the blocks for a better elimination order, or None where they are not known."""
    b = system.stiffness.pattern.size
    at = {name: i for i, name in enumerate(system.nodes)}
    rows = [at.get(node) for node, _ in system.coordinates[::b]]
    if system.positions is None or not is_concrete(system.positions) or None in rows:
        return None
    return np.asarray(system.positions)[rows]


def interface_rows(pattern, interface: Sequence[int]) -> np.ndarray:
    """Interface rows.  Raises: ValueError as `partition`, and for padding of smaller blocks."""
    outer = partition(pattern.num_blocks * pattern.size, interface)[1]
    absent = outer[pattern.padding.ravel()[outer]]
    if len(absent):
        raise ValueError(f"interface coordinates {absent.tolist()} do not exist: they are padding of smaller blocks")
    return outer


def _check_symmetric(**matrices):
    for name, matrix in matrices.items():
        if not is_concrete(matrix.diagonal):
            continue
        if not matrix.is_symmetric or matrix.asymmetry > ASYMMETRY_TOLERANCE:
            raise ValueError(f"the {name} is unsymmetric")


def _project(matrix, basis):
    n, b = matrix.pattern.shape
    return _symmetric_part(basis.T @ (matrix @ basis.reshape(n, b, -1)).reshape(n * b, -1))


def _symmetric_part(A):
    return (A + A.T) / 2


def _flatten_chunks(Y, k):
    """Reshape (chunks, ..., columns) to (rows, k)."""
    return jnp.moveaxis(Y.reshape(len(Y), -1, Y.shape[-1]), 0, 1).reshape(-1, len(Y) * Y.shape[-1])[:, :k]
