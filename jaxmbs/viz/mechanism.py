"""A stick picture of a mechanism: the frames on each body joined, at one pose or several."""

from collections.abc import Iterable
from typing import Any

import jax
import numpy as np
from scipy.spatial import ConvexHull

from ..kinematics.poses import frame_poses, node_parameters, node_poses
from ..kinematics.state import State
from ..math.jit import jit
from ..model.question import check_fits
from ..model.system import System
from ..palette import COLORS
from .canvas import axes


def plot_mechanism(
    system: System, states: State, plane: str = "xy", frames: Iterable[str] | None = None, ax: Any = None
) -> Any:
    """Bodies as lines through their joints and named frames, pins as circles; the first pose is drawn strongest.

    Args:
        states: a State, or several with one leading axis.
        plane: the two world axes to look at, "xy", "xz", "yz", in the order right, up.
        frames: names of frames to show beside the joints (default: all that the user named).
        ax: matplotlib axes to draw into (default: new ones).

    Raises: ValueError for an unknown plane.
    """
    if len(plane) != 2 or not set(plane) < set("xyz") or plane[0] == plane[1]:
        raise ValueError(f"plane must name two different axes, such as 'xy', not {plane!r}")
    ax, view = axes(ax), ["xyz".index(letter) for letter in plane]
    points = frame_positions(system, states)[..., view]  # (poses, frames, 2)
    shown = body_frames(system.topology, frames)
    strengths = np.linspace(1.0, 0.25, len(points)) if len(points) > 1 else [1.0]
    for pose, strength in reversed(list(zip(points, strengths, strict=True))):
        _draw(ax, system.topology, shown, pose, strength)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel(f"{plane[0]} [m]")
    ax.set_ylabel(f"{plane[1]} [m]")
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def frame_positions(system, states) -> np.ndarray:
    """World positions (poses, frames, 3) [m] of all frames, those of joints included, at a state or several."""
    check_fits(system, states)
    if states.coordinates.ndim == 1:
        states = jax.tree.map(lambda x: x[None], states)
    return np.asarray(_positions(system, states.coordinates))


@jit(compile="quick")
def _positions(system, coordinates):
    P = node_parameters(system)
    return jax.vmap(lambda psi: frame_poses(system, node_poses(system.topology, P, psi))[1])(coordinates)


def body_frames(topology, names=None) -> dict[int, list[int]]:
    """Frames that show on each body (-1 ground): its ends of joints, then the named ones (default: all)."""
    shown: dict[int, list[int]] = {body: [] for body in (-1, *range(topology.bodies.size))}
    for joint in topology.joints:
        if joint.kind == "Modal":  # moves no frame
            continue
        for body, frame in zip((joint.parent, joint.child), joint.frames, strict=True):
            shown[body].append(frame)
    ends = {frame for joint in topology.joints for frame in joint.frames}
    for frame, (name, body) in enumerate(zip(topology.frame_names, topology.frame_body, strict=True)):
        named = name and frame > topology.bodies.size and frame not in ends
        if named and (names is None or name in names):
            shown[body].append(frame)
    return shown


def _draw(ax, topology, shown, points, strength):
    """One pose: ground joints as triangles, a body of one point as a square, others as lines with pins."""
    pins = {frame for joint in topology.joints for frame in joint.frames}
    for body, frames in shown.items():
        if not frames:
            continue
        place = points[frames]
        if body < 0:
            ax.plot(*place.T, "^", color="0.35", markersize=9, zorder=1, alpha=strength)
            continue
        color = COLORS[body % len(COLORS)]
        if np.ptp(place, axis=0).max() < 1e-9:
            ax.plot(*place[0], "s", color=color, markersize=14, alpha=strength, zorder=2)
            continue
        ax.plot(*_outline(place).T, color=color, linewidth=3.0, alpha=strength, solid_capstyle="round", zorder=3)
        joints = points[[frame for frame in frames if frame in pins]]
        ax.plot(*joints.T, "o", color="white", markeredgecolor="0.2", markersize=5.5, alpha=strength, zorder=4)


def _outline(place):
    """Points (n, 2) of a body as a line: a stick along its largest spread, or the hull of those that spread wide."""
    if not np.all(np.isfinite(place)):  # a state that was never reached: nothing shows
        return place
    centred = place - place.mean(axis=0)
    _, size, axis = np.linalg.svd(centred)
    if len(place) < 3 or size[1] < 0.05 * size[0]:
        return place[np.argsort(centred @ axis[0], kind="stable")]
    hull = ConvexHull(place).vertices
    return place[np.append(hull, hull[0])]
