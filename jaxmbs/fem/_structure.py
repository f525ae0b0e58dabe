"""`Structure` of finite elements: named nodes, groups of like elements, held coordinates."""

from collections.abc import Hashable, Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete, no_such, place_of
from ..elements import DIRECTIONS
from ..elements._base import as_real
from ..errors import ModelError, UnknownNameError
from ..linear._storage import as_inexact
from ..tables import sentence_repr
from ..typing import AnyArray, ArrayLike
from ._groups import Group, held_pairs, make_group


class CoordinateTable(NamedTuple):
    """Row numbers of the coordinates of nodes in the dense matrices.

    Attributes:
        table: (nodes, 6) row numbers, -1 where held or absent.
        nodes, directions: (rows,) of each row.
    """

    table: np.ndarray
    nodes: np.ndarray
    directions: np.ndarray

    @property
    def num_rows(self) -> int:
        return len(self.nodes)


class Structure(eqx.Module):
    """Finite elements on named nodes; element properties and node positions are leaves, the topology is static.

    Args:
        nodes: positions (3,) [m] by name, or the names and an array (nodes, 3), or the array alone, whose names are
            numbers.
        elements: by name of the group, `(element, connections)`: a connection lists node names or numbers; the
            element is one for all, or a sequence of one per connection with equal settings.  Or a `Group`.
        held: by node, the directions held to ground: "x ry", a sequence of them, or "all".

    Raises: ModelError with every fault: no nodes or elements, unknown or repeated nodes, wrong counts, invalid
    values, degenerate elements.
    """

    positions: Float[Array, "nodes 3"]
    groups: dict[str, Group]
    names: tuple[str, ...] = eqx.field(static=True)
    held: tuple[tuple[int, int], ...] = eqx.field(static=True)

    __repr__, _repr_html_ = sentence_repr(
        lambda structure: (
            f"{structure.num_nodes} nodes; "
            + ", ".join(
                f"{name} of {len(g.nodes)} {type(g.element).__name__}" for name, g in structure.groups.items()
            )
            + f"; {len(structure.held)} coordinates held"
        )
    )

    def __init__(self, nodes: Mapping | Sequence | AnyArray, elements: Mapping, held: Mapping | None = None) -> None:
        if len(nodes) == 0:
            raise ModelError(["a structure needs at least one node"])
        names, places = _names_and_positions(nodes)
        self.names = tuple(str(name) for name in names)
        self.positions = as_real(places)
        if self.positions.shape[1:] != (3,):
            raise ModelError(f"positions of nodes have three components each, not the shape {self.positions.shape}")
        index, faults = {name: i for i, name in enumerate(self.names)}, []
        made = {name: _as_group(name, given, index, faults) for name, given in elements.items()}
        self.groups = {name: g for name, g in made.items() if g is not None}
        if not any(g is None or g.nodes for g in made.values()):
            faults.append("a structure needs at least one element")
        self.held = held_pairs(held or {}, index, faults)
        if is_concrete(self.positions):
            lost = np.flatnonzero(~np.all(np.isfinite(np.asarray(self.positions)), axis=1))
            faults += [f"the position of node {self.names[k]!r} is not finite" for k in lost]
        if not faults:
            faults = [fault for name, g in self.groups.items() for fault in g.degeneracy_faults(name, self.positions)]
        if faults:
            raise ModelError(faults)

    @property
    def num_nodes(self) -> int:
        return len(self.names)

    @property
    def size(self) -> int:
        """Coordinates per node of the block form: 6, or 3 if no element has rotations."""
        return max((group.element.coordinates for group in self.groups.values()), default=3)

    def node(self, name: Hashable) -> int:
        """Number of a node.  Raises: UnknownNameError."""
        return place_of("node", str(name), self.names)

    def group(self, name: str) -> Group:
        """Elements of a group.  Raises: UnknownNameError."""
        if name not in self.groups:
            raise UnknownNameError(no_such("group of elements", name, self.groups))
        return self.groups[name]

    @property
    def sizes(self) -> np.ndarray:
        """Numbers (nodes,) of coordinates that elements give each node: 0, 3 or 6."""
        sizes = np.zeros(self.num_nodes, int)
        for g in self.groups.values():
            np.maximum.at(sizes, g.connections.ravel(), g.element.coordinates)
        return sizes

    @property
    def index(self) -> CoordinateTable:
        """Row numbers of the coordinates of every node in the dense matrices."""
        used = np.arange(6)[None, :] < self.sizes[:, None]
        for node, direction in self.held:
            used[node, direction] = False
        table = np.where(used, np.cumsum(used).reshape(used.shape) - 1, -1)
        return CoordinateTable(table, *np.nonzero(used))

    @property
    def labels(self) -> tuple[tuple[str, str], ...]:
        """Labels (node, direction) of the rows of the dense matrices."""
        _, nodes, directions = self.index
        return tuple((self.names[n], DIRECTIONS[d]) for n, d in zip(nodes, directions, strict=True))


def gather_rows(structure: Structure, values: ArrayLike) -> Array:
    """Gather rows (..., rows) of the dense matrices from nodal values (..., nodes, 6); times or cases first.

    Raises: ValueError for another shape.
    """
    if np.shape(values)[-2:] != (structure.num_nodes, 6):
        raise ValueError(f"values must be of shape (..., {structure.num_nodes}, 6), not {np.shape(values)}")
    index = structure.index
    return jnp.asarray(values)[..., index.nodes, index.directions]


def scatter_rows(structure: Structure, x: AnyArray) -> Array:
    """Scatter rows x (..., rows) to displacements and rotations (..., nodes, 6) of the nodes; zero where held."""
    x, index = as_inexact(x), structure.index
    if x.shape[-1:] != (index.num_rows,):
        raise ValueError(f"x must be of shape (..., {index.num_rows}), not {x.shape}")
    zero = jnp.zeros((*x.shape[:-1], structure.num_nodes, 6), x.dtype)
    return zero.at[..., index.nodes, index.directions].set(x)


def _names_and_positions(nodes):
    if isinstance(nodes, Mapping):
        return nodes, jnp.stack([*map(as_real, nodes.values())])
    if isinstance(nodes, tuple) and len(nodes) == 2 and np.ndim(nodes[1]) == 2:
        return nodes
    return range(len(nodes)), nodes


def _as_group(name, given, index, faults):
    if not isinstance(given, Group):
        return make_group(name, *given, index, faults)
    faults += [f"{name}: {fault}" for fault in given.element.faults()]
    faults += [f"{name}: there is no node {k}" for k in np.unique(given.connections) if not 0 <= k < len(index)]
    return given
