"""The branch on which loops are closed: per block of coupled loops, the sign of the determinant of their rows.

With the held coordinates at their values a loop closes in several ways, each a branch.  Two of them meet only where
the rows no longer determine the other coordinates (a dead point): there the determinant of the rows' Jacobian in
these coordinates passes through zero.  So its sign is constant along a motion on one branch.
"""

import heapq
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_sparse
from ..constraints import _closures as closures
from ..constraints._constraints import rows_are_lengths
from ..constraints._linear_rows import FrontalRows
from ..math._determinant import determinant_signs
from ..model._rows import drives, row_elements
from ..model._system import System

_SINGULAR_PIVOT = {
    8: 1e-7,
    4: 1e-4,
}  # relative pivots up to which a pose counts as singular: states close to some 1e-10
_SEED = 3  # of the combinations of redundant rows: any, but always the same


class LoopBlock(NamedTuple):
    """A block of coupled loops, determined by its rows once the blocks before it are.

    Attributes:
        columns: (n,) velocity columns that depend on the held ones and blocks before.
        rows: (m,) its position rows; combine: (n, m) that makes as many rows of redundant ones as there are columns.
        steady: false where the redundancy depends on the pose, so that no fixed combination is valid.
    """

    columns: np.ndarray
    rows: np.ndarray
    combine: np.ndarray
    steady: bool


def branch_signs(system: System, A, held: Sequence[int] = ()):
    """Signs -1, 0 or 1 (blocks,) of the branch from the rows A (rows, nv), in NumPy or traced; no derivative passes.

    Args: A: a matrix, dense or sparse of SciPy, or `FrontalRows`; held: velocity columns whose coordinates are given.
    """
    top = system.topology
    if isinstance(A, FrontalRows):
        return _signs_by_blocks(system, A, loop_blocks(system, held))
    blocks, least = loop_blocks(system, held), _SINGULAR_PIVOT[A.dtype.itemsize]
    is_host = isinstance(A, np.ndarray) or is_sparse(A)
    xp, length = (np, np.asarray(system.length)) if is_host else (jnp, system.length)
    unit = xp.where(rows_are_lengths(system), 1.0 / length, 1.0).astype(A.dtype)
    size = xp.where(np.asarray(top.spins) > 0, 1.0, length).astype(A.dtype)
    if is_host:
        return np.array([_block_sign(A, unit, size, top.position_rows, block, least) for block in blocks], A.dtype)
    columns, block, combine, steady = _blocks_together(blocks, len(top.position_rows))
    scaled = unit[top.position_rows, None] * A[top.position_rows][:, columns] * size[columns][None]
    inside = block[:, None] == block[None]  # what the columns of blocks before do has no part in a sign
    square = jnp.where(inside, combine.astype(A.dtype) @ scaled, 0.0).astype(A.dtype)
    return jnp.where(steady, determinant_signs(square, block, least), 0.0).astype(A.dtype)


def _block_sign(A, unit, size, position_rows, block, least):
    """The sign of one block, on the host."""
    if not block.steady:
        return 0.0
    rows = position_rows[block.rows]
    part = A[rows][:, block.columns]
    part = part.toarray() if is_sparse(part) else part
    square = block.combine @ (unit[rows, None] * part * size[block.columns][None])
    return determinant_signs(square.astype(A.dtype), np.zeros(len(square), int), least)[0]


def _signs_by_blocks(system, rows, blocks):
    """The signs from the entries of the rows, for all blocks of one size at once."""
    from scipy.sparse import csr_array

    top, (row, column, values) = system.topology, rows.entries()
    values = jnp.append(lax.stop_gradient(values), 0.0)
    place = csr_array((np.arange(1, len(row) + 1), (row, column)), (top.num_rows, top.num_velocities))
    unit = jnp.where(rows_are_lengths(system), 1.0 / system.length, 1.0).astype(values.dtype)
    size = jnp.where(np.asarray(top.spins) > 0, 1.0, system.length).astype(values.dtype)
    signs, least = jnp.zeros(len(blocks), values.dtype), _SINGULAR_PIVOT[values.dtype.itemsize]
    shapes = [block.combine.shape if block.steady else None for block in blocks]
    for shape in dict.fromkeys(shapes):
        alike = np.array([k for k, each in enumerate(shapes) if each == shape is not None], int)
        if not len(alike):
            continue
        own = np.array([top.position_rows[blocks[k].rows] for k in alike])
        columns = np.array([blocks[k].columns for k in alike])
        at = np.array([place[r][:, c].toarray() - 1 for r, c in zip(own, columns, strict=True)])
        part = values[at] * unit[own][:, :, None] * size[columns][:, None]
        square = jnp.asarray(np.array([blocks[k].combine for k in alike]), values.dtype) @ part
        one = lambda A: determinant_signs(A, np.zeros(len(A), int), least)[0]
        signs = signs.at[alike].set(jax.vmap(one)(square))
    return signs


