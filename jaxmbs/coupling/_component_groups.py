"""Components of equal size one above the other, and the block matrices that they are assembled to."""

from collections.abc import Sequence
from functools import lru_cache

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..blocksparse import BlockMatrix, Pattern
from ..checks import is_concrete
from ..linear._block_rows import BlockRows, NumberTable
from ..linear._symmetric import ASYMMETRY_TOLERANCE
from ..reductions._base import Reduced
from ..runtime import jit

#: Sizes of blocks among which the least padded one is chosen.
BLOCK_SIZES = range(1, 9)


class ComponentGroup(eqx.Module):
    """Components with equal numbers of coordinates.

    Attributes:
        members: (s,) their numbers in the network.
        places: (s, k) rows of the network that each of them touches; that of the ground is the number of rows.
        mass, stiffness, damping: (s, r, r); damping None where none of them has any.
        num_interface: number of their interface coordinates, which come first.
        transformation: (s, r, k) of each one's coordinates by these rows, None for the identity.
    """

    members: NumberTable = eqx.field(static=True)
    places: NumberTable = eqx.field(static=True)
    mass: Float[Array, "s r r"]
    stiffness: Float[Array, "s r r"]
    damping: Float[Array, "s r r"] | None
    num_interface: int = eqx.field(static=True)
    transformation: Float[Array, "s r k"] | None = None

    def coordinates(self, padded: Array) -> Array:
        """Coordinates (s, r, ...) of the components, from rows (n + 1, ...) of the network, the last one zero."""
        own = padded[self.places.numbers]
        return own if self.transformation is None else contract(self.transformation, own)

    def add_forces(self, padded: Array, forces: Array) -> Array:
        """Rows (n + 1, ...) with forces (s, b, ...) on the first coordinates of the components added."""
        b, places = forces.shape[1], self.places.numbers
        if self.transformation is not None:
            forces = contract(jnp.swapaxes(self.transformation[:, :b], 1, 2), forces)
            b = places.shape[1]
        return padded.at[places[:, :b]].add(forces.astype(padded.dtype))

    def absolute(self) -> "ComponentGroup":
        """The group with the magnitudes of its transformation, for sums of sizes."""
        if self.transformation is None:
            return self
        return eqx.tree_at(lambda g: g.transformation, self, jnp.abs(self.transformation))


def component_groups(components: Sequence[Reduced], places: Sequence, num_rows: int) -> tuple[ComponentGroup, ...]:
    """Group components by their numbers of coordinates.

    Args: places: by component, rows of the network, -1 for the ground.
    """
    members: dict[tuple, list[int]] = {}
    for k, c in enumerate(components):
        members.setdefault((c.num_rows, c.num_interface, c.damping is None), []).append(k)
    groups = []
    for own in members.values():
        rows = np.array([places[k] for k in own], int)
        mass, stiffness = (_stack([getattr(components[k], kind) for k in own]) for kind in ("mass", "stiffness"))
        given = [components[k].damping for k in own]
        damping = None if given[0] is None else _stack(given)
        table = NumberTable(np.where(rows < 0, num_rows, rows))
        b = components[own[0]].num_interface
        groups.append(ComponentGroup(NumberTable(own), table, mass, stiffness, damping, b))
    return tuple(groups)


def block_layout(groups: Sequence[ComponentGroup], num_rows: int) -> tuple[Pattern, BlockRows]:
    """Pattern of the blocks, and their rows: rows that touch the same components stand together.

    Blocks are as large as pads least: work in a front grows with the square of its padded size.
    """
    touched: list[list[int]] = [[] for _ in range(num_rows + 1)]
    for group in groups:
        for member, row in zip(group.members.numbers.tolist(), group.places.numbers.tolist(), strict=True):
            for place in row:
                touched[place].append(member)
    alike: dict[tuple, list[int]] = {}
    for row, own in enumerate(touched[:-1]):
        alike.setdefault(tuple(own), []).append(row)
    counts = np.array([len(rows) for rows in alike.values()])
    size = min(BLOCK_SIZES, key=lambda b: np.sum(np.ceil(counts / b) ** 2 * (b * b + 4)))
    cut = [(own, rows[k : k + size]) for own, rows in alike.items() for k in range(0, len(rows), size)]
    rows = np.full((len(cut), size), -1)
    of_member: dict[int, list[int]] = {}
    for block, (own, part) in enumerate(cut):
        rows[block, : len(part)] = part
        for member in own:
            of_member.setdefault(member, []).append(block)
    pairs = [np.array([(i, j) for i in own for j in own if i < j]).reshape(-1, 2) for own in of_member.values()]
    edges = np.concatenate(pairs) if pairs else np.zeros((0, 2), int)
    return Pattern(len(cut), size, edges, sizes=[len(part) for _, part in cut]), BlockRows(rows)


