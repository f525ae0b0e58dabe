"""View of a scene: up and front directions, camera angles, ground plane and size."""

from typing import NamedTuple

import numpy as np

_ASPECT = 1.45  # width over height that is visible in any window; the player's `look` has the same number


class View(NamedTuple):
    """View of a scene.

    Unit vectors up and front (towards the camera, level), angles of the camera [rad], the centre (3,) and half the
    size of the visible box [m], the height of the ground along up, and the width across the view.
    """

    up: np.ndarray
    front: np.ndarray
    azimuth: float
    elevation: float
    centre: np.ndarray
    half: float
    ground: float
    width: float


def fit_view(points, gravity=None, margin=0.0) -> View:
    """Fit a view to the points (n, 3) of a motion; up is against gravity, else the z axis, or y for points in x-y.

    Points in a vertical plane are seen from its normal, turned a little; others isometrically.
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    # a plane: thickness below 3 % of the length, while the width is not (that would be a line)
    flat, normal = len(points) > 2 and spread[-1] < 0.03 * max(spread[0], 1e-300), axes[-1]
    flat = flat and spread[1] > 0.03 * spread[0]
    pull = 0.0 if gravity is None else float(np.linalg.norm(gravity))
    if gravity is not None and pull > 0:
        up = -np.asarray(gravity) / pull
    else:
        up = np.array([0.0, 1.0, 0.0]) if flat and abs(normal[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    upright = flat and abs(normal @ up) < 0.3
    level = normal - (normal @ up) * up if upright else _corner_direction(up)
    front = level / np.linalg.norm(level)
    right = np.cross(up, front)
    if upright and right[np.argmax(np.abs(right))] < 0:
        front, right = -front, -right
    # angles [rad] by eye: a planar mechanism is nearly faced, so that its plane is not foreshortened
    azimuth, elevation = (0.42, 0.24) if upright else (0.55, 0.38)
    half = 0.5 * float(np.linalg.norm(np.ptp(points, axis=0))) + margin
    width = float(np.ptp(points @ right)) + 2 * margin
    ground = float(np.min(points @ up)) - 1.3 * margin
    return View(up, front, azimuth, elevation, middle, half or 1.0, ground, width)


def camera_distance(
    view: View, points: np.ndarray, angle: float, pad: float, azimuth: float, elevation: float
) -> float:
    """Distance of the camera from the centre at which it sees all points (n, 3), each with `pad` [m] around it.

    Its field of view is `angle` [rad] in height, and 1.45 times that across, as in the player.
    """
    right = np.cross(view.up, view.front)
    level = np.cos(azimuth) * view.front + np.sin(azimuth) * right
    back = np.cos(elevation) * level + np.sin(elevation) * view.up
    x = np.cross(view.up, back)
    x = x / np.linalg.norm(x)
    p = points[np.all(np.isfinite(points), axis=1)] - view.centre
    high, wide = np.abs(p @ np.cross(back, x)) + pad, (np.abs(p @ x) + pad) / _ASPECT
    return float(np.max(p @ back + np.maximum(high, wide) / np.tan(angle / 2), initial=pad))


def _corner_direction(up):
    """Level direction against y (or x if y is up): the x axis then points to the right."""
    y = np.array([0.0, -1.0, 0.0])
    level = y - (y @ up) * up
    return level if np.linalg.norm(level) > 0.3 else np.array([0.0, 0.0, 1.0])
