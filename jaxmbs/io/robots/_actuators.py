"""Actuators as MuJoCo compiles them: on joints, tendons and sites, by their names."""

import numpy as np

from ...checks import place_of
from ._imported import UniqueNames
from ._mujoco_model import SCALAR
from ._servo import ServoActuator, SiteActuator
from ._springs import gear_of
from ._transmissions import Transmission


def add_actuators(builder, model, joints, tendons, site_frames, controls) -> list[str]:
    """Actuators affine in control or activation, length and velocity; what was left out.

    Raises: UnknownNameError for controls of none of them.
    """
    taken = [*builder.declared.forces, *(f"{joint}.stop" for joint in joints)]
    names, dropped, made = UniqueNames("drives", *taken), [], set()
    for a in range(len(model.actuator_trntype)):
        own = model.actuator(a).name or f"actuator{a}"
        name = names(own)
        on_site, at = _site(model, a), _transmission(model, a, joints, tendons)
        why = _why_off(model, a) or (at.reason if on_site is None else "")
        why = why or _unsupported_reason(model, a, on_site is not None)
        if why:
            dropped.append(f"the actuator {name!r}: {why}")
            continue
        law = _servo(model, a, controls.get(own, 0.0))
        if on_site is None:
            at.add(builder, name, law)
        else:
            builder.force(name, SiteActuator(law, gear_of(model, a)), on=site_frames[on_site])
        made.add(own)
    for name in controls:
        place_of("actuator", name, made)
    dropped += [f"the name of the actuator {old!r}, called {new!r} here" for new, old in names.renamed.items()]
    return dropped + _limits_of_several(model, joints)


def _why_off(model, a) -> str:
    """That the file switches an actuator off, by all of them or by its group; "" where it does not."""
    import mujoco

    group = int(model.actuator_group[a])
    by_group = 0 <= group < 31 and model.opt.disableactuator >> group & 1
    off = by_group or model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION
    return "the file switches it off" if off else ""


def _transmission(model, a, joints, tendons) -> Transmission:
    import mujoco

    kinds, kind, target = mujoco.mjtTrn, model.actuator_trntype[a], model.actuator_trnid[a][0]
    if kind == int(kinds.mjTRN_TENDON):
        at = tendons[target]
        return at._replace(reason="its tendon is left out") if at.reason else at
    if kind not in (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT)):
        what = kinds(int(kind)).name.removeprefix("mjTRN_").lower()
        return Transmission(reason=f"it acts on no joint, tendon or site alone ({what})")
    if model.jnt_type[target] not in SCALAR:
        return Transmission(reason="its joint has several coordinates")
    return Transmission(joint=joints[target])


def _site(model, a) -> int | None:
    """The site that an actuator acts at, None of others and of those that act between two sites."""
    import mujoco

    alone = model.actuator_trntype[a] == int(mujoco.mjtTrn.mjTRN_SITE) and model.actuator_trnid[a][1] < 0
    return int(model.actuator_trnid[a][0]) if alone else None


def _servo(model, a, control) -> ServoActuator:
    import mujoco

    gain = np.array(model.actuator_gainprm[a][:3])
    if model.actuator_gaintype[a] == int(mujoco.mjtGain.mjGAIN_FIXED):
        gain[1:] = 0.0
    dynamics = {
        int(mujoco.mjtDyn.mjDYN_NONE): ("none", None),
        int(mujoco.mjtDyn.mjDYN_INTEGRATOR): ("integrator", None),
    }
    lag = ("filter", max(1e-15, float(model.actuator_dynprm[a][0])))
    activation, time_constant = dynamics.get(int(model.actuator_dyntype[a]), lag)
    free = (-np.inf, np.inf)
    clamped = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    return ServoActuator(
        control,
        gain,
        np.array(model.actuator_biasprm[a][:3]) if model.actuator_biastype[a] else np.zeros(3),
        gear_of(model, a)[0] if _site(model, a) is None else 1.0,
        model.actuator_ctrlrange[a] if model.actuator_ctrllimited[a] and clamped else free,
        _force_range(model, a),
        model.actuator_actrange[a] if model.actuator_actlimited[a] and activation != "none" else free,
        activation,
        time_constant,
    )


