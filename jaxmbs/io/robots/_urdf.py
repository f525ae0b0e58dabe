"""Mechanisms from URDF, read by its own rules: what has no `inertial` has no mass, shapes are not looked at."""

import os
from pathlib import Path

from ...builder import SystemBuilder
from ...checks import no_such
from ...errors import ModelFileError
from ...forces import SpringDamper
from ...joints import Coupler, Free, Weld
from ...typing import ArrayLike
from ._friction import add_friction
from ._imported import Imported, JointLimits, UniqueNames, frame_names_of_joints, quote_names
from ._link_tree import IDENTITY, LinkJoint, TreeLink, declare_links
from ._reading_options import require_choices
from ._stops import add_stops, describe_ignored_limits
from ._urdf_elements import elements_by_name, inertial, mimic_faults, urdf_joint
from ._urdf_unread import describe_omissions, duplicate_faults
from ._xml_text import read_xml

_MOST_FAULTS = 50


def read_urdf(
    path: str | os.PathLike,
    *,
    base: str = "fixed",
    fixed: str = "frames",
    stops: float | None = None,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    inertias: str = "refuse",
    friction: str = "smooth",
) -> Imported:
    """A mechanism from a URDF file: links, inertias, joints, mimics as couplers, damping and friction of joints.

    Joints and links keep their names.  Meshes and other shapes are never opened.  What belongs to simulators
    (transmissions, plugins, sensors) is left out and listed.

    Args:
        base: "fixed" holds the root link in the world, "free" lets it float on a joint "base".
        fixed: "frames" makes links on fixed joints named frames of the body that carries them, their mass added to
            it; "welds" keeps them bodies, so that `reactions` gives what the fixed joint carries.
        stops: stiffness of the bump stops that limits of joints become [N m/rad^2 or N/m^2]; None makes none.
        gravity: (3,) [m/s^2].
        inertias: of principal inertias that no body can have, A + B < C: "refuse" makes them faults but where
            rounding to four digits explains them; "repair" takes the nearest that a body can have, "accept" takes
            them as they are, both with a note.
        friction: "smooth" makes the friction that `dynamics` gives smooth Coulomb friction, "joint.friction";
            "ignore" leaves it out.

    A link with a name that is taken, as "ground" is, gets another one, which `notes` says.

    Raises: ModelFileError with every fault of the file; ValueError for unknown options.
    """
    path = Path(path)
    require_choices(base=base, fixed=fixed, inertias=inertias, friction=friction)
    robot = _robot(path)
    faults, notes = list(duplicate_faults(robot)), list[str]()
    bodies = elements_by_name(robot, "link", faults)
    joints = {
        name: urdf_joint(name, element, faults) for name, element in elements_by_name(robot, "joint", faults).items()
    }
    masses = {
        name: inertial(f"link {name!r}", element.find("inertial"), inertias, faults, notes)
        for name, element in bodies.items()
    }
    order = _order(bodies, joints, faults)
    faults += mimic_faults(joints)
    if faults:
        more = [f"and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ModelFileError(path, faults[:_MOST_FAULTS] + more)

    carried = {joint.child: joint for joint in joints.values()}
    root = LinkJoint(UniqueNames(*joints)("base"), Weld() if base == "fixed" else Free())
    rename = UniqueNames("ground", *frame_names_of_joints([*joints, root.name]))
    called = {name: rename(name) for name in order}
    links = []
    for name in order:
        joint = carried.get(name)
        parent, place, own = (
            (None, IDENTITY, root) if joint is None else (called[joint.parent], joint.place, joint.joint)
        )
        links.append(TreeLink(called[name], parent, place, (own,), *masses[name]))
    builder = SystemBuilder(gravity)
    declare_links(builder, links, welds=fixed == "welds", any_inertia=inertias == "accept")
    moving = [joint for joint in joints.values() if not isinstance(joint.joint.kind, Weld)]
    notes += rename.notes("link") + _laws(builder, joints)
    limits = {joint.name: joint.limits for joint in moving if joint.limits != JointLimits()}
    add_stops(builder, limits, stops)
    losses = {joint.name: joint.friction for joint in moving if joint.friction}
    scalar = {name: loss for name, loss in losses.items() if len(joints[name].joint.kind.nodes) == 1}
    rubbing = [*(name for name in losses if name not in scalar), *add_friction(builder, scalar, friction)]
    undamped = [joint.name for joint in moving if joint.damping and len(joint.joint.kind.nodes) > 1]
    dropped = [*describe_omissions(robot, rubbing, undamped), *describe_ignored_limits(limits, stops)]
    return Imported(builder, tuple(dropped), limits, notes=tuple(notes))


def _robot(path):
    """The outermost element.  Raises: ModelFileError where it is no robot, or has macros that must be expanded."""
    robot = read_xml(path)
    if robot.tag != "robot":
        raise ModelFileError(path, [f"its outermost element is <{robot.tag}>, that of a URDF is <robot>"])
    if any("xacro}" in element.tag for element in robot.iter()):
        raise ModelFileError(path, ["it holds macros of xacro: expand them first, `xacro model.xacro > model.urdf`"])
    return robot


def _order(bodies, joints, faults):
    """Links from the root outwards."""
    children: dict = {name: [] for name in bodies}
    carried: dict = {}
    for joint in joints.values():
        lost = [end for end in (joint.parent, joint.child) if end and end not in bodies]
        faults += [
            f"joint {joint.name!r}: {no_such('link', end, bodies)}" for end in lost[: _MOST_FAULTS - len(faults)]
        ]
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
        faults.append(f"it has {len(roots)} links that no joint carries, {quote_names(roots)}; a URDF has one root")
    order = roots[:1]
    for name in order:
        order += children[name]
    if len(order) < len(bodies) and not faults:
        faults.append(f"links {quote_names(set(bodies) - set(order))} form a cycle")
    return order


def _laws(builder, joints):
    """Mimic joints as couplers, damping as dampers; notes on what mimics nothing that moves."""
    moving = {name for name, joint in joints.items() if not isinstance(joint.joint.kind, Weld)}
    names, notes = UniqueNames(*joints), []
    for name, joint in joints.items():
        if joint.mimic is not None and name in moving:
            leader, factor, offset = joint.mimic
            led = {leader: -factor} if leader in moving else {}
            builder.constraint(names(f"{name}.mimic"), Coupler({name: 1.0, **led}, offset))
            if not led or factor == 0:
                why = "its multiplier is zero" if led else f"its leader {leader!r} is fixed"
                notes.append(f"joint {name!r} is fixed at {offset:g}, the offset of its mimic: {why}")
        elif joint.mimic is not None:
            notes.append(f"joint {name!r} is fixed: its mimic has no effect")
        if joint.damping and len(joint.joint.kind.nodes) == 1:
            builder.force(f"{name}.damper", SpringDamper(damping=joint.damping), joint=name)
    return notes
