"""A structure of finite elements: named nodes, groups of like elements, held coordinates."""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..elements import DIRECTIONS, AbstractElement
from ..errors import ModelError


class Group(eqx.Module):
    """Elements of one kind.

    Attributes:
        element: one element whose numbers serve all (`shared`), or one with stacked leaves (elements, ...).
        nodes: node numbers of every element.
    """

    element: AbstractElement
    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    shared: bool = eqx.field(static=True)

    def map(self, function, positions, *others):
        """`function(element, nodes (k, 3), ...)` over all elements, results stacked."""
        at = positions[np.array(self.nodes, int).reshape(len(self.nodes), self.element.num_nodes)]
        axes = (None if self.shared else 0, 0, *[0] * len(others))
        return jax.vmap(function, in_axes=axes)(self.element, at, *others)


class Structure(eqx.Module):
    """Finite elements on named nodes; numbers of elements and positions of nodes are leaves, topology is static.

    Args:
        nodes: positions (3,) [m] by name, or an array (nodes, 3), whose names are their numbers.
        elements: by name of the group, `(element, connections)`: a connection lists node names or numbers; the
            element is one for all, or a sequence of one per connection with equal settings.
        held: by node, the directions held to ground: "x ry", a sequence of them, or "all".

    Raises: ModelError with every fault: unknown nodes, wrong counts, nodes met twice, values that cannot be.
    """

    positions: Float[Array, "nodes 3"]
    groups: dict[str, Group]
    names: tuple[str, ...] = eqx.field(static=True)
    held: tuple[tuple[int, int], ...] = eqx.field(static=True)

    def __init__(self, nodes, elements: Mapping, held: Mapping | None = None):
        named = isinstance(nodes, Mapping)
        self.names = tuple(nodes) if named else tuple(str(i) for i in range(len(nodes)))
        places = jnp.stack([jnp.asarray(p) for p in nodes.values()]) if named else jnp.asarray(nodes)
        self.positions = places if jnp.issubdtype(places.dtype, jnp.floating) else places.astype(float)
        index = {name: i for i, name in enumerate(self.names)}
        faults = [] if self.positions.shape[1:] == (3,) else ["positions of nodes have three components each"]
        self.groups = {name: _group(name, *parts, index, faults) for name, parts in elements.items()}
        self.held = _held(held or {}, index, faults)
        faults += [fault for name, group in self.groups.items() for fault in _degenerate(name, group, self)]
        if faults:
            raise ModelError(faults)

    @property
    def num_nodes(self) -> int:
        return len(self.names)

    @property
    def size(self) -> int:
        """Coordinates per node of the block form: 6, or 3 where no element turns its nodes."""
        return max((group.element.coordinates for group in self.groups.values()), default=3)

    def node(self, name) -> int:
        """Number of a node. Raises: KeyError."""
        return self.names.index(str(name)) if str(name) in self.names else _unknown(name)

    @property
    def index(self) -> "Coordinates":
        """Where each node's coordinates stand in the dense matrices."""
        sizes = self.sizes
        used = np.arange(6)[None, :] < sizes[:, None]
        for node, direction in self.held:
            used[node, direction] = False
        table = np.where(used, np.cumsum(used).reshape(used.shape) - 1, -1)
        nodes, directions = np.nonzero(used)
        return Coordinates(table, nodes, directions)

    @property
    def sizes(self) -> np.ndarray:
        """(nodes,) coordinates that elements give each node: 0, 3 or 6."""
        sizes = np.zeros(self.num_nodes, int)
        for group in self.groups.values():
            np.maximum.at(sizes, np.array(group.nodes, int).ravel(), group.element.coordinates)
        return sizes

    @property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """(node, direction) of every row of the dense matrices."""
        index = self.index
        return tuple((self.names[n], DIRECTIONS[d]) for n, d in zip(index.nodes, index.directions, strict=True))


