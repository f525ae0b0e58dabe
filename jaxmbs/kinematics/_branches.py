"""The branch on which loops are closed: per block of coupled loops, the sign of the determinant of their rows.

With the held coordinates at their values a loop closes in several ways, each a branch.  Two of them meet only where
the rows no longer determine the other coordinates (a dead point): there the determinant of the rows' Jacobian in
these coordinates passes through zero.  So its sign is constant along a motion on one branch.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy.sparse.csgraph import connected_components

from ..math._determinant import determinant_signs
from ..model._rows import Drive
from ..model._system import System
from . import _closures as closures
from ._constraints import rows_are_lengths

_SINGULAR_PIVOT = {
    8: 1e-7,
    4: 1e-4,
}  # relative pivots up to which a pose counts as singular: states close to some 1e-10
_SEED = 3  # of the combinations of redundant rows: any, but always the same


class LoopBlocks(NamedTuple):
    """Blocks of coupled loops, in an order in which each is determined by its rows once those before it are.

    Attributes:
        columns: (n,) velocity columns that depend on the held ones, block by block.
        block: (n,) the number of the block of each.
        combine: (n, position rows) that makes as many rows of redundant ones as there are columns.
        steady: (blocks,) false where the redundancy depends on the pose, so that no fixed combination is valid.
    """

    columns: np.ndarray
    block: np.ndarray
    combine: np.ndarray
    steady: np.ndarray


def branch_signs(system: System, A, held: Sequence[int] = ()):
    """Signs -1, 0 or 1 (blocks,) of the branch from the rows A (rows, nv), in NumPy or traced; no derivative passes.

    Args: held: velocity columns whose coordinates are given.
    """
    top = system.topology
    columns, block, combine, steady = loop_blocks(system, held)
    xp = np if isinstance(A, np.ndarray) else jnp
    length = np.asarray(system.length) if xp is np else system.length
    unit = xp.where(rows_are_lengths(system)[top.position_rows], 1.0 / length, 1.0)
    size = xp.where(np.asarray(top.spins)[columns] > 0, 1.0, length)
    scaled = unit.astype(A.dtype)[:, None] * A[top.position_rows][:, columns] * size.astype(A.dtype)[None]
    inside = block[:, None] == block[None]  # what the columns of blocks before do has no part in a sign
    square = xp.where(inside, combine.astype(A.dtype) @ scaled, 0.0).astype(A.dtype)
    return xp.where(steady, determinant_signs(square, block, _SINGULAR_PIVOT[A.dtype.itemsize]), 0.0).astype(A.dtype)


def loop_blocks(system: System, held: Sequence[int] = ()) -> LoopBlocks:
    """The blocks of coupled loops that determine the columns which are not held, from the structure alone.

    Drives of joints make no block.
    """
    top, touched = system.topology, row_dependence(system)
    wanted = touched.any(0) & ~np.isin(np.arange(top.num_velocities), _independent_columns(top, held))
    driven = {row.name for row in system.rows if isinstance(row, Drive)}
    names, random = np.array(top.row_joint, str)[top.position_rows], np.random.default_rng(_SEED)
    turns = np.isin(np.arange(len(touched)), top.analysis.pose_dependent_rows if top.analysis else ())
    parts: list[tuple] = []
    for columns, rows in _ordered_blocks(touched & wanted, names, dict(top.analysis.ranks if top.analysis else ())):
        if driven.issuperset(names[rows]):
            continue
        combine = np.zeros((len(columns), len(touched)))
        square = len(rows) == len(columns)
        combine[:, rows] = np.eye(len(rows)) if square else _random_combinations(random, len(columns), len(rows))
        parts.append((columns, combine, not np.any(turns[rows])))
    return LoopBlocks(
        np.concatenate([np.zeros(0, int), *(part[0] for part in parts)]),
        np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts]),
        np.concatenate([np.zeros((0, len(touched))), *(part[1] for part in parts)]),
        np.array([part[2] for part in parts], bool),
    )


def _ordered_blocks(open_columns, names, ranks):
    """Columns and rows of the blocks, in an order of solution.

    First joints whose rows alone determine the columns still open there, one by one; the rest is split into coupled
    blocks.

    Args: open_columns (rows, nv): True where a row depends on an unknown column; names: of the rows; ranks:
    of the rows of a name.
    """
    open_columns, left = open_columns.copy(), dict(ranks)
    while True:
        counts = {name: np.count_nonzero(open_columns[names == name].any(0)) for name in left}
        name = next((name for name, count in counts.items() if 0 < count <= ranks[name]), None)
        if name is None:
            break
        columns = np.nonzero(open_columns[names == name].any(0))[0]
        others = np.delete(open_columns, columns, axis=1).any(1)
        yield columns, np.nonzero(open_columns[:, columns].any(1) & ~others)[0]
        open_columns[:, columns] = False
    columns = np.nonzero(open_columns.any(0))[0]
    number, block = coupled_blocks(open_columns[:, columns])
    for k in range(number):
        mine = columns[block == k]
        yield mine, np.nonzero(open_columns[:, mine].any(1))[0]


def coupled_blocks(touched):
    """(number of blocks, block (columns,) of each column): columns that share a row (rows, columns) are in one."""
    if not touched.shape[1]:
        return 0, np.zeros(0, int)
    return connected_components(touched.T.astype(int) @ touched.astype(int), directed=False)


def _random_combinations(random, n, m):
    """Random rows (n, m), orthonormal as far as there are enough."""
    return np.linalg.qr(random.normal(size=(m, max(n, m))))[0][:n] if n <= m else random.normal(size=(n, m))


def row_dependence(system: System) -> np.ndarray:
    """Boolean matrix (position rows, nv): True where a row may depend on a column, from the structure alone."""
    top = system.topology
    parts = [np.zeros((0, top.num_velocities), bool)]
    for group in system.closures:
        parts.append(np.repeat(closures.path_difference(system, group) != 0, group.kind.num_rows, axis=0))
    names = np.array(top.row_joint[sum(map(len, parts)) :], str)
    for row in system.rows:
        reads = np.full(top.num_velocities, not row.columns)
        reads[list(row.columns)] = True
        parts.append(np.repeat(reads[None], np.count_nonzero(names == row.name), axis=0))
    return np.concatenate(parts)[top.position_rows]


def _independent_columns(top, held):
    """As many columns as there are freedoms of position, the held ones first: each is matched to an independent one
    that moves it."""
    if top.analysis is None:
        return tuple(held)
    dependencies, taken = top.analysis.dependencies, {}

    def place(column, tried):
        for k in dependencies[column] if dependencies else ():
            if k not in tried:
                tried.add(k)
                if k not in taken or place(taken[k], tried):
                    taken[k] = column
                    return True
        return False

    for column in [*held, *(k for k in top.analysis.independent_positions if k not in held)]:
        place(column, set())
    return tuple(taken.values())
