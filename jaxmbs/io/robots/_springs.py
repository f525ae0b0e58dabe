"""Springs, dampers, rotors and frictions of joints as MuJoCo compiles them, by the names of their joints."""

import numpy as np

from ...forces import Bushing, PolynomialSpring, SpringDamper
from ...joints import Coupler, Revolute
from ...model._pose import Pose
from ._friction import add_friction
from ._imported import quote_names
from ._mujoco_model import FREE, SCALAR, joint_slice, rotation_of_quaternion


def add_springs(builder, model, joints, rotors: bool, friction: str) -> list[str]:
    """Springs, dampers, armatures and frictions of joints; what was left out."""
    curved, loose, losses, left = [], [], {}, []
    for j, name in enumerate(joints):
        dof, scalar = joint_slice(model, j, "qvel").start, model.jnt_type[j] in SCALAR
        spring, damper = spring_numbers(model, j), damper_numbers(model, dof)
        if _yields(model, j) or (not scalar and (np.any(spring[1:]) or np.any(damper[1:]))):
            curved.append(name)
        if np.any(spring) or np.any(damper):
            _spring(builder, model, j, name, spring, damper)
        inertia, loss = armature(model, dof), friction_loss(model, dof)
        if inertia and rotors and scalar:
            add_rotor(builder, f"{name}.rotor", inertia, {name: 1.0}, f"{name}.gear")
        elif inertia:
            loose.append(name)
        if loss and scalar:
            losses[name] = loss
        elif loss:
            left.append(name)
    left += add_friction(builder, losses, friction)
    what = (("the armature", loose), ("friction losses", left), ("the curved part of springs and dampers", curved))
    return [f"{part} of the joints {quote_names(names)}" for part, names in what if names]


def spring_numbers(model, at, of: str = "jnt") -> np.ndarray:
    """Stiffnesses (n,) of a joint or tendon; MuJoCo of before 3.4 has one."""
    import mujoco

    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_SPRING
    return (0.0 if off else 1.0) * _polynomial(model, f"{of}_stiffness", at)


def damper_numbers(model, at, of: str = "dof") -> np.ndarray:
    """Damping coefficients (n,) of a freedom or tendon, with those of the actuators on it."""
    import mujoco

    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_DAMPER
    own = _polynomial(model, f"{of}_damping", at)
    for a, squared in actuators_on(model, at, of):
        own = own + squared * _polynomial(model, "actuator_damping", a)
    return (0.0 if off else 1.0) * own


def friction_loss(model, at, of: str = "dof") -> float:
    """Friction loss of a freedom or tendon, none where the file switches them off."""
    import mujoco

    off = mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return 0.0 if model.opt.disableflags & off else float(getattr(model, f"{of}_frictionloss")[at])


def armature(model, at, of: str = "dof") -> float:
    """Inertia of the rotors of a freedom or tendon, with those of the actuators on it; MuJoCo of before has fewer."""
    own = getattr(model, f"{of}_armature", np.zeros(at + 1))[at]
    return float(own + sum(squared * model.actuator_armature[a] for a, squared in actuators_on(model, at, of)))


def actuators_on(model, at, of: str):
    """(actuator, square of its gear) of those on a freedom or tendon whose dampers and rotors it has as its own."""
    import mujoco

    kinds, on_joint = mujoco.mjtTrn, of == "dof"
    among = (kinds.mjTRN_JOINT, kinds.mjTRN_JOINTINPARENT) if on_joint else (kinds.mjTRN_TENDON,)
    target = model.dof_jntid[at] if on_joint else at
    for a in range(len(model.actuator_trntype) if hasattr(model, "actuator_damping") else 0):
        if model.actuator_trntype[a] in [int(kind) for kind in among] and model.actuator_trnid[a][0] == target:
            yield a, float(gear_of(model, a)[0]) ** 2


def gear_of(model, a) -> np.ndarray:
    """The gear (6,) of an actuator."""
    return np.array(model.actuator_gear[model.actuator_outadr[a] if hasattr(model, "actuator_outadr") else a])


def _polynomial(model, array, at):
    """The linear coefficient and those of higher order."""
    return np.append(getattr(model, array)[at], getattr(model, f"{array}poly", np.zeros((at + 1, 0)))[at])


def _yields(model, j) -> bool:
    """True if the spring of a joint yields; MuJoCo before 4 has none."""
    return hasattr(model, "jnt_springyield") and bool(np.any(model.jnt_springyield[j]))


def spring_law(spring, damper, lower: float, upper: float):
    """A `SpringDamper` where it suffices, else a `PolynomialSpring`."""
    if lower == upper and not np.any(spring[1:]) and not np.any(damper[1:]):
        return SpringDamper(spring[0], damper[0], lower if spring[0] else 0.0)
    return PolynomialSpring(spring, damper, lower, upper)


def _spring(builder, model, j, name, spring, damper):
    force = f"{name}.{'spring' if np.any(spring) else 'damper'}"
    rest, kind = model.qpos_spring[joint_slice(model, j)], model.jnt_type[j]
    if kind in SCALAR:
        builder.force(force, spring_law(spring, damper, float(rest[0]), float(rest[0])), joint=name)
        return
    # of a ball or free joint: on the rotation vector from where the spring rests, of a free one on its place as well
    k, c = spring[0], damper[0]
    joint, along = builder.declared.joints[name], (k, c) if kind == FREE else (0.0, 0.0)
    at_rest = Pose(rest[:3] if kind == FREE else np.zeros(3), rotation_of_quaternion(rest[-4:]))
    ends = ((joint.parent, joint.parent_frame @ at_rest), (joint.child, joint.child_frame))
    builder.force(force, Bushing((along[0], k), (along[1], c)), between=ends)


def add_rotor(builder, name: str, inertia: float, turns: dict[str, float], gear: str, body: str = "") -> None:
    """A flywheel that turns in the ground as `sum turns_i q_i` of joints: a disc of 1 m, a radian for a metre.

    Args: name: of its joint, and of itself where it has none of its own; gear: of the coupler.
    """
    builder.body(body or name, 2 * inertia, inertia=inertia * np.array([0.5, 0.5, 1.0]))
    builder.joint(name, Revolute("z"), "ground", body or name)
    builder.constraint(gear, Coupler({name: 1.0, **{joint: -c for joint, c in turns.items()}}))