def _force_range(model, a):
    """Range (2,) of the force, with that of its joint or tendon where no other actuator acts on it."""
    ranges = [model.actuator_forcerange[a]] if model.actuator_forcelimited[a] else []
    if not _shares(model, a) and (limit := _total_limit(model, a)) is not None:
        ranges.insert(0, limit)
    low, high = -np.inf, np.inf
    for lower, upper in ranges:  # clipped to one after the other
        low, high = np.clip((low, high), lower, upper)
    return low, high


def _total_limit(model, a):
    """Range of all actuator forces on the joint or tendon of an actuator, in its own force; None without one."""
    import mujoco

    target, kind = model.actuator_trnid[a][0], model.actuator_trntype[a]
    if kind == int(mujoco.mjtTrn.mjTRN_TENDON):
        limited = getattr(model, "tendon_actfrclimited", np.zeros(target + 1))[target]
        return model.tendon_actfrcrange[target] if limited else None
    if kind not in (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)):
        return None
    gear = gear_of(model, a)[0]
    return np.sort(model.jnt_actfrcrange[target] / gear) if model.jnt_actfrclimited[target] and gear else None


def _shares(model, a) -> bool:
    """True if another actuator may act on the same joint or tendon."""
    import mujoco

    others = [b for b in range(len(model.actuator_trntype)) if b != a]
    same = [b for b in others if model.actuator_trnid[b][0] == model.actuator_trnid[a][0]]
    if model.actuator_trntype[a] == int(mujoco.mjtTrn.mjTRN_TENDON):
        return any(model.actuator_trntype[b] == model.actuator_trntype[a] for b in same)
    joints = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    beside = any(model.actuator_trntype[b] not in joints for b in others)
    return beside or any(model.actuator_trntype[b] in joints for b in same)


def _limits_of_several(model, joints) -> list[str]:
    """Sentences on limits of the sum of several actuators."""
    found: dict[str, None] = {}
    for a in range(len(model.actuator_trntype)):
        if _shares(model, a) and _total_limit(model, a) is not None:
            target = model.actuator_trnid[a][0]
            found[joints[target] if model.actuator_trntype[a] < 2 else model.tendon(target).name] = None
    return [f"the limit of the sum of actuators on {name!r}" for name in found]


def _unsupported_reason(model, a, on_site: bool) -> str:
    """Reason why an actuator is not affine in its activation, length and rate; empty if it is."""
    import mujoco

    dynamics, gains, biases = mujoco.mjtDyn, mujoco.mjtGain, mujoco.mjtBias
    known = [dynamics.mjDYN_NONE, dynamics.mjDYN_INTEGRATOR, dynamics.mjDYN_FILTER, dynamics.mjDYN_FILTEREXACT]
    if model.actuator_dyntype[a] not in map(int, known):
        return f"its dynamics are of the kind {_kind(dynamics, model.actuator_dyntype[a])}"
    if on_site and model.actuator_dyntype[a] != int(dynamics.mjDYN_NONE):
        return "it acts on a site and has a state of its own"
    if model.actuator_gaintype[a] not in (int(gains.mjGAIN_FIXED), int(gains.mjGAIN_AFFINE)):
        return f"its gain is of the kind {_kind(gains, model.actuator_gaintype[a])}"
    if model.actuator_biastype[a] not in (int(biases.mjBIAS_NONE), int(biases.mjBIAS_AFFINE)):
        return f"its bias is of the kind {_kind(biases, model.actuator_biastype[a])}"
    if hasattr(model, "actuator_delay") and model.actuator_delay[a]:
        return "its control is delayed"
    return ""


def _kind(kinds, value) -> str:
    return kinds(int(value)).name.split("_")[1].lower()
