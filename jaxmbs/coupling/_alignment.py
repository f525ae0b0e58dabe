"""Check that bonded nodes coincide; a bond between distant nodes would resist rigid rotations of the whole."""

from collections.abc import Mapping

import numpy as np

from ..checks import is_concrete
from ..elements import DIRECTIONS
from ..linear._system import LinearSystem
from ._bonds import Bond
from ._ties import Channels, Ties

#: Allowed distance of bonded nodes relative to the size of all components: positions of meshes have four digits.
GAP_TOLERANCE = 1e-3


def alignment_faults(
    components: Mapping[str, LinearSystem | Channels], bonds: Mapping[str, Bond], found: Mapping[str, Ties]
) -> list[str]:
    """Faults of bonds between nodes at different positions, where these are known.

    A tie along e of two points at a distance r acts as a rigid link if r is parallel to e and is wrong by the lever
    arm `|r x e|` else: a prop may tie two distant points in one direction, but not in three.
    """
    placed = [
        np.asarray(c.positions) for c in components.values() if c.positions is not None and is_concrete(c.positions)
    ]
    if not placed:
        return []
    size = np.linalg.norm(np.ptp(np.concatenate(placed), axis=0))
    faults = []
    for name, bond in bonds.items():
        gaps = [_lever_arm(components, bond, found[name], k) for k in found[name].kept]
        lever, *gap = max(gaps, key=lambda gap: gap[0], default=(0.0,))
        if lever > GAP_TOLERANCE * size:
            faults.append(f"bond {name!r}: {_describe_gap(*gap)}")
    return faults


def _lever_arm(components, bond, ties, k):
    """Lever arm, the two nodes and their offset for one tied direction; the arm is 0 where it is not known."""
    nothing, (first, second) = (0.0, "", "", None), ties.ends
    if not second or ties.labels[k] not in DIRECTIONS[:3]:
        return nothing
    (one, p), (other, q) = (_end_position(components, end[k]) for end in (first, second))
    if p is None or q is None or not is_concrete(bond.axes):
        return nothing
    axis = DIRECTIONS.index(ties.labels[k])
    along = (np.eye(3) if bond.axes is None else np.asarray(bond.axes))[axis]
    return np.linalg.norm(np.cross(p - q, along)), one, other, p - q


def _end_position(components, coordinate):
    name, k = coordinate
    c = components[name]
    node, _ = c.coordinates[c.interface[k]]
    if c.positions is None or not is_concrete(c.positions) or node not in c.nodes:
        return "", None
    return f"{name}.{node}", np.asarray(c.positions)[c.nodes.index(node)]


def _describe_gap(one, other, offset):
    by = ", ".join(f"{x:.4g}" for x in offset)
    return (
        f"{one} and {other} are {np.linalg.norm(offset):.3g} m apart: shift a component, "
        f"`{other.partition('.')[0]}.translate(({by}))`, or skip this check by `connect(..., places=False)`"
    )
