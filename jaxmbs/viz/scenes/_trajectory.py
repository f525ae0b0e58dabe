"""Poses of all frames of a mechanism along a motion, by one compiled program."""

from typing import Any, NamedTuple

import jax
import numpy as np

from ...kinematics._poses import frame_poses, node_parameters, node_poses
from ...model._changes import with_changes
from ...model._entry_points import states_of
from ...model._system import System
from ...runtime import jit


class FrameTrajectory(NamedTuple):
    """Poses of all frames at times.

    Times ts (T,), rotations R (T, frames, 3, 3) and positions x (T, frames, 3) of all frames, those of joints and
    bodies included; `axes` (3,) by joint name, in axes of the joint's first frame: its axis of rotation or sliding.
    """

    ts: np.ndarray
    R: np.ndarray
    x: np.ndarray
    axes: dict[str, np.ndarray]

    def position_in_body(self, topology, frame: int) -> np.ndarray:
        """Position (3,) of a frame in the axes of its body."""
        body = topology.frame_body[frame] + 1
        return self.R[0, body].T @ (self.x[0, frame] - self.x[0, body])

    def position_in_frame(self, first: int, second: int) -> np.ndarray:
        """Positions (T, 3) of a frame in the axes of another one."""
        return np.einsum("tji,tj->ti", self.R[:, first], self.x[:, second] - self.x[:, first])

    @property
    def extent(self) -> float:
        """The largest edge of the box of all frames at all times [m]; one if it is empty."""
        points = self.x.reshape(-1, 3)
        points = points[np.all(np.isfinite(points), axis=1)]
        return float(np.max(np.ptp(points, axis=0))) or 1.0 if len(points) else 1.0


def frame_trajectory(system: System, motion: Any) -> FrameTrajectory:
    """Frame poses of a motion, a State, or several with one leading axis; without times that were not reached."""
    states = states_of(system, motion)
    if states.coordinates.ndim == 1:
        states = jax.tree.map(lambda x: x[None], states)
    R, x, W = (np.asarray(part) for part in _frame_poses(system, states))
    ts = np.asarray(getattr(motion, "ts", states.t), float)
    there = np.all(np.isfinite(x), axis=(1, 2)) & np.isfinite(ts)
    if np.any(there):
        R, x, W, ts = (part[there] for part in (R, x, W, ts))
    return FrameTrajectory(ts, R, x, _joint_axes(system, R[0], W[0]))


@jit(compile="tape")
def _frame_poses(system, states):
    def one(state):
        here = with_changes(system, state)
        W = node_poses(here.topology, node_parameters(here), state.coordinates)
        return *frame_poses(here.topology, here.frames, W), W

    return jax.vmap(one)(states)


def _joint_axes(system, R, W):
    """Axis by joint: of its last rotating node, else of its first; for a cut joint that of its closure."""
    top, found = system.topology, {}
    for joint in top.joints:
        nodes = range(joint.first_velocity, joint.first_velocity + joint.num_velocities)
        turning = [k for k in nodes if top.node_kind[k] != "prismatic"]
        if len(nodes) and joint.symbol != "none":
            axis = W[(turning or list(nodes))[-1], :9].reshape(3, 3)[:, 2]
            found[joint.name] = R[joint.frames[0]].T @ axis
    for group in system.closures:
        found |= {name: np.asarray(basis)[:, 2] for name, basis in zip(group.names, group.basis, strict=True)}
    return found
