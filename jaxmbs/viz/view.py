"""From where a scene is looked at: up, the side that the machine shows, the ground, and how large all of it is."""

from typing import NamedTuple

import numpy as np


class View(NamedTuple):
    """Unit vectors up and front (towards the camera, level), angles of the camera [rad], the centre (3,) and the half
    size of what is seen [m], the height of the ground along up, and how wide it is across the view."""

    up: np.ndarray
    front: np.ndarray
    azimuth: float
    elevation: float
    centre: np.ndarray
    half: float
    ground: float
    width: float


def view_of(points, gravity=None, margin=0.0) -> View:
    """The view of points (n, 3) that move about; up is against gravity, else the z axis, or y for what lies in x-y.

    What lies in a plane is seen from its side, all else over the corner.
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    flat, normal = len(points) > 2 and spread[-1] < 0.03 * max(spread[0], 1e-300), axes[-1]
    flat = flat and spread[1] > 0.03 * spread[0]
    pull = 0.0 if gravity is None else float(np.linalg.norm(gravity))
    if gravity is not None and pull > 0:
        up = -np.asarray(gravity) / pull
    else:
        up = np.array([0.0, 1.0, 0.0]) if flat and abs(normal[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    upright = flat and abs(normal @ up) < 0.3
    level = normal - (normal @ up) * up if upright else _corner(up)
    front = level / np.linalg.norm(level)
    right = np.cross(up, front)
    if upright and right[np.argmax(np.abs(right))] < 0:
        front, right = -front, -right
    azimuth, elevation = (0.42, 0.24) if upright else (0.55, 0.38)
    half = 0.5 * float(np.linalg.norm(np.ptp(points, axis=0))) + margin
    width = float(np.ptp(points @ right)) + 2 * margin
    ground = float(np.min(points @ up)) - 1.3 * margin
    return View(up, front, azimuth, elevation, middle, half or 1.0, ground, width)


def _corner(up):
    """Level, against y (or x where y is up): the x axis then points to the right."""
    y = np.array([0.0, -1.0, 0.0])
    level = y - (y @ up) * up
    return level if np.linalg.norm(level) > 0.3 else np.array([0.0, 0.0, 1.0])
