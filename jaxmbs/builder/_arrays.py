"""Declared poses to the arrays of a system: placements of nodes, bodies and frames.

Works on numpy arrays and traced arrays alike; poses are (rotation, position) pairs.
"""

import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..kinematics._poses import CYCLE
from ..model._pose import Pose
from ..runtime import as_array
from ._declarations import GROUND, joint_frame

_REVERSE = np.diag([1.0, -1.0, -1.0])
_Z_TO_AXIS = {"x": CYCLE, "y": CYCLE @ CYCLE, "z": np.eye(3)}
_IDENTITY = (np.eye(3), np.zeros(3))


def to_numpy(x):
    """A numpy array where the values are known, else the traced array."""
    return np.asarray(x) if is_concrete(x) else x


def stack(values, dtype=None):
    """Numbers of one shape on a new first axis, of a type or of their own; by NumPy where all are known, which
    compiles nothing."""
    if not is_concrete(values):
        return jnp.stack([jnp.asarray(x, dtype) for x in values])
    return as_array(np.stack([np.asarray(x, dtype) for x in values]), None)


def rotation_and_position(pose: Pose):
    """(rotation, position) of a pose."""
    return to_numpy(pose.rotation), to_numpy(pose.position)


def compose_poses(a, b):
    """Pose a, then b given in a."""
    return a[0] @ b[0], a[0] @ b[1] + a[1]


def invert(a):
    """Inverse of a pose."""
    return a[0].T, -(a[0].T @ a[1])


def stack_poses(poses) -> Pose:
    """Pose of arrays from a list of pairs; numpy until the last step."""
    join = np.stack if is_concrete(*poses) else jnp.stack
    if not poses:
        return Pose(jnp.zeros((0, 3)), jnp.zeros((0, 3, 3)))
    return Pose(join([p[1] for p in poses]), join([p[0] for p in poses]))


def reference_poses(bodies, joints, frames):
    """World pose of every body in the reference pose: as declared; else the world frame for bodies that a joint
    `at` a world point holds; else along the joints."""
    world = {GROUND: _IDENTITY}
    held = {body for j in joints.values() if j.at is not None for body in (j.parent, j.child)}
    world.update({name: _IDENTITY for name in bodies if name in held})
    world.update({name: rotation_and_position(b.pose) for name, b in bodies.items() if b.pose is not None})
    changed = True
    while changed:
        changed = False
        for joint in joints.values():
            for here, there in ((joint.parent, joint.child), (joint.child, joint.parent)):
                if here in world and there not in world:
                    world[there] = _neighbour_pose(joint, here, there, world, frames)
                    changed = True
    return world


def _neighbour_pose(joint, here, there, world, frames):
    ends = {joint.parent: joint.parent_frame, joint.child: joint.child_frame}
    near, far = (rotation_and_position(joint_frame(ends[b], frames)) for b in (here, there))
    return compose_poses(compose_poses(world[here], near), invert(far))


def joint_poses(bodies, joints, frames):
    """(parent frame, child frame) of every joint in body axes, `at` points resolved."""
    world = reference_poses(bodies, joints, frames) if any(j.at is not None for j in joints.values()) else {}
    poses = {}
    for name, joint in joints.items():
        if joint.at is not None:
            point = (np.eye(3), _world_point(joint.at, world, frames))
            poses[name] = tuple(compose_poses(invert(world[b]), point) for b in (joint.parent, joint.child))
        else:
            ends = (joint.parent_frame, joint.child_frame)
            poses[name] = tuple(rotation_and_position(joint_frame(frame, frames)) for frame in ends)
    return poses


def _world_point(at, world, frames):
    """A point (3,) of the reference pose, given or that of a frame."""
    if not isinstance(at, str):
        return to_numpy(as_array(at))
    frame = frames[at]
    return compose_poses(world.get(frame.body, _IDENTITY), rotation_and_position(frame.pose))[1]


def tree_arrays(order, parent, via, backwards, joints, poses):
    """(body poses in nodes, node placements, leads) in tree order, by walking the runs of nodes."""
    in_node, placements, leads = {GROUND: _IDENTITY}, [], []
    for body in order:
        name = via[body]
        kind, (near, far) = joints[name].kind, poses[name]
        if name in backwards:
            near, far = far, near
        nodes = kind.nodes
        if not nodes:
            in_node[body] = compose_poses(compose_poses(in_node[parent[body]], near), invert(far))
            continue
        basis = to_numpy(kind.basis()) @ (_REVERSE if name in backwards else np.eye(3))
        onto = [_Z_TO_AXIS[node.axis] for node in nodes]
        start = compose_poses(in_node[parent[body]], (near[0] @ basis @ onto[0], near[1]))
        run = [start] + [(a.T @ b, np.zeros(3)) for a, b in zip(onto, onto[1:], strict=False)]
        for node, place in zip(nodes, run, strict=True):
            ball = node.kind == "ball"
            placements += [place] + ([(CYCLE, np.zeros(3))] * 2 if ball else [])
            lead = to_numpy(kind.lead()) if node.kind == "screw" else float(node.kind == "prismatic")
            leads += [lead] + ([0.0] * 2 if ball else [])
        last = onto[-1].T @ basis.T
        in_node[body] = compose_poses((last, np.zeros(3)), invert(far))
    return in_node, placements, leads
