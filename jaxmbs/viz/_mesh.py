"""Display meshes of structures, linear systems and elastic bodies, and the translations of their nodes."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..checks import no_such
from ..coupling._network import ComponentNetwork
from ..elements._solid import AbstractSolid
from ..errors import ModelError, UnknownNameError
from ..fem._structure import Structure
from ..linear._system import LinearSystem
from ..reductions._base import Reduced

_MAX_BARS = 3  # stiff pairs for each node; a system with more is taken as reduced, its nodes coupled to all others


class DisplayMesh(NamedTuple):
    """Nodes by name at rest (nodes, 3) [m]; cells, edges, bars and single nodes as indices of nodes.

    Cells have shape (k, 4); triangles repeat their last node.
    """

    names: tuple[str, ...]
    rest: np.ndarray
    cells: np.ndarray
    edges: np.ndarray
    bars: np.ndarray
    balls: np.ndarray

    def node_translations(self, labels, x) -> np.ndarray:
        """Translations (..., nodes, 3) of displacements x (..., rows) with labels (node, direction)."""
        place, x = {name: k for k, name in enumerate(self.names)}, np.asarray(x)
        rows = [(r, place[n], "xyz".index(d)) for r, (n, d) in enumerate(labels) if n in place and d and d in "xyz"]
        found = np.zeros((*x.shape[:-1], len(self.names), 3), x.dtype)
        if rows:
            r, node, direction = np.array(rows).T
            found[..., node, direction] = x[..., r]
        return found

    @property
    def faces(self) -> np.ndarray:
        """Triangles (n, 3) of all cells."""
        return np.concatenate([self.cells[:, :3], self.cells[self.cells[:, 2] != self.cells[:, 3]][:, [0, 2, 3]]])

    @property
    def extent(self) -> float:
        """The largest edge of its box [m]."""
        return float(np.max(np.ptp(self.rest, axis=0), initial=0.0)) or 1.0


def display_mesh(what: Structure | LinearSystem) -> DisplayMesh:
    """The mesh of a structure; of a linear system its nodes, joined where few of them are stiffly coupled.

    Raises: ModelError for a linear system whose nodes have no positions.
    """
    return _structure_mesh(what) if isinstance(what, Structure) else _system_mesh(what)


def _structure_mesh(structure):
    quads, bars, balls = [], [], []
    for group in structure.groups.values():
        k = group.connections
        if isinstance(group.element, AbstractSolid):
            quads += [k[:, [*side, side[-1]][:4]] for side in group.element.rule.sides]
        elif k.shape[1] in (3, 4):
            quads.append(k[:, [0, 1, 2, -1]])
        elif k.shape[1] == 2:
            bars.append(k)
        else:
            balls.append(k[:, :1])
    quads = _boundary_faces(np.concatenate([*quads, np.zeros((0, 4), int)]))
    edges = np.concatenate([quads[:, [i, (i + 1) % 4]] for i in range(4)])
    edges = np.unique(np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1), axis=0)
    bars = np.concatenate([*bars, np.zeros((0, 2), int)])
    balls = np.unique(np.concatenate([*(b.ravel() for b in balls), bars.ravel()]).astype(int))
    return DisplayMesh(structure.names, np.asarray(structure.positions, float), quads, edges, bars, balls)


def _boundary_faces(quads):
    """Boundary faces (k, 4): those that belong to one element only."""
    if len(quads) == 0:
        return quads
    _, where, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    return quads[np.sort(where[count == 1])]


def _system_mesh(system):
    if system.positions is None:
        raise ModelError("a linear system without node positions cannot be drawn: give structures= or positions=")
    none = np.zeros((0, 4), int)
    nodes = np.arange(len(system.nodes))
    return DisplayMesh(
        system.nodes, np.asarray(system.positions, float), none, none[:, :2], _stiff_pairs(system), nodes
    )


def _stiff_pairs(system):
    """Pairs of nodes that are coupled by stiffness; none if nearly all nodes are coupled."""
    numbers = {name: k for k, name in enumerate(system.nodes)}
    node = np.array([numbers.get(name, -1) if direction else -1 for name, direction in system.coordinates])
    K = system.stiffness
    if not hasattr(K, "ndim") or np.size(K) > 10**7:
        return np.zeros((0, 2), int)
    rows, columns = np.nonzero(np.abs(np.asarray(K)) > 0)
    pairs = np.stack([node[rows], node[columns]], axis=1)
    pairs = np.unique(np.sort(pairs[(pairs[:, 0] != pairs[:, 1]) & np.all(pairs >= 0, axis=1)], axis=1), axis=0)
    return pairs if len(pairs) <= _MAX_BARS * len(system.nodes) else pairs[:0]


def moving_meshes(system: LinearSystem, x: Any, structures: Any = None) -> dict[str, tuple[DisplayMesh, np.ndarray]]:
    """Meshes by component ("" for a single system) and the translations (T, nodes, 3) of their nodes.

    Args:
        x: displacements (T, n), those of what was reduced or joined are expanded.
        structures: the structure of a linear system, or structures by component of a network.

    Raises: ModelError without positions; UnknownNameError for a component that is not there.
    """
    if isinstance(system, ComponentNetwork):
        given = dict(structures or {})
        wrong = [no_such("component", name, system.names) for name in given if name not in system.names]
        if wrong:
            raise UnknownNameError("; ".join(wrong))
        parts = zip(system.names, system.components, system.expand(np.asarray(x)).values(), strict=True)
        found = {}
        for name, component, own in parts:
            if name in given or component.positions is not None:
                mesh = display_mesh(given.get(name, component))
                found[name] = mesh, mesh.node_translations(component.whole, own)
        return found
    if isinstance(structures, Mapping):
        (structures,) = structures.values()
    labels = system.coordinates
    if isinstance(system, Reduced) and structures is not None:
        x, labels = system.expand(np.asarray(x)), system.whole
    mesh = display_mesh(system if structures is None else structures)
    return {"": (mesh, mesh.node_translations(labels, x))}
