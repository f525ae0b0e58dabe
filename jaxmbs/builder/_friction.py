"""Friction in joints: faults of what is declared, and the `JointFriction` of a system."""

import numpy as np

from ..checks import any_concrete, is_concrete, no_such, require_reals
from ..friction._groups import group_models
from ..friction._joint_friction import JointFriction
from ..friction._places import place_faults
from ._arrays import stack, to_numpy
from ._declarations import Friction, Joint

#: Joints that rub, and the numbers each takes beside those that all do.
_WITH_RADIUS = ("Revolute", "Universal", "Cylindrical", "Spherical", "Screw")
_NEEDS: dict[str, str | None] = dict.fromkeys(_WITH_RADIUS, "radius")
_NEEDS |= {"Prismatic": None, "Planar": None}
_HAVE_LENGTH = ("Revolute", "Universal", "Prismatic", "Cylindrical", "Planar")
_CYCLES = (np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),)  # takes z to x
_CYCLES += (_CYCLES[0] @ _CYCLES[0],)  # takes z to y


def friction_faults(item: Friction, joints: dict[str, Joint], others: dict[str, Friction]) -> list[str]:
    """Faults of one friction element, one sentence each."""
    where = f"friction {item.name!r}"
    if item.joint not in joints:
        return [f"{where}: {no_such('joint', item.joint, joints)}"]
    kind = type(joints[item.joint].kind).__name__
    if kind not in _NEEDS:
        return [f"{where}: joint {item.joint!r} is a {kind}; friction is for {', '.join(_NEEDS)}"]
    found = [f"{where}: {fault}" for fault in _number_faults(item)]
    if _NEEDS[kind] and item.radius is None:
        found.append(f"{where}: joint {item.joint!r} is a {kind}; give radius= [m], at which its surface rubs")
    if kind == "Prismatic" and item.radius is not None:
        found.append(f"{where}: joint {item.joint!r} is a Prismatic, which does not turn; leave radius out")
    if kind not in _HAVE_LENGTH and item.length is not None:
        found.append(f"{where}: joint {item.joint!r} is a {kind}, whose friction has no length; leave it out")
    wrong = place_faults(item.friction, "a joint") or item.friction.faults()
    found += [f"{where}: {fault}" for fault in wrong]
    twice = [other.name for other in others.values() if other.joint == item.joint and other is not item]
    if twice:
        found.append(f"{where}: joint {item.joint!r} has the friction {twice[0]!r} already")
    return found


def _number_faults(item):
    """Faults of the numbers."""
    bounds = {
        "radius": (lambda x: x <= 0, "must be positive"),
        "length": (lambda x: x <= 0, "must be positive"),
        "preload": (lambda x: x < 0, "must not be negative"),
    }
    found = []
    for name, (is_wrong, message) in bounds.items():
        value = getattr(item, name)
        if value is None and name in ("radius", "length"):
            continue
        if not is_concrete(value):
            found += [f"{name} must be one number, got shape {np.shape(value)}"] if np.shape(value) else []
            continue
        try:
            require_reals(value)
            number = np.asarray(value, float)
        except (TypeError, ValueError, OverflowError):
            found.append(f"{name} must be one number, got {value!r}")
            continue
        if number.shape or not np.isfinite(number):
            found.append(f"{name} must be one finite number, got {value!r}")
        elif any_concrete(is_wrong, number):
            found.append(f"{name} {message}, got {float(number):g}")
    return found


def joint_friction_of(friction: dict[str, Friction], joints: dict[str, Joint], record) -> JointFriction | None:
    """The friction of a system's joints, None where there is none; record: of each joint by name."""
    rows = [row for item in friction.values() for row in _surfaces(item, joints[item.joint].kind, record[item.joint])]
    if not rows:
        return None
    names, kinds, axes, points, bases, items = zip(*rows, strict=True)
    mine = [record[item.joint] for item in items]
    index = {name: k for k, name in enumerate(record)}

    def numbers(field, default=1.0):
        given = [getattr(item, field) for item in items]
        return stack([default if value is None else value for value in given], float)

    return JointFriction(
        names=names,
        joints=tuple(index[item.joint] for item in items),
        kinds=kinds,
        axes=axes,
        points=points,
        parents=tuple(r.frames[0] for r in mine),
        children=tuple(r.frames[1] for r in mine),
        basis=stack(bases, float),
        models=group_models([item.friction for item in items], stack),
        radius=numbers("radius", 0.0),
        length=numbers("length"),
        preload=numbers("preload"),
        pitch=stack([joints[item.joint].kind.lead() for item in items], float),
    )


def _surfaces(item, kind, record):
    """Rows (name, kind, axes, point, basis, item) of one friction element: two for a universal joint."""
    name, basis, (parent, child) = type(kind).__name__, to_numpy(kind.basis()), record.frames
    key = name if item.length is None else f"{name} with length"
    if name == "Universal":  # the first axis is fixed in the parent, the second in the child
        return [
            (f"{item.name}.{which}", key, frame, child, basis @ cycle, item)
            for which, frame, cycle in zip(("first", "second"), (parent, child), _CYCLES, strict=True)
        ]
    return [(item.name, key, child if name == "Spherical" else parent, child, basis, item)]