class Coordinates(NamedTuple):
    """Rows of the dense matrices: `table` (nodes, 6), -1 where held or absent; `nodes` and `directions` (rows,)."""

    table: np.ndarray
    nodes: np.ndarray
    directions: np.ndarray

    @property
    def num_rows(self) -> int:
        return len(self.nodes)


def collect(structure: Structure, values) -> Array:
    """(rows,) of the dense matrices from values (nodes, 6) at the nodes."""
    index = structure.index
    return values[index.nodes, index.directions]


def spread(structure: Structure, x) -> Array:
    """(nodes, 6) displacements and rotations from x (rows,); zero where held."""
    index = structure.index
    return jnp.zeros((structure.num_nodes, 6), x.dtype).at[index.nodes, index.directions].set(x)


def rigid_motions(positions, about=None) -> Float[Array, "nodes 6 6"]:
    """Displacements and rotations of points (nodes, 3) in unit translations and rotations about a point (3,)."""
    arms = positions if about is None else positions - jnp.asarray(about, positions.dtype)[None]
    one = jnp.broadcast_to(jnp.eye(3, dtype=arms.dtype), (len(arms), 3, 3))
    turning = jnp.swapaxes(jnp.cross(one, arms[:, None, :]), 1, 2)  # columns e_d x arm
    return jnp.concatenate(
        [jnp.concatenate([one, turning], axis=2), jnp.concatenate([jnp.zeros_like(one), one], axis=2)], axis=1
    )


def _group(name, element, connections, index, faults) -> Group:
    shared = isinstance(element, AbstractElement)
    members = [element] if shared else list(element)
    nodes = [tuple(_number(n, index, name, faults) for n in connection) for connection in _rows(connections)]
    for k, row in enumerate(nodes):
        if len(row) != members[0].num_nodes:
            faults.append(
                f"{name}[{k}] joins {len(row)} nodes, a {type(members[0]).__name__} has {members[0].num_nodes}"
            )
        if len(set(row)) < len(row):
            faults.append(f"{name}[{k}] meets a node twice")
    if not shared and len(members) != len(nodes):
        faults.append(f"{name} has {len(members)} elements for {len(nodes)} connections")
    faults += [f"{name}[{k}]: {fault}" for k, member in enumerate(members) for fault in member.faults()]
    if len({jax.tree.structure(member) for member in members}) > 1:
        faults.append(f"{name}: elements of one group need equal kinds and settings; make two groups")
        return Group(members[0], tuple(nodes), True)
    stacked = element if shared else jax.tree.map(lambda *leaves: jnp.stack(leaves), *members)
    return Group(stacked, tuple(nodes), shared)


def _rows(connections):
    return connections.tolist() if hasattr(connections, "tolist") else connections


def _number(node, index, name, faults) -> int:
    if str(node) not in index:
        faults.append(f"{name}: no node is named {node!r}")
    return index.get(str(node), 0)


def _held(held, index, faults):
    pairs = set()
    for node, directions in held.items():
        names = directions.split() if isinstance(directions, str) else list(directions)
        names = DIRECTIONS if names == ["all"] else names
        for d in names:
            if d in DIRECTIONS:
                pairs.add((_number(node, index, "held", faults), DIRECTIONS.index(d)))
            else:
                faults.append(f"held at {node}: {d!r} is none of {', '.join(DIRECTIONS)}")
    return tuple(sorted(pairs))


def _degenerate(name, group, structure):
    """Elements of two or more nodes without extent, where positions are known."""
    lengths_matter = 1 < group.element.num_nodes and not hasattr(group.element, "matrix")
    if not lengths_matter or isinstance(structure.positions, jax.core.Tracer) or not group.nodes:
        return []
    rows = [row for row in group.nodes if len(row) == group.element.num_nodes]
    at = np.asarray(structure.positions)[np.array(rows, int).reshape(len(rows), -1)]
    extent = np.ptp(at, axis=1).max(axis=1) if len(rows) else np.zeros(0)
    return [f"{name}[{k}]: its nodes lie at one point" for k in np.nonzero(extent == 0)[0]]


def _unknown(name):
    raise KeyError(f"no node is named {name!r}")
