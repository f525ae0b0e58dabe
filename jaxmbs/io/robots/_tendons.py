"""Tendons as MuJoCo compiles them: fixed ones are coordinates tied to joints by couplers, spatial ones paths."""

import numpy as np

from ...forces import Attachment, BumpStop, Eyelet, WrapCylinder, WrapSphere
from ...joints._limits import JointLimits
from ...model._pose import Pose
from ._friction import friction_law
from ._imported import quote_names
from ._mujoco_model import rotation_of_quaternion
from ._springs import add_rotor, armature, damper_numbers, friction_loss, spring_law, spring_numbers
from ._transmissions import Transmission


def add_tendons(builder, model, home, joints, names, stops, friction: str) -> tuple[list, dict, list[str]]:
    """(transmission of each tendon, limits of those that are coordinates, what was left out).

    Args: home: of every body; joints: their names; names: of joints and constraints.
    """
    found, limits, dropped = [], {}, []
    for k in range(model.ntendon):
        name = names(model.tendon(k).name or f"tendon{k}")
        at = _transmission(builder, model, k, name, home, joints)
        found.append(at)
        if at.reason:
            dropped.append(f"the tendon {name!r}: {at.reason}")
            continue
        lower, upper = map(float, model.tendon_lengthspring[k])
        spring, damper = spring_numbers(model, k, "tendon"), damper_numbers(model, k, "tendon")
        if np.any(spring) or np.any(damper):
            what = "spring" if np.any(spring) else "damper"
            at.add(builder, f"{name}.{what}", spring_law(spring, damper, lower, upper))
        loss = friction_loss(model, k, "tendon")
        if loss and friction == "smooth":
            at.add(builder, f"{name}.friction", friction_law(loss))
        elif loss:
            dropped.append(f"friction losses of the tendon {name!r}")
        if at.path and armature(model, k, "tendon"):
            dropped.append(f"the armature of the tendon {name!r}")
        if model.tendon_limited[k]:
            held = JointLimits(*map(float, model.tendon_range[k]))
            if at.path and stops is not None:
                at.add(builder, f"{name}.stop", BumpStop(stops, held.lower, held.upper))
            elif at.path:
                dropped.append(f"limits of the tendon {name!r}: stops= gives their stiffness")
            else:
                limits[at.joint] = held
    return found, limits, dropped


def _transmission(builder, model, k, name, home, joints) -> Transmission:
    import mujoco

    kinds = mujoco.mjtWrap
    wraps = range(model.tendon_adr[k], model.tendon_adr[k] + model.tendon_num[k])
    types = [kinds(int(model.wrap_type[w])) for w in wraps]
    if types[0] == kinds.mjWRAP_JOINT:
        turns: dict[str, float] = {}
        for w in wraps:
            joint = joints[model.wrap_objid[w]]
            turns[joint] = turns.get(joint, 0.0) + float(model.wrap_prm[w])
        add_rotor(builder, name, armature(model, k, "tendon"), turns, f"{name}.coupler", f"{name}.disc")
        return Transmission(joint=name)
    if kinds.mjWRAP_PULLEY in types:
        return Transmission(reason="it has pulleys")
    places = _Places(model)
    path = [_element(model, places, w, kind, wraps, home) for w, kind in zip(wraps, types, strict=True)]
    if any(element is None for element in path):
        return Transmission(reason="it goes round the inside of a body, by its side site")
    ends = [Attachment(path[0].at), *path[1:-1], Attachment(path[-1].at)]
    return Transmission(path=tuple(ends))


class _Places:
    """Places of sites and geoms in the world, in the initial pose."""

    def __init__(self, model):
        import mujoco

        self.data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, self.data)

    def site_from(self, geom, site):
        """A site in the axes of a geom, from its centre."""
        R = self.data.geom_xmat[geom].reshape(3, 3)
        return R.T @ (self.data.site_xpos[site] - self.data.geom_xpos[geom])


def _element(model, places, w, kind, wraps, home):
    """An element of a path; None of a geom whose inside the tendon touches."""
    import mujoco

    if kind == mujoco.mjtWrap.mjWRAP_SITE:
        site = model.wrap_objid[w]
        return Eyelet(_frame(home[model.site_bodyid[site]], model.site_pos[site], np.eye(3)))
    geom, side = model.wrap_objid[w], int(model.wrap_prm[w])
    first, last = (places.site_from(geom, model.wrap_objid[w + step]) for step in (-1, 1))
    through = None if side < 0 else places.site_from(geom, side)
    flat = np.array([1.0, 1.0, float(kind == mujoco.mjtWrap.mjWRAP_SPHERE)])
    radius = float(model.geom_size[geom][0])
    if through is not None and np.linalg.norm(through) < radius:
        return None
    axis = _turning_axis(first * flat, last * flat, None if through is None else through * flat)
    at = _frame(home[model.geom_bodyid[geom]], model.geom_pos[geom], rotation_of_quaternion(model.geom_quat[geom]))
    return (WrapSphere if flat[2] else WrapCylinder)(at, radius, axis=axis)


def _turning_axis(first, last, through) -> np.ndarray:
    """Unit vector about which a path from `first` to `last` turns round the origin, on the side of `through`, else
    the short way."""
    way = last - first
    normal = np.cross(first, last)
    if np.linalg.norm(normal) < 1e-12 * np.linalg.norm(first) * np.linalg.norm(last):
        normal = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    if through is not None and np.dot(np.cross(through, way), normal) < 0:
        normal = -normal
    return normal / np.linalg.norm(normal)


def _frame(home, position, rotation):
    R, p = home.pose
    return home.body, Pose(R @ position + p, R @ rotation)


def describe_sides(model, found) -> list[str]:
    """A note on paths round bodies, whose sides are those of the initial pose."""
    round_bodies = [
        model.tendon(k).name or f"tendon{k}"
        for k, at in enumerate(found)
        if any(hasattr(element, "radius") for element in at.path)
    ]
    return (
        [f"the tendons {quote_names(round_bodies)} go round their bodies on the side of the initial pose"]
        if round_bodies
        else []
    )
