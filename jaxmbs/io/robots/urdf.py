"""Mechanisms from URDF, read by its own rules: what has no `inertial` has no mass, shapes are not looked at."""

import os
from pathlib import Path

from ...builder import SystemBuilder
from ...checks import no_such
from ...errors import ModelFileError
from ...forces import SpringDamper
from ...joints import Coupler, Free, Weld
from ...typing import ArrayLike
from .imported import Imported, JointLimits, Names, counted, listed
from .link_tree import HERE, Link, LinkJoint, declare
from .stops import add_stops, limits_left_out
from .urdf_elements import inertial, named, urdf_joint
from .xml_text import read_xml


def read_urdf(
    path: str | os.PathLike,
    *,
    base: str = "fixed",
    fixed: str = "frames",
    stops: float | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
) -> Imported:
    """A mechanism from a URDF file: links, inertias, joints, mimic joints as couplers, damping of joints.

    Joints and links keep their names.  Meshes and other shapes are never opened.  The friction that `dynamics` gives
    and what belongs to simulators (transmissions, plugins, sensors) is left out and listed.

    Args:
        base: "fixed" holds the root link in the world, "free" lets it float on a joint "base".
        fixed: "frames" makes links on fixed joints named frames of the body that carries them, their mass added to
            it; "welds" keeps them bodies, so that `reactions` gives what the fixed joint carries.
        stops: stiffness of the bump stops that limits of joints become [N m/rad^2 or N/m^2]; None makes none.
        gravity: (3,) [m/s^2].

    Raises: ModelFileError with every fault of the file; ValueError for an unknown `base` or `fixed`.
    """
    path = Path(path)
    for what, given, among in (("base", base, ("fixed", "free")), ("fixed", fixed, ("frames", "welds"))):
        if given not in among:
            raise ValueError(f"{what} = {given!r}: one of {', '.join(map(repr, among))}")
    robot = read_xml(path)
    faults: list[str] = []
    if robot.tag != "robot":
        raise ModelFileError(path, [f"its outermost element is <{robot.tag}>, that of a URDF is <robot>"])
    bodies = named(robot, "link", faults)
    joints = {name: urdf_joint(name, element, faults) for name, element in named(robot, "joint", faults).items()}
    inertias = {
        name: inertial(f"link {name!r}", element.find("inertial"), faults) for name, element in bodies.items()
    }
    order = _order(bodies, joints, faults)
    for joint in joints.values():
        if joint.mimic is not None and joint.mimic[0] not in joints:
            faults.append(f"joint {joint.name!r}: {no_such('joint', joint.mimic[0], joints)} (mimic)")
    if faults:
        raise ModelFileError(path, faults)

    carried = {joint.child: joint for joint in joints.values()}
    root = LinkJoint(Names(*joints)("base"), Weld() if base == "fixed" else Free())
    links = []
    for name in order:
        joint = carried.get(name)
        parent, place, own = (None, HERE, root) if joint is None else (joint.parent, joint.place, joint.joint)
        links.append(Link(name, parent, place, (own,), *inertias[name]))
    builder = SystemBuilder(gravity)
    declare(builder, links, welds=fixed == "welds")
    moving = [joint for joint in joints.values() if not isinstance(joint.joint.kind, Weld)]
    _laws(builder, moving)
    limits = {joint.name: joint.limits for joint in moving if joint.limits != JointLimits()}
    add_stops(builder, limits, stops)
    dropped = [*_left_out(robot, moving), *limits_left_out(limits, stops)]
    return Imported(builder, tuple(dropped), limits)


def _order(bodies, joints, faults):
    """Links from the root outwards."""
    children: dict = {name: [] for name in bodies}
    carried: dict = {}
    for joint in joints.values():
        lost = [end for end in (joint.parent, joint.child) if end and end not in bodies]
        faults += [f"joint {joint.name!r}: {no_such('link', end, bodies)}" for end in lost]
        if lost or not joint.parent or not joint.child:
            continue
        if joint.child in carried:
            faults.append(
                f"link {joint.child!r} is the child of two joints, {carried[joint.child]!r}, {joint.name!r}"
            )
            continue
        carried[joint.child] = joint.name
        children[joint.parent].append(joint.child)
    roots = [name for name in bodies if name not in carried]
    if not bodies:
        faults.append("it has no links")
    elif len(roots) > 1 and not faults:
        faults.append(f"it has {len(roots)} links that no joint carries, {listed(roots)}; a URDF has one root")
    order = roots[:1]
    for name in order:
        order += children[name]
    if len(order) < len(bodies) and not faults:
        faults.append(f"links {listed(set(bodies) - set(order))} carry one another in a ring")
    return order


def _laws(builder, joints):
    names = {joint.name for joint in joints}
    for joint in joints:
        if joint.mimic is not None:
            leader, factor, offset = joint.mimic
            led = {leader: -factor} if leader in names else {}  # a fixed joint leads nowhere
            builder.constraint(f"{joint.name}.mimic", Coupler({joint.name: 1.0, **led}, offset))
        if joint.damping and len(joint.joint.kind.nodes) == 1:
            builder.force(f"{joint.name}.damper", SpringDamper(damping=joint.damping), joint=joint.name)


def _left_out(robot, joints):
    rubbing = [joint.name for joint in joints if joint.friction]
    if rubbing:
        yield f"friction of the joints {listed(rubbing)}"
    shapes = sum(len(link.findall("collision")) for link in robot.findall("link"))
    if shapes:
        yield f"contacts of {counted(shapes, 'collision shape')}"
    known = {"link", "joint", "material"}
    for tag in dict.fromkeys(child.tag for child in robot if child.tag not in known):
        yield counted(len(robot.findall(tag)), f"<{tag}> element")
