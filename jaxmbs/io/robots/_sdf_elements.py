"""Numbers, poses, inertias and axes as SDF elements say them; what they cannot be goes to a list of faults."""

from typing import NamedTuple

import numpy as np

from .._numbers import real
from ._imported import JointLimits
from ._inertias import check_inertia
from ._mujoco_model import rotation_of_quaternion
from ._urdf_elements import rotation_of_rpy

_AXES = ("xx", "yy", "zz", "xy", "xz", "yz")


def text_number(where, element, tag, faults, default: float | None = None) -> float:
    """The number in a child; it must be there where no default is given."""
    found = None if element is None else element.find(tag)
    if found is None or not (found.text or "").strip():
        if default is None:
            faults.append(f"{where}: <{tag}> is missing")
        return default or 0.0
    try:
        return real(found.text.strip())
    except ValueError:
        faults.append(f"{where}: <{tag}> {found.text.strip()!r} is not a number")
        return default or 0.0


def text_vector(where, element, count: int, faults) -> np.ndarray:
    """The numbers (count,) in an element, zeros where there is none."""
    text = "" if element is None else (element.text or "").strip()
    if not text:
        return np.zeros(count)
    try:
        found = np.array([real(word) for word in text.split()])
        if found.shape == (count,) and np.all(np.isfinite(found)):
            return found
    except ValueError:
        pass
    faults.append(f"{where}: {text!r} is not {count} numbers")
    return np.zeros(count)


def pose_of(where, element, faults) -> tuple:
    """(rotation, position) of a <pose>: x y z and roll pitch yaw [rad], degrees or a quaternion where it says so."""
    if element is not None and element.get("rotation_format") == "quat_xyzw":
        values = text_vector(where, element, 7, faults)
        quaternion = values[[6, 3, 4, 5]]
        norm = np.linalg.norm(quaternion)
        return (rotation_of_quaternion(quaternion / norm) if norm else np.eye(3)), values[:3]
    values = text_vector(where, element, 6, faults)
    turned = np.radians(values[3:]) if element is not None and element.get("degrees") == "true" else values[3:]
    return rotation_of_rpy(*turned), values[:3]


def sdf_inertial(where, element, mode, faults, notes):
    """Mass, centre of mass and inertia about it, in the link's axes; 1 kg, 1 kg m^2 where the file does not say."""
    if element is not None and element.get("auto") == "true":
        faults.append(f"{where}: its inertia is to be found from its shapes (auto), which is not supported")
    R, at = pose_of(f"{where}, inertial", None if element is None else element.find("pose"), faults)
    mass = text_number(where, element, "mass", faults, 1.0)
    own = None if element is None else element.find("inertia")
    xx, yy, zz, xy, xz, yz = (
        text_number(f"{where}, inertia", own, f"i{axes}", faults, float(axes[0] == axes[1])) for axes in _AXES
    )
    inertia = check_inertia(where, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), mode, faults, notes)
    return mass, at, R @ inertia @ R.T


class SdfAxis(NamedTuple):
    """An axis of a joint: its direction in the joint's frame, limits and laws."""

    direction: np.ndarray
    limits: JointLimits
    damping: float
    friction: float
    stiffness: float
    rest: float
    mimic: tuple | None


def sdf_axis(where, element, rotation, faults) -> SdfAxis:
    """Read an <axis>.  Args: rotation: from the axes in which it is expressed to those of the joint."""
    xyz = None if element is None else element.find("xyz")
    direction = rotation @ (np.array([0.0, 0.0, 1.0]) if xyz is None else text_vector(where, xyz, 3, faults))
    if not np.any(direction):
        faults.append(f"{where}: its axis is zero")
    limit, dynamics = (None if element is None else element.find(tag) for tag in ("limit", "dynamics"))
    lower, upper, effort, velocity = (
        text_number(where, limit, tag, faults, default)
        for tag, default in (("lower", -np.inf), ("upper", np.inf), ("effort", np.inf), ("velocity", np.inf))
    )
    lower, upper = (value if abs(value) < 1e16 else np.sign(value) * np.inf for value in (lower, upper))
    effort, velocity = (value if 0 <= value < 1e16 else np.inf for value in (effort, velocity))
    if lower > upper:
        faults.append(f"{where}: its lower limit lies above its upper one")
    damping, friction, stiffness, rest = (
        text_number(where, dynamics, tag, faults, 0.0)
        for tag in ("damping", "friction", "spring_stiffness", "spring_reference")
    )
    limits, mimic = JointLimits(lower, upper, velocity, effort), _mimic(where, element, faults)
    return SdfAxis(direction, limits, damping, friction, stiffness, rest, mimic)


def _mimic(where, element, faults):
    """(joint, axis, multiplier, offset) with the reference in the offset."""
    found = None if element is None else element.find("mimic")
    if found is None:
        return None
    factor, offset, reference = (
        text_number(where, found, tag, faults, default)
        for tag, default in (("multiplier", 1.0), ("offset", 0.0), ("reference", 0.0))
    )
    return found.get("joint", ""), found.get("axis", "axis"), factor, offset - factor * reference
