"""Structures as linear systems over named coordinates, free of load or under a preload."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..checks import as_flag
from ..elements import DIRECTIONS
from ..linear._system import LinearSystem
from ..typing import AnyArray
from ._assembly import KINDS, assemble_blocks, assemble_dense, ground_inertia
from ._prestress import stiffness_under_load
from ._structure import Structure


def assemble(
    structure: Structure, interface: Iterable = (), blocks: bool = False, preload: AnyArray | None = None
) -> LinearSystem:
    """Assemble a structure to a `LinearSystem` over named coordinates [kg, N s/m, N/m; N m and rad for rotations].

    Args:
        interface: nodes by name or number, as in the groups of the structure, or labels.
        blocks: True for block matrices on the graph of nodes, for large structures, in which held and absent
            coordinates keep uncoupled rows; by default dense arrays over the coordinates that are not held.
        preload: (rows,) [N, N m] as `gather_rows(structure, nodal_load(...))`: the system is that of small motions
            about the structure under this load, with the geometric stiffness of its stress.

    The system has the positions of the nodes, damping if an element has any, and the mass between held and other
    coordinates, which counts where the ground moves (`ground_inertia`).

    Raises: ModelError for an unknown interface, and for a concrete preload beyond buckling (under tracing
    `Modes.is_unstable` says so); ValueError for a preload of another shape or with blocks.  Source: S1 (3).
    """
    blocks = as_flag("blocks", blocks)
    if blocks and preload is not None:
        raise ValueError("a preload needs dense matrices: leave blocks=True out")
    damped = any(group.element.has_damping for group in structure.groups.values())
    kinds = KINDS if damped else KINDS[:2]
    made = (assemble_blocks if blocks else assemble_dense)(structure, kinds)
    matrices: dict[str, Any] = dict(zip(kinds, made, strict=True))
    if preload is not None:
        matrices["stiffness"] = stiffness_under_load(structure, preload)
    labels, massless = structure.labels, ()
    if blocks:  # held and absent coordinates have no mass, which a trace does not see
        massless = np.flatnonzero(structure.index.table[:, : structure.size] < 0).tolist()
        labels = [(name, direction) for name in structure.names for direction in DIRECTIONS[: structure.size]]
    places = (structure.names, structure.positions)
    interface = [_node_name(structure, item) for item in interface]
    if structure.held:
        matrices["ground_inertia"] = ground_inertia(structure, blocks)
    return LinearSystem(**matrices, interface=interface, coordinates=labels, positions=places, massless=massless)


def _node_name(structure, item):
    """Name of a node given by its number; other items unchanged, to be refused later if they are unknown."""
    known = isinstance(item, int) and 0 <= item < len(structure.names)
    return structure.names[item] if known else str(item) if isinstance(item, int) else item
