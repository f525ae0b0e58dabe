"""Groups of like elements, and the validation of their declarations."""

from collections.abc import Callable, Iterable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import flag, is_concrete, no_such
from ..elements import DIRECTIONS, AbstractElement
from ..tables import sentence_repr
from ..typing import AnyArray


class Group(eqx.Module):
    """Elements of one kind.

    Attributes:
        element: one element whose numbers serve all (`shared`), or one with stacked leaves (elements, ...).
        nodes: node numbers of every element.
    """

    element: AbstractElement
    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    shared: bool = eqx.field(static=True, converter=flag("shared"))

    __repr__, _repr_html_ = sentence_repr(
        lambda group: (
            f"{len(group.nodes)} elements {type(group.element).__name__}" + (", all alike" if group.shared else "")
        )
    )

    @property
    def connections(self) -> np.ndarray:
        """(elements, k) node numbers."""
        return np.array(self.nodes, int).reshape(len(self.nodes), -1)

    def map(self, function: Callable, positions: AnyArray, *others: AnyArray) -> Array:
        """Map `function(element, nodes (k, 3), ...)` over all elements; results are stacked."""
        axes = (None if self.shared else 0, 0, *[0] * len(others))
        return jax.vmap(function, in_axes=axes)(self.element, positions[self.connections], *others)

    def degeneracy_faults(self, name: str, positions: AnyArray) -> list[str]:
        """Faults of degenerate elements, if the positions are concrete."""
        if not is_concrete(positions) or not self.nodes:
            return []
        bad = self.element.is_degenerate(np.asarray(positions, float)[self.connections])
        return [f"{name}[{k}]: {self.element.degeneracy}" for k in np.nonzero(bad)[0]]


def make_group(name, element, connections, index, faults) -> Group | None:
    """Make a group of one element for all connections, or one for each; `index` numbers the nodes by name.

    Returns: None, with a fault appended, for an empty sequence of elements.
    """
    shared = isinstance(element, AbstractElement)
    members = [element] if shared or not isinstance(element, Iterable) else list(element)
    if not all(isinstance(member, AbstractElement) for member in members):
        faults.append(f"{name} needs an element, or a list of them, not {element!r}")
        return None
    rows = connections.tolist() if hasattr(connections, "tolist") else connections
    if not members:
        faults.append(f"{name} has no elements")
        return None
    rows = [(row,) if isinstance(row, str | int | np.integer) else row for row in rows]
    nodes = [tuple(node_number(n, index, name, faults) for n in row) for row in rows]
    kind = members[0]
    for k, row in enumerate(nodes):
        if len(row) != kind.num_nodes:
            faults.append(f"{name}[{k}] joins {len(row)} nodes, a {type(kind).__name__} has {kind.num_nodes}")
        if len(set(row)) < len(row):
            faults.append(f"{name}[{k}] repeats a node")
    if not shared and len(members) != len(nodes):
        faults.append(f"{name} has {len(members)} elements for {len(nodes)} connections")
    faults += [f"{name}[{k}]: {fault}" for k, member in enumerate(members) for fault in member.faults()]
    if len({jax.tree.structure(member) for member in members}) > 1:
        faults.append(f"{name}: the elements of a group must be of one kind with equal settings: make two groups")
        return Group(kind, tuple(nodes), True)
    stacked = element if shared else jax.tree.map(lambda *leaves: jnp.stack(leaves), *members)
    return Group(stacked, tuple(nodes), shared)


def node_number(node, index, name, faults) -> int:
    """Number of a node by its name or number; 0 and a fault where there is none."""
    if str(node) not in index:
        faults.append(f"{name}: {no_such('node', node, index)}")
    return index.get(str(node), 0)


def held_pairs(held, index, faults) -> tuple[tuple[int, int], ...]:
    """Sorted pairs (node, direction) of numbers from held directions by node."""
    pairs = set()
    for node, directions in held.items():
        names = directions.split() if isinstance(directions, str) else np.atleast_1d(directions).tolist()
        names, number = DIRECTIONS if "all" in names else names, node_number(node, index, "held", faults)
        for d in names:
            if d in DIRECTIONS:
                pairs.add((number, DIRECTIONS.index(d)))
            else:
                faults.append(f"held at {node}: unknown direction {d!r}, the directions are {', '.join(DIRECTIONS)}")
    return tuple(sorted(pairs))
