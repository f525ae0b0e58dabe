"""Springs, dampers, rotors and actuators as MuJoCo compiles them, by the names of their joints or their own."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np

from ...checks import place_of
from ...forces import Actuator, Bushing, SpringDamper
from ...forces._fields import number
from ...forces._signals import as_signal
from ...joints import Coupler, Revolute
from ...model._pose import Pose
from ...typing import Convertible, Scalar, Vector3
from ._imported import UniqueNames, quote_names
from ._mujoco_model import FREE, SCALAR, joint_slice, rotation_of_quaternion


def add_springs(builder, model, joints, rotors) -> list[str]:
    """Springs, dampers and armatures of joints; what was left out."""
    import mujoco

    flags, bits = model.opt.disableflags, mujoco.mjtDisableBit
    curved, loose = [], []
    for j, name in enumerate(joints):
        dof = joint_slice(model, j, "qvel").start
        k = 0.0 if flags & bits.mjDSBL_SPRING else float(model.jnt_stiffness[j])
        c = 0.0 if flags & bits.mjDSBL_DAMPER else float(model.dof_damping[dof])
        if _is_nonlinear(model, j, dof):
            curved.append(name)
        if k or c:
            _spring(builder, model, j, name, k, c)
        inertia = float(model.dof_armature[dof])
        if inertia and rotors and model.jnt_type[j] in SCALAR:
            _rotor(builder, name, inertia)
        elif inertia:
            loose.append(name)
    dropped = [f"the armature of the joints {quote_names(loose)}"] if loose else []
    return dropped + (
        [f"the curved part of springs and dampers of the joints {quote_names(curved)}"] if curved else []
    )


def _is_nonlinear(model, j, dof) -> bool:
    """True if a spring or damper of the joint is not linear; MuJoCo before 4 has none."""
    of = (("jnt_stiffnesspoly", j), ("jnt_springyield", j), ("dof_dampingpoly", dof))
    return any(np.any(getattr(model, array)[at]) for array, at in of if hasattr(model, array))


def _spring(builder, model, j, name, k, c):
    force = f"{name}.{'spring' if k else 'damper'}"
    rest = model.qpos_spring[joint_slice(model, j)]
    kind = model.jnt_type[j]
    if kind in SCALAR:
        builder.force(force, SpringDamper(k, c, float(rest[0]) if k else 0.0), joint=name)
        return
    # of a ball or free joint: on the rotation vector from where the spring rests, of a free one on its place as well
    joint, along = builder.declared.joints[name], (k, c) if kind == FREE else (0.0, 0.0)
    at_rest = Pose(rest[:3] if kind == FREE else np.zeros(3), rotation_of_quaternion(rest[-4:]))
    ends = ((joint.parent, joint.parent_frame @ at_rest), (joint.child, joint.child_frame))
    builder.force(force, Bushing((along[0], k), (along[1], c)), between=ends)


def _rotor(builder, joint, inertia):
    """A flywheel that turns in the ground as the joint moves, a radian for a radian or metre: a disc of 1 m."""
    name = f"{joint}.rotor"
    builder.body(name, 2 * inertia, inertia=inertia * np.array([0.5, 0.5, 1.0]))
    builder.joint(name, Revolute("z"), "ground", name)
    builder.constraint(f"{joint}.gear", Coupler({joint: 1.0, name: -1.0}))


class ServoEffort(eqx.Module):
    """`gear (gain u + bias . (1, gear x, gear v))` of a control u(t), the affine actuators of MuJoCo."""

    control: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    gain: Convertible[Scalar] = eqx.field(converter=number)
    bias: Convertible[Vector3] = eqx.field(converter=number)
    gear: Convertible[Scalar] = eqx.field(converter=number)

    def __call__(self, x, v, t):
        own = self.bias[0] + self.gear * (self.bias[1] * x + self.bias[2] * v)
        return self.gear * (self.gain * self.control(t) + own)


def add_actuators(builder, model, joints, controls) -> list[str]:
    """Actuators on hinges and slides, affine in control, length and velocity; what was left out.

    Raises: UnknownNameError for controls of none of them.
    """
    taken = [*builder.declared.forces, *(f"{joint}.stop" for joint in joints)]
    names, dropped, made, limited = UniqueNames("drives", *taken), [], set(), []
    for a in range(len(model.actuator_trntype)):
        own = model.actuator(a).name or f"actuator{a}"
        name = names(own)
        why = _unsupported_reason(model, a)
        if why:
            dropped.append(f"the actuator {name!r}: {why}")
            continue
        bias = np.array(model.actuator_biasprm[a][:3]) if model.actuator_biastype[a] else np.zeros(3)
        gear = model.actuator_gear[_output(model, a)][0]
        law = Actuator(ServoEffort(controls.get(own, 0.0), model.actuator_gainprm[a][0], bias, gear))
        builder.force(name, law, joint=joints[model.actuator_trnid[a][0]])
        made.add(own)
        if model.actuator_forcelimited[a] or model.actuator_ctrllimited[a]:
            limited.append(name)
    for name in controls:
        place_of("actuator", name, made)
    dropped += [f"the name of the actuator {old!r}, called {new!r} here" for new, old in names.renamed.items()]
    return dropped + ([f"limits of control and force of the actuators {quote_names(limited)}"] if limited else [])


def _output(model, a):
    return model.actuator_outadr[a] if hasattr(model, "actuator_outadr") else a


def _unsupported_reason(model, a) -> str:
    """Reason why an actuator is not a function of its joint's coordinate and rate; empty if it is one."""
    import mujoco

    if model.actuator_trntype[a] != int(mujoco.mjtTrn.mjTRN_JOINT):
        return "it acts on no joint"
    if model.jnt_type[model.actuator_trnid[a][0]] not in SCALAR:
        return "its joint has several coordinates"
    if model.actuator_dyntype[a] != int(mujoco.mjtDyn.mjDYN_NONE):
        return "it has a state of its own"
    affine = (int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE))
    if model.actuator_gaintype[a] != int(mujoco.mjtGain.mjGAIN_FIXED) or model.actuator_biastype[a] not in affine:
        return "its force is not affine in control, length and velocity"
    return ""