def assemble_groups(
    groups: Sequence[ComponentGroup], pattern: Pattern, rows: BlockRows
) -> dict[str, BlockMatrix | None]:
    """Block matrices of a network by kind, and None for a damping that no component has.

    Lower blocks are left out where all matrices are known to be symmetric: those that are traced are not.
    Source: S1 (9)-(12).
    """
    given = {kind: [(g, getattr(g, kind)) for g in groups] for kind in ("mass", "stiffness", "damping")}
    even = _are_symmetric([A for parts in given.values() for _, A in parts if A is not None])
    return {
        kind: _assemble(tuple(pair for pair in parts if pair[1] is not None), pattern, rows, even)
        if any(A is not None for _, A in parts)
        else None
        for kind, parts in given.items()
    }


def _are_symmetric(stacks):
    if not is_concrete(stacks):
        return False
    values = [np.asarray(A) for A in stacks]
    return all(
        np.max(np.abs(A - A.transpose(0, 2, 1)), initial=0.0) <= ASYMMETRY_TOLERANCE**2 * np.max(np.abs(A), initial=0)
        for A in values
    )


@jit
def _assemble(parts, pattern, rows, even):
    n, b = pattern.shape
    e = pattern.num_edges
    pool = jnp.zeros((n + 2 * e + 1, b, b), parts[0][1].dtype)
    for group, A in parts:
        T = group.transformation
        A = A if T is None else jnp.swapaxes(T, 1, 2) @ A @ T
        coordinates, target = _block_tables(group.places, pattern, rows)
        s, m = coordinates.shape[:2]
        A = jnp.pad(A, [(0, 0), (0, 1), (0, 1)])
        which, flat = np.arange(s)[:, None, None], coordinates.reshape(s, -1)
        A = A[which, flat[:, :, None], flat[:, None, :]].reshape(s, m, b, m, b).transpose(0, 1, 3, 2, 4)
        pool = pool.at[target].add(A)
    return BlockMatrix(pattern, pool[:n], pool[n : n + e], None if even else pool[n + e : -1])


@lru_cache(maxsize=256)
def _block_tables(places, pattern, rows):
    """Coordinates (s, m, size) of every component in the blocks that it touches, one too many for none, and rows
    (s, m, m) of the pool of blocks (diagonal, upper, lower, unused) that they are added to."""
    (n, b), e = pattern.shape, pattern.num_edges
    place_of = np.full(len(rows) + 1, n * b)
    place_of[:-1] = rows.places
    touched = place_of[places.numbers]
    own = [np.unique(blocks[blocks < n]) for blocks in touched // b]
    (s, k), m = touched.shape, max(map(len, own))
    coordinates, blocks = np.full((s, m, b), k), np.full((s, m), -1)
    for c, used in enumerate(own):
        blocks[c, : len(used)] = used
        inside = np.flatnonzero(touched[c] < n * b)
        coordinates[c, np.searchsorted(used, touched[c, inside] // b), touched[c, inside] % b] = inside
    i, j = blocks[:, :, None], blocks[:, None, :]
    keys = pattern.edges[:, 0] * n + pattern.edges[:, 1]
    edge = np.searchsorted(keys, np.minimum(i, j) * n + np.maximum(i, j))
    target = np.where(i == j, i, n + edge + np.where(i < j, 0, e))
    return coordinates, np.where((i < 0) | (j < 0), n + 2 * e, target)


def _stack(matrices):
    """One array of many matrices; known ones on the host: programs of hundreds of arguments compile slowly."""
    return jnp.asarray(np.stack(list(map(np.asarray, matrices)))) if is_concrete(matrices) else jnp.stack(matrices)


def contract(A: Array, x: Array) -> Array:
    """Products (s, r, ...) of matrices (s, r, k) and vectors (s, k, ...)."""
    return jnp.einsum("srk,sk...->sr...", A.astype(x.dtype), x)
