"""`connect`: components joined by named bonds into a network."""

from collections.abc import Mapping
from typing import Protocol, overload, runtime_checkable

import numpy as np

from ..errors import ModelError
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..reductions._base import interface_first
from ._alignment import alignment_faults
from ._bonds import Bond, resolve_interface
from ._linear_solver import bond_solver
from ._measured_network import MeasuredNetwork, bond_channels
from ._network import ComponentNetwork
from ._primal_assembly import joined_system
from ._rigid_body import RigidBody
from ._rigid_links import dependence, dependent_system
from ._ties import axes_faults, bond_ties, joint_numbers


@runtime_checkable
class HasSystem(Protocol):
    """An object with a linear system: a linearised mechanism, a floating frame."""

    @property
    def system(self) -> LinearSystem: ...


@overload
def connect(  # type: ignore[overload-overlap]
    components: Mapping[str, LinearSystem | HasSystem],
    bonds: Mapping[str, Bond],
    places: bool = True,
    linear_solver: str = "auto",
) -> ComponentNetwork:
    """Join models only; the result is a linear system."""


@overload
def connect(
    components: Mapping[str, LinearSystem | HasSystem | TransferFunctions],
    bonds: Mapping[str, Bond],
    places: bool = True,
    linear_solver: str = "auto",
) -> MeasuredNetwork:
    """Join components of which some are measured; the result has receptances only."""


def connect(
    components: Mapping, bonds: Mapping[str, Bond], places: bool = True, linear_solver: str = "auto"
) -> ComponentNetwork | MeasuredNetwork:
    """Join components by bonds (`rigid_bond`, `hinge`, `bushing`), all by name, into a linear system with bonds.

    `connect({"stage": a, "payload": b}, {"bolts": rigid_bond("stage.top", "payload.foot")})`.  Coordinates
    that no bond ties stay free.

    Args:
        components: by name: linear systems, reduced or not, with their interface; a `RigidBody` with its points; a
            mechanism linearised by `linearise`; measured `TransferFunctions`, whose interface are the channels that
            are both driven and measured.  With these the result is a `MeasuredNetwork`, which has
            `frequency_response` only.
        bonds: by name; a bushing becomes a component with the name of the bond.
        places: check that bonded nodes coincide, where their positions are known.
        linear_solver: how the network is stored and solved, with equal results: "dense", or "multifrontal" (in
            blocks, for many components).  "auto" takes the faster one by the number of bonds and coordinates, which
            `describe` and the repr of the network name.

    Raises: ModelError with every fault: unknown names, ends that do not match, bonds between coordinates that are
    tied already, nodes that do not coincide, rigid bonds of rigid bodies whose forces statics does not determine.
    Source: S1 (1)-(3), (9)-(12), (21)-(25).
    """
    if not components:
        raise ModelError(["no component is given: a network needs at least one, by name"])
    components = {name: _linear_system(c) for name, c in components.items()}
    measured = {name: c for name, c in components.items() if isinstance(c, TransferFunctions)}
    bodies = {name: c for name, c in components.items() if isinstance(c, RigidBody)}
    modelled = components | {name: bond_channels(c) for name, c in measured.items()}
    modelled |= {name: c.channels for name, c in bodies.items()}
    found = bond_ties(modelled, bonds)
    faults = axes_faults(bonds, found) + (alignment_faults(modelled, bonds, found) if places else [])
    if faults:
        raise ModelError(faults)
    elements = {name: bond.element for name, bond in bonds.items() if bond.element is not None}
    sizes = {name: c.num_interface for name, c in (modelled | elements).items()}
    joints = joint_numbers(sizes, found)
    if measured:
        return MeasuredNetwork(components, bonds, found)
    parts = {
        name: c.to_reduced() if name in bodies else interface_first(c) for name, c in (components | elements).items()
    }
    parts, points = _resolve_ends(parts, {name: c.motions for name, c in bodies.items()}, bonds, found)
    at, labels = _joint_labels(parts, joints, points)
    solver = bond_solver(linear_solver, len(bonds), len(labels), _obstacle(points))
    fields = joined_system(tuple(parts.values()), at, labels, solver)
    if points:
        own, places_of = (dict(zip(parts, numbers, strict=True)) for numbers in (joints, at))
        fields = dependent_system(fields, dependence(points, own, places_of, labels, fields["massless"], found))
    return ComponentNetwork(
        components=parts.values(),
        places=at,
        names=parts,
        bonds=found.items(),
        joints=joints,
        positions=_node_positions(components, bonds) if places else None,
        points=points,
        **fields,
    )


def _obstacle(points):
    """Reason why a network cannot be stored in blocks, or ""."""
    return "a network with rigid bodies is dense: leave the choice to 'auto'" if points else ""


def _linear_system(component):
    """Linear system of a component: itself, or its `system` (of a linearised mechanism or a floating frame)."""
    own = None if isinstance(component, LinearSystem) else getattr(component, "system", None)
    return own if isinstance(own, LinearSystem) else component


def _joint_labels(parts, joints, points):
    """Indices of every component's coordinates among the joined ones, and labels; a joint is named by its first
    member.
    """
    count = 1 + max((joint for row in joints for joint in row), default=-1)
    joints = [() if name in points else row for name, row in zip(parts, joints, strict=True)]
    places, labels = [], [None] * count
    for (name, c), row in zip(parts.items(), joints, strict=True):
        named = [(f"{name}.{node}", direction) for node, direction in c.coordinates]
        for joint, label in zip(row, named, strict=False):
            if joint >= 0 and labels[joint] is None:
                labels[joint] = label
        places.append((*row, *range(len(labels), len(labels) + len(named) - len(row))))
        labels += named[len(row) :]
    return tuple(places), labels


def _node_positions(components, bonds):
    """Positions of all nodes by name, or None where some are unknown or a bond has axes of its own."""
    if any(c.positions is None for c in components.values()) or any(b.axes is not None for b in bonds.values()):
        return None
    return {
        f"{name}.{node}": place
        for name, c in components.items()
        for node, place in zip(c.nodes, c.positions, strict=True)
    }


def _resolve_ends(parts, points, bonds, found):
    """Resolve components and points of rigid bodies in the axes of the bonds that they are joined by."""
    for name, bond in bonds.items():
        for end in found[name].ends if bond.axes is not None else ():
            if not end:
                continue
            component, rows = end[0][0], np.array([k for _, k in end])
            if component in points:
                own = points[component]
                turned = bond.axes.astype(own.dtype) @ own[rows].reshape(-1, 3, 6)
                points[component] = own.at[rows].set(turned.reshape(-1, 6))
            else:
                parts[component] = resolve_interface(parts[component], bond.axes, rows)
    return parts, points
