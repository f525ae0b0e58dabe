"""Craig-Bampton reduction of large components in blocks: one factorisation, its solutions in chunks of columns."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix, Pattern, analyse, factor, solve
from ..structures.block_modes import lowest_modes
from .base import Reduced, check_num_modes, numbered, partition


class Parts(NamedTuple):
    """A pattern cut in two: blocks, edges and patterns of the interior and of the interface, edges between them."""

    blocks: tuple[np.ndarray, np.ndarray]
    edges: tuple[np.ndarray, np.ndarray]
    patterns: tuple[Pattern, Pattern]
    across: np.ndarray
    ends: tuple[np.ndarray, np.ndarray]
    swapped: np.ndarray


def large_craig_bampton(
    stiffness: BlockMatrix,
    mass: BlockMatrix,
    interface: Sequence[int],
    num_modes: int,
    chunk: int = 64,
    positions=None,
) -> Reduced:
    """Craig-Bampton reduction of a component whose dense matrices would be too large.

    Args:
        stiffness, mass: symmetric, on one pattern, as of `structures.assemble_blocks`.
        interface: blocks (nodes) of the interface, all their coordinates, in this order.
        num_modes: lowest fixed-interface modes kept, at least one.
        chunk: constraint modes solved together; memory beside the results grows with this.
        positions: (blocks, 3) of the nodes on the host, for a better order of elimination.

    Derivatives of first order with respect to the matrices, forward and reverse, solve by the same factor.

    Raises: ValueError for more modes than there are, or an interface that is not there.

    Returns: basis (blocks * size, r), the interface first.  Fails: non-finite values where the held interface leaves
    a mechanism.  Source: S1 (4)-(8).
    """
    parts = parts_of(stiffness.pattern, tuple(int(i) for i in interface))
    inner, outer = parts.blocks
    n, b = stiffness.pattern.shape
    k = len(outer) * b
    check_num_modes(num_modes, int(parts.patterns[0].sizes.sum()))
    plan = analyse(parts.patterns[0], positions=None if positions is None else np.asarray(positions)[inner])
    K = factor(_within(stiffness, parts, 0), "cholesky", plan)
    M = _within(mass, parts, 0)
    K_across, M_across = _across(stiffness, parts), _across(mass, parts)

    @jax.checkpoint
    def columns(E):
        S = -solve(K, _to_interior(K_across, parts, E))
        inertia = M @ S + _to_interior(M_across, parts, E)
        return S, inertia, _to_interface(K_across, parts, S), _to_interface(M_across, parts, S)

    count = -(-k // chunk)
    E = jnp.eye(k, count * chunk, dtype=stiffness.diagonal.dtype).reshape(len(outer), b, count, chunk)
    S, inertia, pull, drag = (_flat(Y, k) for Y in lax.map(columns, jnp.moveaxis(E, 2, 0)))
    modes = lowest_modes(K, M, num_modes)
    basis = jnp.zeros((n, b, k + num_modes), S.dtype)
    basis = basis.at[outer, :, :k].set(jnp.eye(k, dtype=S.dtype).reshape(len(outer), b, k))
    basis = basis.at[inner].set(jnp.concatenate([S, modes.shapes], axis=1).reshape(len(inner), b, -1))
    basis = basis.reshape(n * b, -1)
    static = _within(stiffness, parts, 1).dense() + pull
    M_oo, M_oq = _within(mass, parts, 1).dense() + drag + S.T @ inertia, inertia.T @ modes.shapes
    zero, eye = jnp.zeros_like(M_oq), jnp.eye(num_modes, dtype=S.dtype)
    labels = numbered("interface", k) + numbered("normal", num_modes)
    return Reduced(
        basis,
        jnp.block([[(M_oo + M_oo.T) / 2, M_oq], [M_oq.T, eye]]),
        jnp.block([[(static + static.T) / 2, zero], [zero.T, jnp.diag(modes.values)]]),
        None,
        jnp.eye(k, k + num_modes, dtype=S.dtype),
        labels,
    )


@lru_cache(maxsize=32)
def parts_of(pattern: Pattern, interface: tuple[int, ...]) -> Parts:
    """The interior and the interface of a pattern, on the host; ValueError as `partition`.  Source: S1 (4)."""
    inner, outer = partition(pattern.num_blocks, interface)
    place, side = np.zeros(pattern.num_blocks, int), np.zeros(pattern.num_blocks, int)
    place[inner], place[outer], side[outer] = np.arange(len(inner)), np.arange(len(outer)), 1
    first, second = pattern.edges.T
    edges, patterns = [], []
    for s, blocks in enumerate((inner, outer)):
        own = np.flatnonzero((side[first] == s) & (side[second] == s))
        own_pattern = Pattern(len(blocks), pattern.size, place[pattern.edges[own]], sizes=pattern.sizes[blocks])
        pairs = np.sort(place[pattern.edges[own]], axis=1)
        edges.append(own[np.lexsort((pairs[:, 1], pairs[:, 0]))])
        patterns.append(own_pattern)
    across = np.flatnonzero(side[first] != side[second])
    swapped = side[first[across]] == 1
    ends = np.where(swapped, second[across], first[across]), np.where(swapped, first[across], second[across])
    return Parts((inner, outer), tuple(edges), tuple(patterns), across, tuple(place[e] for e in ends), swapped)


def _within(matrix, parts, side):
    """The blocks of one side; those of the interface may stand in another order."""
    pattern, blocks, edges = parts.patterns[side], parts.blocks[side], parts.edges[side]
    upper, (i, j) = matrix.upper[edges], matrix.pattern.edges[edges].T
    place = np.zeros(matrix.pattern.num_blocks, int)
    place[blocks] = np.arange(len(blocks))
    turned = jnp.asarray(place[i] > place[j])[:, None, None]
    return BlockMatrix(pattern, matrix.diagonal[blocks], jnp.where(turned, jnp.swapaxes(upper, 1, 2), upper))


def _across(matrix, parts):
    """Blocks A[interior, interface]."""
    upper = matrix.upper[parts.across]
    return jnp.where(jnp.asarray(parts.swapped)[:, None, None], jnp.swapaxes(upper, 1, 2), upper)


def _to_interior(across, parts, E):
    (i, o), shape = parts.ends, (len(parts.blocks[0]), *E.shape[1:])
    return jnp.zeros(shape, E.dtype).at[i].add(across @ E[o])


def _to_interface(across, parts, S):
    (i, o), shape = parts.ends, (len(parts.blocks[1]), *S.shape[1:])
    return jnp.zeros(shape, S.dtype).at[o].add(jnp.swapaxes(across, 1, 2) @ S[i])


def _flat(Y, k):
    """(chunks, blocks, size, columns) -> (blocks * size, k)."""
    return jnp.moveaxis(Y, 0, 2).reshape(Y.shape[1] * Y.shape[2], -1)[:, :k]
