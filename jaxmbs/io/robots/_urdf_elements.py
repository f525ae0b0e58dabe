"""Links and joints as URDF elements say them; what they cannot be goes to a list of faults."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...checks import no_such
from ...joints import AbstractJoint, Free, Planar, Prismatic, Revolute, Weld
from .._numbers import real
from ._imported import JointLimits, quote_names
from ._inertias import check_inertia
from ._link_tree import LinkJoint

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


#: Bodies of such a size [m] are points: programs of design write rounding of either sign for their inertia.
_POINT_SIZE = 1e-8


class UrdfJoint(NamedTuple):
    """A joint: its child in its parent, and what moves between them."""

    name: str
    parent: str
    child: str
    place: tuple
    joint: LinkJoint
    limits: JointLimits
    damping: float
    friction: float
    mimic: tuple | None


def elements_by_name(robot, tag, faults) -> dict:
    """Elements of one kind by name."""
    found: dict = {}
    for number, element in enumerate(robot.findall(tag)):
        name = element.get("name")
        if not name:
            faults.append(f"{tag} number {number + 1} has no name")
        elif name in found:
            faults.append(f"{tag} {name!r} is defined twice")
        else:
            found[name] = element
    return found


def _number(where, element, key, faults, default: float | None = None, unbounded: bool = False) -> float:
    """An attribute; it must be there where no default is given, and finite unless it may be unbounded."""
    value = default if element is None else element.get(key, default)
    if value is None:
        faults.append(f"{where}: {key} is missing")
        return 0.0
    try:
        number = real(str(value))
        if np.isfinite(number) or (np.isinf(number) and unbounded):
            return number
        faults.append(f"{where}: {key}={value!r} is not finite")
    except ValueError:
        faults.append(f"{where}: {key}={value!r} is not a number")
    return default or 0.0


def _vector(where, element, key, faults, default=(0.0, 0.0, 0.0)) -> np.ndarray:
    text = None if element is None else element.get(key)
    if text is None:
        return np.array(default)
    try:
        found = np.array([real(word) for word in text.split()])
        if found.shape == (3,) and np.all(np.isfinite(found)):
            return found
    except ValueError:
        pass
    faults.append(f"{where}: {key}={text!r} is not three numbers")
    return np.array(default)


def _origin(where, element, faults):
    origin = None if element is None else element.find("origin")
    return rotation_of_rpy(*_vector(where, origin, "rpy", faults)), _vector(where, origin, "xyz", faults)


def rotation_of_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rotation (3, 3) by roll, pitch and yaw [rad] about the fixed axes x, y, z in turn."""
    (sa, sb, sc), (ca, cb, cc) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    about_y = np.array([[cb, 0.0, sb], [0.0, 1.0, 0.0], [-sb, 0.0, cb]])
    about_z = np.array([[cc, -sc, 0.0], [sc, cc, 0.0], [0.0, 0.0, 1.0]])
    return about_z @ about_y @ about_x


def inertial(where, element, mode, faults, notes):
    """Mass, centre of mass and inertia about it, in the link's axes; `mode`: of inertias that no body can have."""
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    mass = _number(f"{where}, mass", element.find("mass"), "value", faults)
    R, at = _origin(f"{where}, inertial", element, faults)
    own = element.find("inertia")
    xx, yy, zz, xy, xz, yz = (
        _number(f"{where}, inertia", own, f"i{axes}", faults) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
    )
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.max(np.abs(inertia)) <= _POINT_SIZE**2 * mass:
        inertia = np.zeros((3, 3))
    inertia = check_inertia(where, inertia, mode, faults, notes)
    return mass, at, R @ inertia @ R.T


def urdf_joint(name, element, faults) -> UrdfJoint:
    """Read one <joint>."""
    where, kind = f"joint {name!r}", element.get("type")
    if kind not in _KINDS:
        faults.append(f"{where}: type={kind!r} is none of {', '.join(_KINDS)}")
    parent, child = (_end_link(where, end, element, faults) for end in ("parent", "child"))
    axis = _vector(where, element.find("axis"), "xyz", faults, (1.0, 0.0, 0.0))
    if kind not in ("fixed", "floating") and not np.any(axis):
        faults.append(f"{where}: its axis is zero")
    made: dict[str, Callable[[], AbstractJoint]] = {
        "fixed": Weld,
        "floating": Free,
        "planar": lambda: Planar(axis),
        "prismatic": lambda: Prismatic(axis),
    }
    limit, dynamics = element.find("limit"), element.find("dynamics")
    limits = JointLimits()
    if limit is not None and kind in ("revolute", "continuous", "prismatic"):
        ends_of_stroke = ("lower", "upper") if kind != "continuous" else ()
        given = {key: _number(where, limit, key, faults, 0.0, True) for key in ends_of_stroke}
        given |= {key: _number(where, limit, key, faults, np.inf, True) for key in ("velocity", "effort")}
        limits = JointLimits(**given)
        if limits.lower > limits.upper:
            faults.append(f"{where}: its lower limit lies above its upper one")
    return UrdfJoint(
        name,
        parent,
        child,
        _origin(where, element, faults),
        LinkJoint(name, made.get(kind, lambda: Revolute(axis))()),
        limits,
        _number(where, dynamics, "damping", faults, 0.0),
        _number(where, dynamics, "friction", faults, 0.0),
        _mimic(where, element.find("mimic"), faults),
    )


def mimic_faults(joints: dict[str, UrdfJoint]) -> list[str]:
    """Mimics of no joint, of a joint by itself, of or by joints of several coordinates, and rings of them."""
    faults, leaders = [], {}
    for name, joint in joints.items():
        if joint.mimic is None:
            continue
        where, leader = f"joint {name!r}", joint.mimic[0]
        if leader not in joints:
            faults.append(f"{where}: {no_such('joint', leader, joints)} (mimic)")
            continue
        if leader == name:
            faults.append(f"{where} mimics itself")
            continue
        several = [one for one in (name, leader) if len(joints[one].joint.kind.nodes) > 1]
        faults += [f"{where}: it mimics {leader!r}, but {one!r} has several coordinates" for one in several]
        leaders[name] = leader
    done: set[str] = set()
    for name in leaders:
        chain = [name]
        while (following := leaders.get(chain[-1])) is not None and following not in done and following not in chain:
            chain.append(following)
        if following in chain:
            ring = chain[chain.index(following) :]
            faults.append(f"joints {quote_names(ring)} mimic one another in a cycle")
        done |= set(chain)
    return faults


def _end_link(where, end, element, faults) -> str:
    found = element.find(end)
    link = "" if found is None else found.get("link", "")
    if not link:
        faults.append(f"{where} has no <{end} link=...>")
    return link


def _mimic(where, element, faults):
    if element is None:
        return None
    factor = _number(where, element, "multiplier", faults, 1.0)
    return element.get("joint", ""), factor, _number(where, element, "offset", faults, 0.0)
