"""Equality constraints as MuJoCo compiles them: points and bodies tied are joints that close loops, joints couple."""

from typing import NamedTuple

import numpy as np

from ...builder._arrays import compose_poses
from ...joints import Coupler, Spherical, Weld
from ._link_tree import pose_of_pair
from ._mujoco_model import rotation_of_quaternion


def add_equalities(builder, model, home, joints, tendons, names) -> list[str]:
    """Declare them; what was left out.

    Args: home: of every body; tendons: their transmissions; names: of joints and constraints.
    """
    import mujoco

    kinds, dropped = mujoco.mjtEq, []
    off = model.opt.disableflags & (mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    for e in range(model.neq):
        kind = kinds(int(model.eq_type[e]))
        what = kind.name.removeprefix("mjEQ_").lower()
        name = names(model.equality(e).name or f"{what}{e}")
        if off or not model.eq_active0[e]:
            dropped.append(f"the equality {name!r} ({what}), which the file switches off")
        elif kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            (first, near), (second, far) = _ends(model, e, home, kind == kinds.mjEQ_WELD)
            if first == second:
                dropped.append(f"the equality {name!r} ({what}): both its ends lie on {first!r}")
                continue
            law = Weld() if kind == kinds.mjEQ_WELD else Spherical()
            builder.joint(name, law, first, second, pose_of_pair(near), pose_of_pair(far))
        elif kind == kinds.mjEQ_JOINT:
            rests = model.qpos0[model.jnt_qposadr]
            builder.constraint(name, _coupler(model, e, joints, rests))
        elif kind == kinds.mjEQ_TENDON and not (why := _tie_tendons(builder, model, e, name, tendons)):
            continue
        elif kind == kinds.mjEQ_TENDON:
            dropped.append(f"the equality {name!r} ({what}): {why}")
        else:
            dropped.append(f"the equality {name!r} ({what})")
    return dropped


def _ends(model, e, home, is_weld):
    """(body, pose in it) of both frames that coincide.

    `eq_data` of two points: on the first body, on the second; of a weld: the point on the second body, then the pose
    of the second in the first that puts this point where it belongs.
    """
    import mujoco

    one, two, data = model.eq_obj1id[e], model.eq_obj2id[e], model.eq_data[e]
    if model.eq_objtype[e] == int(mujoco.mjtObj.mjOBJ_SITE):
        places = [
            (model.site_bodyid[k], (rotation_of_quaternion(model.site_quat[k]), model.site_pos[k]))
            for k in (one, two)
        ]
    elif is_weld:
        places = [(one, (rotation_of_quaternion(data[6:10]), data[3:6])), (two, (np.eye(3), data[:3]))]
    else:
        places = [(one, (np.eye(3), data[:3])), (two, (np.eye(3), data[3:6]))]
    return [(home[body].body, compose_poses(home[body].pose, place)) for body, place in places]


class PolynomialCoupling(NamedTuple):
    """`(q - first) - sum_i coefficients[i] (r - second)^i` of two joints' coordinates q, r."""

    first: float
    second: float
    coefficients: tuple[float, ...]

    def __call__(self, q, r):
        total = 0.0 * r
        for c in reversed(self.coefficients):
            total = total * (r - self.second) + c
        return q - self.first - total


def _tie_tendons(builder, model, e, name, tendons) -> str:
    """Declare an equality of one or two tendons; why not, where it is none of joints and none of one path."""
    one, two = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
    ends = [tendons[k] for k in (one, two) if k >= 0]
    if any(at.reason for at in ends):
        return "a tendon of it is left out"
    if all(at.joint for at in ends):
        places = [at.joint for at in tendons]
        builder.constraint(name, _coupler(model, e, places, model.tendon_length0))
        return ""
    if len(ends) > 1:
        return "it ties paths to one another"
    length = float(model.tendon_length0[one] + model.eq_data[e][0])
    builder.cable(name, ends[0].path, free_length=length, inextensible=True)
    return ""


def _coupler(model, e, places, rests):
    """`q - q0 = sum_i a_i (r - r0)^i`; without a second coordinate r is at r0.

    Args: names of the coordinates, and their values in the initial pose.
    """
    one, two = model.eq_obj1id[e], model.eq_obj2id[e]
    a = np.array(model.eq_data[e][:5])
    q0 = float(rests[one])
    if two < 0:
        return Coupler({places[one]: 1.0}, q0 + a[0])
    r0 = float(rests[two])
    both = {places[one]: 1.0, places[two]: -a[1]}
    if not np.any(a[2:]):
        return Coupler(both, q0 + a[0] - a[1] * r0)
    return Coupler(both, function=PolynomialCoupling(q0, r0, tuple(map(float, a))))
