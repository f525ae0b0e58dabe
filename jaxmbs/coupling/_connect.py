"""Components joined by named bonds into a network."""

from collections.abc import Mapping
from typing import Protocol, overload, runtime_checkable

import numpy as np

from ..errors import ModelError
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..reductions._base import interface_first
from ._alignment import alignment_faults
from ._bonds import Bond, resolve_interface
from ._measured_network import MeasuredNetwork, bond_channels
from ._network import ComponentNetwork
from ._primal_assembly import joined_system
from ._rigid_body import RigidBody
from ._rigid_links import dependence, dependent_system
from ._ties import axes_faults, bond_ties, joint_numbers


@runtime_checkable
class HasSystem(Protocol):
    """What has a linear system: small motions of a mechanism, a floating frame."""

    @property
    def system(self) -> LinearSystem: ...


@overload
def connect(  # type: ignore[overload-overlap]
    components: Mapping[str, LinearSystem | HasSystem], bonds: Mapping[str, Bond], places: bool = True
) -> ComponentNetwork:
    """Models alone: a linear system."""


@overload
def connect(
    components: Mapping[str, LinearSystem | HasSystem | TransferFunctions],
    bonds: Mapping[str, Bond],
    places: bool = True,
) -> MeasuredNetwork:
    """With measured ones: receptances alone."""


def connect(
    components: Mapping, bonds: Mapping[str, Bond], places: bool = True
) -> ComponentNetwork | MeasuredNetwork:
    """Components joined by bonds of `rigid`, `joint` and `bushing`, all by name: a linear system with bonds.

    `connect({"stage": a, "payload": b}, {"bolts": rigid("stage.top", "payload.foot")})`.  What no bond ties stays
    free.

    Args:
        components: by name, linear systems, whole or reduced, their interface where bonds may be; a `RigidBody` with
            its points; a mechanism as `linearise` gives it; measured `TransferFunctions`, whose interface are the
            channels that are both driven and measured.  With such the result is a `MeasuredNetwork`, which answers
            `frequency_response`.
        bonds: by name; a bushing is a component of its own, with the bond's name.
        places: whether joined nodes must be at one place, where their positions are known.

    Raises: ModelError with every fault: unknown names, ends that do not match, bonds that tie what is tied already,
    nodes that are apart, rigid bonds of rigid bodies that statics does not determine.
    Source: S1 (1)-(3), (9)-(12), (21)-(25).
    """
    if not components:
        raise ModelError(["no component is given: a network has one or more, by name"])
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
    fields = joined_system(tuple(parts.values()), at, labels)
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


def _linear_system(component):
    """The linear system that a component is, or has: small motions of a mechanism, a floating frame."""
    own = None if isinstance(component, LinearSystem) else getattr(component, "system", None)
    return own if isinstance(own, LinearSystem) else component


def _joint_labels(parts, joints, points):
    """Places of every component's coordinates in the joined ones; a joint has the name of its first member."""
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
    """Positions of all nodes, where they are known and no bond turns the coordinates of one."""
    if any(c.positions is None for c in components.values()) or any(b.axes is not None for b in bonds.values()):
        return None
    return {
        f"{name}.{node}": place
        for name, c in components.items()
        for node, place in zip(c.nodes, c.positions, strict=True)
    }


def _resolve_ends(parts, points, bonds, found):
    """Components, and points of rigid bodies, whose ends at bonds with axes are resolved in these."""
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
