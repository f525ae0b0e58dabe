"""Strokes of joints: markers of pins, balls, welds and feet; threads, plates and torsion elements about axes."""

import numpy as np

from ..palette import COLORS
from ._strokes import DARK, STEEL, THIN, Stroke

#: Symbols of joints whose frame on the ground stands on a foot.
STANDING = ("pin", "screw", "cross", "ball", "weld", "point")
_OPEN = {"linestyle": "none", "clip_on": False}
_RING = _OPEN | {"marker": "o", "color": "white", "markeredgecolor": DARK, "markersize": 5, "zorder": 4}
_BALL = _OPEN | {"marker": "o", "color": "0.55", "markeredgecolor": DARK, "markersize": 7, "zorder": 4}
_CROSS = _OPEN | {"marker": "x", "color": DARK, "markersize": 3.5, "zorder": 4.1}
_WELD = _OPEN | {"marker": "s", "color": DARK, "markersize": 4, "zorder": 4}
FOOT = 6  # the marker of matplotlib that hangs from its point
_FOOT = _OPEN | {"marker": FOOT, "color": "0.35", "markersize": 9, "zorder": 1}
_MARKERS = {"pin": [_RING], "point": [_RING], "cross": [_RING, _CROSS], "ball": [_BALL], "weld": [_WELD]}


def joint_markers(places: dict[str, np.ndarray], feet: np.ndarray) -> list[Stroke]:
    """Markers of joints at places (n, 2) by symbol, and feet (k, 2)."""
    drawn = [Stroke(at, marker) for symbol, at in places.items() if len(at) for marker in _MARKERS.get(symbol, ())]
    return [Stroke(feet, _FOOT)] * bool(len(feet)) + drawn


class JointAxis:
    """The axis of a joint along a trajectory, seen in a projection; angles are counted on the parent."""

    def __init__(self, joint, film, look):
        self.first, self.second = joint.frames
        self.film, self.look, self.axis = film, look, film.axes[joint.name]
        one = np.cross(self.axis, np.eye(3)[np.argmin(np.abs(self.axis))])
        self.one = one / np.linalg.norm(one)
        self.other = np.cross(self.axis, self.one)

    def turn(self, k: int) -> float:
        """Angle of the child against the parent [rad]."""
        moved = self.film.R[k, self.first].T @ self.film.R[k, self.second] @ self.one
        return float(np.arctan2(moved @ self.other, moved @ self.one))

    def around(self, k: int, angles, radii, heights=0.0, at_child: bool = False) -> np.ndarray:
        """Points (n, 2) at angles about the axis, at radii from it and heights along it."""
        angles, radii, heights = (part[:, None] for part in np.broadcast_arrays(angles, radii, heights))
        flat = radii * (np.cos(angles) * self.one + np.sin(angles) * self.other) + heights * self.axis
        centre = self.film.x[k, self.second if at_child else self.first]
        return self.look(centre + flat @ self.film.R[k, self.first].T)


def thread_strokes(axis: JointAxis, k: int, size: float) -> list[Stroke]:
    """A thread along the axis of a screw."""
    share = np.linspace(-1.0, 1.0, 97)
    spindle = axis.around(k, np.zeros(2), 0.0, 5.0 * size * np.array([-1.0, 1.0]))
    thread = axis.around(k, 8.0 * np.pi * share, 0.8 * size, 3.2 * size * share)
    return [Stroke(spindle, THIN | {"zorder": 3.7}), Stroke(thread, THIN | {"color": STEEL, "zorder": 3.8})]


def plate_strokes(axis: JointAxis, k: int, size: float) -> list[Stroke]:
    """A square of the plane in which a body moves, about the body."""
    corners = axis.around(k, np.pi / 4 + np.pi / 2 * np.arange(4), 2.5 * size, at_child=True)
    plate = {"facecolor": "0.88", "edgecolor": STEEL, "linewidth": 1.2, "zorder": 2.2}
    return [Stroke(corners, plate, True)]


def torsion_strokes(kind: str, axis: JointAxis, k: int, size: float) -> list[Stroke]:
    """A spiral from the parent to the child, which winds up as it turns; of a damper a drum with a vane, an arc and a
    thick part of it that turns with the child; of a drive a rim with a spoke that turns."""
    turn, thin = axis.turn(k), THIN | {"color": STEEL, "zorder": 3.8}
    if kind == "spring":
        share = np.linspace(0.0, 1.0, 81)
        return [Stroke(axis.around(k, share * (5.0 * np.pi + turn), size * (0.8 + 2.0 * share)), thin)]
    radius = 3.4 * size
    if kind == "damper":
        drum, vane = np.linspace(0.0, 1.5 * np.pi, 41), turn + np.linspace(-0.35, 0.35, 9)
        rim, wide = Stroke(axis.around(k, drum, radius), thin), thin | {"linewidth": 5.0, "solid_capstyle": "butt"}
        rims = [rim, Stroke(axis.around(k, vane, radius), wide)]
    else:
        thin = thin | {"color": COLORS[1]}
        rims = [Stroke(axis.around(k, np.linspace(0.0, 2 * np.pi, 49), radius), thin | {"linewidth": 3.0})]
    return [*rims, Stroke(axis.around(k, turn, np.array([0.0, radius])), thin)]
