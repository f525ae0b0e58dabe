"""Joints as MuJoCo compiles them: how they move a body, and their coordinates."""

import numpy as np

from ...joints import Free, Prismatic, Revolute, Spherical
from ._link_tree import LinkJoint

FREE, BALL, SLIDE, HINGE = range(4)  # of mjtJoint
SCALAR = (SLIDE, HINGE)


def rotation_of_quaternion(quaternion) -> np.ndarray:
    """Rotation matrix of a quaternion (w, x, y, z) of unit length."""
    w, x, y, z = quaternion
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def link_joints(model, numbers, names):
    """The joints of one body; each acts in the body's axes, about its own point.

    MuJoCo's coordinate of a hinge or slide is `ref` in the pose that the file draws, so the frame before the joint is
    moved back by so much.
    """
    for j in numbers:
        kind, axis, point = model.jnt_type[j], np.array(model.jnt_axis[j]), np.array(model.jnt_pos[j])
        there = (np.eye(3), point)
        ref = float(model.qpos0[model.jnt_qposadr[j]])
        if kind == FREE:
            yield LinkJoint(names[j], Free())
        elif kind == BALL:
            yield LinkJoint(names[j], Spherical(), there, there)
        elif kind == SLIDE:
            yield LinkJoint(names[j], Prismatic(axis), (np.eye(3), -ref * axis))
        else:
            yield LinkJoint(names[j], Revolute(axis), (rotation_about(axis, -ref), point), there)


def rotation_about(axis, angle) -> np.ndarray:
    """Rotation by an angle about a unit axis."""
    half = angle / 2
    return np.eye(3) if angle == 0 else rotation_of_quaternion((np.cos(half), *(np.sin(half) * axis)))


def joint_slice(model, j, of="qpos") -> slice:
    """The coordinates ("qpos") or velocities ("qvel") of a joint."""
    sizes, first = ((7, 4, 1, 1), model.jnt_qposadr) if of == "qpos" else ((6, 3, 1, 1), model.jnt_dofadr)
    return slice(first[j], first[j] + sizes[model.jnt_type[j]])


def initial_coordinates(model, names, qpos) -> dict:
    """Coordinates by joint but those of joints whose two frames agree."""
    found = {}
    for j, name in enumerate(names):
        value = np.array(qpos[joint_slice(model, j)])
        neutral = {FREE: (0, 0, 0, 1, 0, 0, 0), BALL: (1, 0, 0, 0)}.get(model.jnt_type[j], (0,))
        if np.any(value != np.array(neutral)):
            found[name] = float(value[0]) if len(value) == 1 else value
    return found