def _blocks_together(blocks, num_rows):
    """(columns (n,), number of the block of each (n,), combinations (n, position rows), steady (blocks,))."""
    columns, steady = [block.columns for block in blocks], np.array([block.steady for block in blocks], bool)
    combine = np.zeros((sum(map(len, columns)), num_rows))
    number = np.repeat(np.arange(len(blocks)), [len(x) for x in columns])
    for k, block in enumerate(blocks):
        combine[np.ix_(np.nonzero(number == k)[0], block.rows)] = block.combine
    return np.concatenate([np.zeros(0, int), *columns]), number, combine, steady


def loop_blocks(system: System, held: Sequence[int] = ()) -> list[LoopBlock]:
    """The blocks of coupled loops that determine the columns which are not held, from the structure alone.

    Drives of joints make no block.
    """
    top, touched = system.topology, row_dependence(system)
    wanted = touched.any(0) & ~np.isin(np.arange(top.num_velocities), _independent_columns(top, held))
    driven = {row.name for row in drives(system.rows)}
    names, random = np.array(top.row_joint, str)[top.position_rows], np.random.default_rng(_SEED)
    turns = np.isin(np.arange(len(touched)), top.analysis.pose_dependent_rows if top.analysis else ())
    blocks = []
    for columns, rows in _ordered_blocks(touched & wanted, names, dict(top.analysis.ranks if top.analysis else ())):
        if driven.issuperset(names[rows]):
            continue
        n, m = len(columns), len(rows)
        combine = np.eye(n) if n == m else _random_combinations(random, n, m)
        blocks.append(LoopBlock(columns, rows, combine, not np.any(turns[rows])))
    return blocks


def _ordered_blocks(open_columns, names, ranks):
    """Columns and rows of the blocks, in an order of solution.

    First joints whose rows alone determine the columns still open there, one by one; the rest is split into coupled
    blocks.

    Args: open_columns (rows, nv): True where a row depends on an unknown column; names: of the rows; ranks:
    of the rows of a name.
    """
    open_columns, reads, readers = open_columns.copy(), {}, {}
    for row, column in zip(*np.nonzero(open_columns), strict=True):
        reads.setdefault(str(names[row]), set()).add(column)
        readers.setdefault(column, set()).add(str(names[row]))
    place = {name: k for k, name in enumerate(ranks)}
    free = sorted((place[name], name) for name in place if 0 < len(reads.get(name, ())) <= ranks[name])
    while free:
        _, name = heapq.heappop(free)
        if not reads[name]:
            continue
        columns = np.array(sorted(reads[name]))
        rows = np.nonzero(open_columns[:, columns].any(1))[0]
        yield columns, rows[open_columns[rows].sum(1) == open_columns[np.ix_(rows, columns)].sum(1)]
        open_columns[:, columns] = False
        for other in set().union(*(readers[column] for column in columns)):
            reads[other].difference_update(columns)
            if other in place and 0 < len(reads[other]) <= ranks[other]:
                heapq.heappush(free, (place[other], other))
    columns = np.nonzero(open_columns.any(0))[0]
    number, block = coupled_blocks(open_columns[:, columns])
    for k in range(number):
        mine = columns[block == k]
        yield mine, np.nonzero(open_columns[:, mine].any(1))[0]


def coupled_blocks(touched):
    """(number of blocks, block (columns,) of each column): columns that share a row (rows, columns) are in one."""
    count = touched.shape[1]
    block, before = np.arange(count), np.full(count, -1)
    while np.any(block != before):  # the least column that is reached, twice as far in every round
        before, of_row = block, np.where(touched, block[None], count).min(axis=1, initial=count)
        block = np.minimum(block, np.where(touched, of_row[:, None], count).min(axis=0, initial=count))
        block = block[block]
    firsts, block = np.unique(block, return_inverse=True)
    return len(firsts), block


def _random_combinations(random, n, m):
    """Random rows (n, m), orthonormal as far as there are enough."""
    return np.linalg.qr(random.normal(size=(m, max(n, m))))[0][:n] if n <= m else random.normal(size=(n, m))


def row_dependence(system: System) -> np.ndarray:
    """Boolean matrix (position rows, nv): True where a row may depend on a column, from the structure alone."""
    top = system.topology
    parts = [np.zeros((0, top.num_velocities), bool)]
    for group in system.closures:
        parts.append(np.repeat(closures.path_difference(system, group) != 0, group.kind.num_rows, axis=0))
    for row in row_elements(system.rows):
        reads = np.full(top.num_velocities, row.may_read_all)
        reads[list(row.columns)] = True
        parts.append(np.repeat(reads[None], len(row.places), axis=0))
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
