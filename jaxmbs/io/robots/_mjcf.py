"""Mechanisms from MJCF: MuJoCo's own compiler reads the file, what it makes of it is declared here."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ...builder import SystemBuilder
from ...errors import ModelFileError
from ...forces import Force
from ...joints import Weld
from ...typing import ArrayLike
from ._actuators import add_actuators
from ._equalities import add_equalities
from ._imported import Imported, JointLimits, UniqueNames, count_nouns, frame_names_of_joints, quote_names
from ._link_tree import IDENTITY, LinkJoint, TreeLink, declare_links
from ._mjcf_text import MjcfText, mjcf_text
from ._mujoco_model import FREE, SCALAR, initial_coordinates, link_joints, rotation_of_quaternion
from ._reading_options import require_choices
from ._springs import add_springs
from ._stops import add_stops, describe_ignored_limits
from ._tendons import add_tendons, describe_sides


def read_mjcf(
    path: str | os.PathLike,
    *,
    fixed: str = "frames",
    stops: float | None = None,
    tendons: str = "read",
    armature: str = "rotors",
    friction: str = "smooth",
    controls: Mapping[str, ArrayLike | Callable] | None = None,
) -> Imported:
    """A mechanism from an MJCF file (extra `io`): bodies, joints, sites as frames, equalities as loops and couplers,
    springs, dampers, friction losses, tendons, compensated gravity, and actuators as force elements of their names.

    Names and coordinates are the file's; what has no name is called by its body.  Included files and meshes are read
    inside the file's folder only, meshes only where a body has its mass from them.  A fixed tendon is a coordinate of
    its name, tied to its joints by a coupler; a spatial one is a path.  Equalities hold exactly, whatever their
    `solref` and `solimp`.  Contacts and whatever else is not there are left out and listed.

    Args:
        fixed: "frames" makes bodies without joints named frames of the body that carries them, their mass added to
            it; "welds" keeps them bodies, so that `reactions` gives what their fastening carries.
        stops: stiffness of the bump stops that limits of joints become [N m/rad^2 or N/m^2]; None makes none.
        tendons: "read" them, "drop" them with all that hangs on them, or "refuse" the file.
        armature: "rotors" makes a flywheel coupled to the joint of each, which adds a coordinate and a coupler and is
            exact; "drop" leaves them out.
        friction: "smooth" makes losses of joints and tendons smooth Coulomb friction, "joint.friction"; "ignore"
            leaves them out.
        controls: of actuators by name, numbers or functions of time (default: zero).

    Raises: ModelFileError for what the file may not have and what MuJoCo refuses; UnknownNameError for controls of no
    actuator; ValueError for unknown options; ImportError without MuJoCo.
    """
    path = Path(path)
    require_choices(fixed=fixed, tendons=tendons, armature=armature, friction=friction)
    text = mjcf_text(path, tendons)
    model, said = _compile(path, text)
    dropped = text.dropped + [f"MuJoCo warns: {' '.join(line.split())}" for line in said]
    return _import_model(model, dropped, fixed == "welds", stops, armature == "rotors", friction, controls or {})


def _compile(path: Path, text: MjcfText):
    """The compiled model, and what MuJoCo warns of, which it would write to a file in the folder one works in."""
    import mujoco

    said: list[str] = []
    mujoco.set_mju_user_warning(said.append)
    try:
        return mujoco.MjModel.from_xml_string(text.xml, text.assets), said
    except (ValueError, mujoco.FatalError) as error:
        lines = str(error).strip().splitlines() or ["no reason given"]
        raise ModelFileError(path, [f"MuJoCo refuses it: {' '.join(lines)}"]) from error
    finally:
        mujoco.set_mju_user_warning(None)


def _import_model(model, dropped, welds, stops, rotors, friction, controls):
    builder = SystemBuilder(_gravity(model))
    names = UniqueNames("ground", *frame_names_of_joints(model.joint(j).name for j in range(model.njnt)))
    bodies = [None, *(names(model.body(k).name or f"body{k}") for k in range(1, model.nbody))]
    joint_names = UniqueNames()
    joints = [joint_names(name) for name in _joint_names(model, bodies)]
    homes = declare_links(
        builder, [_link(model, k, bodies, joints, joint_names) for k in range(1, model.nbody)], welds
    )
    home = [homes[name] for name in bodies]
    sites = _add_sites(builder, model, home, bodies, names)
    limits = _limits(model, joints)
    dropped = [*dropped, *_describe_omissions(model, bodies, joints)]
    tendons, more, left = add_tendons(builder, model, home, joints, joint_names, stops, friction)
    limits |= more
    dropped += left + add_equalities(builder, model, home, joints, tendons, joint_names)
    dropped += add_springs(builder, model, joints, rotors, friction)
    dropped += add_actuators(builder, model, joints, tendons, sites, controls)
    _lift(builder, model, home, bodies)
    add_stops(builder, limits, stops)
    dropped += describe_ignored_limits(limits, stops)
    poses = {
        model.key(k).name or f"key{k}": initial_coordinates(model, joints, model.key_qpos[k])
        for k in range(model.nkey)
    }
    notes = names.notes("the body or site") + joint_names.notes("the joint, tendon or equality")
    notes += describe_sides(model, tendons) + _describe_equalities(model)
    return Imported(
        builder, tuple(dropped), limits, initial_coordinates(model, joints, model.qpos0), poses, tuple(notes)
    )


def _add_sites(builder, model, home, bodies, names) -> list[str]:
    """Frames at the sites; their names."""
    found = []
    for k in range(model.nsite):
        body = model.site_bodyid[k]
        found.append(names(model.site(k).name or f"{bodies[body] or 'ground'}.site{k}"))
        R, p = home[body].pose
        turned = R @ rotation_of_quaternion(model.site_quat[k])
        builder.frame(found[-1], home[body].body, R @ model.site_pos[k] + p, turned)
    return found


def _lift(builder, model, home, bodies):
    """Forces "body.gravcomp" on bodies whose gravity is compensated."""
    for k in range(1, model.nbody):
        share, (R, p) = float(model.body_gravcomp[k]), home[k].pose
        if share and np.any(_gravity(model)):
            at = (home[k].body, R @ model.body_ipos[k] + p)
            builder.force(f"{bodies[k]}.gravcomp", Force(-share * model.body_mass[k] * _gravity(model)), on=at)


def _describe_equalities(model) -> list[str]:
    import mujoco

    off = model.opt.disableflags & (mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    number = 0 if off else int(np.sum(model.eq_active0))
    return (
        [f"{count_nouns(number, 'equality', 'equalities')} hold exactly: solref and solimp are ignored"]
        if number
        else []
    )


def _gravity(model):
    import mujoco

    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    return np.zeros(3) if off else np.array(model.opt.gravity)


def _joint_names(model, bodies):
    kinds = ("free", "ball", "slide", "hinge")
    return [
        model.joint(j).name or f"{bodies[model.jnt_bodyid[j]]}.{kinds[model.jnt_type[j]]}" for j in range(model.njnt)
    ]


def _link(model, k, bodies, joints, names) -> TreeLink:
    own = range(model.body_jntadr[k], model.body_jntadr[k] + model.body_jntnum[k])
    floats = any(model.jnt_type[j] == FREE for j in own)  # its coordinates are its place in the world
    place = IDENTITY if floats else (rotation_of_quaternion(model.body_quat[k]), np.array(model.body_pos[k]))
    R = rotation_of_quaternion(model.body_iquat[k])
    inertia = R @ np.diag(model.body_inertia[k]) @ R.T
    made = tuple(link_joints(model, own, joints)) or (LinkJoint(names(f"{bodies[k]}.weld"), Weld()),)
    parent = bodies[model.body_parentid[k]]
    return TreeLink(bodies[k], parent, place, made, float(model.body_mass[k]), np.array(model.body_ipos[k]), inertia)


def _limits(model, joints):
    found = {}
    for j, name in enumerate(joints):
        if model.jnt_type[j] not in SCALAR:
            continue
        lower, upper = model.jnt_range[j] if model.jnt_limited[j] else (-np.inf, np.inf)
        effort = model.jnt_actfrcrange[j][1] if model.jnt_actfrclimited[j] else np.inf
        limits = JointLimits(float(lower), float(upper), effort=float(effort))
        if limits != JointLimits():
            found[name] = limits
    return found


def _describe_omissions(model, bodies, joints):
    """Describe the parts of the compiled model that the mechanism lacks."""
    touching = int(np.sum((model.geom_contype | model.geom_conaffinity) != 0))
    if touching:
        yield f"contacts of {count_nouns(touching, 'shape')}"
    held = [bodies[k] for k in range(1, model.nbody) if model.body_mocapid[k] >= 0]
    if held:
        yield f"the motion of the bodies {quote_names(held)}, which stand still (mocap)"
    turned = [joints[j] for j in range(model.njnt) if model.jnt_limited[j] and model.jnt_type[j] not in SCALAR]
    if turned:
        yield f"limits of the ball joints {quote_names(turned)}"
    if model.opt.density or model.opt.viscosity or np.any(model.opt.wind):
        yield "the forces of the fluid around it (density, viscosity, wind)"
