"""Projections of flat pictures: along an axis, or isometric."""

from typing import NamedTuple

import numpy as np


class ViewProjection(NamedTuple):
    """Rows (2, 3) to the right and up of the picture, (3,) towards the eye, and the labels of its axes, if any."""

    rows: np.ndarray
    depth: np.ndarray
    labels: tuple[str, str] | None

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) in the picture, (..., 2)."""
        return np.asarray(points) @ self.rows.T


def read_projection(plane: str, azimuth: float = 0.6, elevation: float = 0.4) -> ViewProjection:
    """Read a projection by the world axes that point to the right and up, "xy", "xz", ..., or "iso", with z up.

    Args: azimuth, elevation: of the eye for "iso", measured from the negative y axis towards x, and upwards [rad].

    Raises: ValueError for another plane.
    """
    if plane == "iso":
        c, s = np.cos(azimuth), np.sin(azimuth)
        right, level = np.array([c, s, 0.0]), np.array([s, -c, 0.0])
        eye = np.cos(elevation) * level + np.sin(elevation) * np.array([0.0, 0.0, 1.0])
        return ViewProjection(np.stack([right, np.cross(eye, right)]), eye, None)
    if len(plane) != 2 or not set(plane) < set("xyz") or plane[0] == plane[1]:
        raise ValueError(f"plane must name two different axes, such as 'xy', or be 'iso', not {plane!r}")
    rows = np.eye(3)[["xyz".index(letter) for letter in plane]]
    return ViewProjection(rows, np.cross(*rows), (f"{plane[0]} [m]", f"{plane[1]} [m]"))


def load_axes(loads) -> tuple[str, str]:
    """Frame and side of loads, as given to `reactions`; a plain mapping counts as in the world, on the children."""
    return getattr(loads, "frame", "world"), getattr(loads, "side", "child")


def axes_suffix(loads) -> str:
    """Suffix of a label for the axes of components; empty for those in the world, on the children."""
    frame, side = load_axes(loads)
    return ", joint axes" * (frame == "joint") + ", on the parent" * (side == "parent")
