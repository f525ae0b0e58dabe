"""Units of the coordinates of a joint, for what is shown and written."""

from ._base import UNITS


def _all():
    from ._all import ALL  # where something is shown

    return ALL


def coordinate_units(kind: str, count: int) -> tuple[str, ...]:
    """Units of `count` coordinates of a joint by the name of its class; those of a quaternion have none."""
    for joint in _all():
        if joint.__name__ == kind:
            return tuple(unit for node in joint.nodes for unit in UNITS[node.kind])
    return ("m or rad",) * count


def velocity_units(kind: str, count: int) -> tuple[str, ...]:
    """Units of `count` velocities of a joint by the name of its class."""
    for joint in _all():
        if joint.__name__ == kind:
            units = [("rad",) * 3 if node.kind == "ball" else UNITS[node.kind] for node in joint.nodes]
            return tuple(f"{unit}/s" for own in units for unit in own)
    return ("m/s or rad/s",) * count
