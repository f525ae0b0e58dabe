"""Assembly of the matrices of a structure, dense or in blocks of nodes: one mapped call and one scatter per group."""

from collections.abc import Callable, Sequence
from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..blocksparse import BlockMatrix, Pattern
from ..blocksparse import assemble as summed
from ..blocksparse._matrix import constrain
from ..checks import distinct_names
from ..linear._rigid_motions import rigid_motions
from ..runtime import jit
from ._structure import Structure

KINDS = ("stiffness", "mass", "damping")


@jit
def element_matrices(structure: Structure, group: str, kind: str = "stiffness") -> Float[Array, "elements n n"]:
    """Matrices in world axes of all elements of a group.

    Args: kind: "stiffness", "mass" or "damping".  Source: S1 (30).
    """
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
    return structure.group(group).map(lambda element, nodes: getattr(element, kind)(nodes), structure.positions)


@jit
def assemble_dense(structure: Structure, kinds: Sequence[str] = ("stiffness", "mass")) -> tuple[Array, ...]:
    """Assemble (K, M), or the matrices of `kinds`, over the coordinates that are not held, in rows
    `structure.labels`.

    Source: S1 (3).
    """
    return tuple(_assemble_dense(structure, kind) for kind in distinct_names("kinds", kinds))


def _assemble_dense(structure, kind):
    return sum_dense(structure, lambda name: element_matrices(structure, name, kind))


def sum_dense(structure: Structure, matrices: Callable[[str], Array]) -> Array:
    """Sum (rows, rows) over the coordinates that are not held, of element matrices (elements, n, n) by group name."""
    index = structure.index
    n = index.num_rows
    total = jnp.zeros((n + 1, n + 1), structure.positions.dtype)  # the last row takes what is held
    for name, group in structure.groups.items():
        rows = index.table[group.connections, : group.element.coordinates].reshape(len(group.nodes), -1)
        rows = np.where(rows < 0, n, rows)
        total = total.at[rows[:, :, None], rows[:, None, :]].add(matrices(name))
    return total[:n, :n]


@jit
def ground_inertia(structure: Structure, blocks: bool = False) -> Float[Array, "rows 6"]:
    """Forces (rows, 6) [N, N m] by the mass between held and other coordinates, in unit rigid accelerations of the
    ground, rotations about the origin; in rows of the dense or the block matrices.
    """
    held = np.zeros((structure.num_nodes, 6, 1), bool)
    for node, direction in structure.held:
        held[node, direction] = True
    motions = jnp.where(held, rigid_motions(structure.positions), 0.0)
    total = jnp.zeros_like(motions)
    for name, group in structure.groups.items():
        c = group.element.coordinates
        moved = motions[group.connections, :c]
        M = element_matrices(structure, name, "mass")
        forces = M @ moved.reshape(len(M), -1, 6)
        total = total.at[group.connections, :c].add(forces.reshape(moved.shape))
    if blocks:
        return jnp.where(held, 0.0, total)[:, : structure.size].reshape(-1, 6)
    return total[structure.index.nodes, structure.index.directions]


@jit
def assemble_blocks(structure: Structure, kinds: Sequence[str] = ("stiffness", "mass")) -> tuple[BlockMatrix, ...]:
    """Assemble (K, M), or the matrices of `kinds`, as block matrices on the graph of nodes, with blocks of
    `structure.size`.

    Held coordinates stay in their blocks, uncoupled: one on the diagonal of the stiffness, zero elsewhere.  Source:
    S1 (3).
    """
    return tuple(_assemble_blocks(structure, kind) for kind in distinct_names("kinds", kinds))


def _assemble_blocks(structure, kind):
    pattern = node_pattern(structure)
    n, b = pattern.shape
    dtype = structure.positions.dtype
    total = BlockMatrix(pattern, jnp.zeros((n, b, b), dtype), jnp.zeros((pattern.num_edges, b, b), dtype))
    for name, group in structure.groups.items():
        k, c = group.element.num_nodes, group.element.coordinates
        parts = element_matrices(structure, name, kind).reshape(-1, k, c, k, c).transpose(0, 1, 3, 2, 4)
        parts = jnp.pad(parts, [(0, 0)] * 3 + [(0, b - c)] * 2)
        total = total + summed(pattern, group.connections, parts)
    return _constrain_held(structure, total, one=kind == "stiffness")


def _constrain_held(structure, matrix, one):
    if not structure.held:
        return matrix
    held = np.zeros((structure.num_nodes, 6), bool)
    for node, direction in structure.held:
        held[node, direction] = True
    return constrain(matrix, held[:, : structure.size], one)


def node_pattern(structure: Structure) -> Pattern:
    """Graph of the nodes that share an element."""
    connections = tuple(group.nodes for group in structure.groups.values())
    return _build_pattern(structure.names, connections, tuple(structure.sizes.tolist()), structure.size)


@lru_cache(maxsize=32)
def _build_pattern(names, connections, sizes, size):
    pairs = [np.zeros((0, 2), int)]
    for nodes in connections:
        nodes = np.array(nodes, int)
        first, second = np.triu_indices(nodes.shape[1], 1)
        pairs.append(np.stack([nodes[:, first].ravel(), nodes[:, second].ravel()], axis=1))
    return Pattern(len(names), size, np.concatenate(pairs), names, sizes)
