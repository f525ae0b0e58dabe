"""Strokes of line drawings, and the symbols of elements between two points."""

from typing import NamedTuple

import numpy as np

from ..palette import COLORS

STEEL, DARK = "0.45", "0.2"
THIN = {"color": DARK, "linewidth": 1.1, "zorder": 2.5}
_LANE = 3.8  # distance of elements side by side, in symbol sizes
_LEAD = 0.08  # of the length: where those part
_BARREL = 0.62  # of the largest length, unless the rod has to go in further


class Stroke(NamedTuple):
    """Points (n, 2) of a line, or of an area if `fill`, and its style for matplotlib."""

    points: np.ndarray
    style: dict
    fill: bool = False


class _Axis(NamedTuple):
    """An axis of the picture from a point, with the unit vectors along and across it."""

    start: np.ndarray
    along: np.ndarray
    across: np.ndarray
    length: float

    def __call__(self, far, side=0.0) -> np.ndarray:
        """Points (n, 2) at distances along the axis, and beside it."""
        far, side = np.broadcast_arrays(np.atleast_1d(far), np.atleast_1d(side))
        return self.start + far[:, None] * self.along + side[:, None] * self.across


def element_strokes(
    kind: str, ends: np.ndarray, reach: tuple[float, float], size: float, lane: float
) -> list[Stroke]:
    """Strokes of a symbol of `drawings.SYMBOLS` between two points (2, 2) of the picture.

    Args:
        reach: least and largest distance of the points along the trajectory, as seen.
        size: of symbols; lane: place beside others, in steps.
    """
    (a, b), leads = np.asarray(ends), []
    if lane:
        axis = _axis(a, b)
        share, side = _LEAD * axis.length, lane * _LANE * size
        near, far = axis([0.0, share, share], [0.0, 0.0, side]), axis([0.0, -share, -share], [0.0, 0.0, side])
        leads = [Stroke(near, THIN), Stroke(far + b - a, THIN)]
        a, b, reach = near[-1], far[-1] + b - a, tuple((1 - 2 * _LEAD) * r for r in reach)
    return leads + _SYMBOLS[kind](_axis(a, b), reach, size)


def _axis(a, b):
    length = float(np.linalg.norm(b - a))
    along = (b - a) / (length or 1.0)
    return _Axis(a, along, np.array([-along[1], along[0]]), length)


def _spring(axis, reach, size):
    share = np.r_[0.0, np.linspace(0.15, 0.85, 21), 1.0]
    swing = np.r_[0.0, 0.0, np.tile([1.0, -1.0], 10)[:19], 0.0, 0.0] * 1.6 * size
    return [Stroke(axis(share * axis.length, swing), THIN | {"color": STEEL, "zorder": 3.1})]


def _maxwell(axis, reach, size):
    """A spring and a damper in series, each on half of the way."""
    half, reach = axis.length / 2, (reach[0] / 2, reach[1] / 2)
    return [
        *_spring(axis._replace(length=half), reach, size),
        *_damper(axis._replace(start=axis.start + half * axis.along, length=half), reach, size),
    ]


def _barrel_and_piston(axis, reach):
    """Length of a barrel on the first point, and place of the piston on a rod of the second."""
    barrel = min(0.9 * reach[0], _BARREL * reach[1])
    return barrel, max(axis.length - reach[1] + 0.85 * barrel, 0.1 * barrel)


def _damper(axis, reach, size):
    """A cup, and a piston in it."""
    barrel, piston = _barrel_and_piston(axis, reach)
    innermost = reach[0] - reach[1] + 0.85 * barrel
    bottom, wide = float(np.clip(innermost - 0.1 * barrel, 0.0, 0.4 * barrel)), 1.1 * size
    piston = max(piston, bottom + 0.05 * barrel)
    return [
        Stroke(axis([0.0, bottom]), THIN),
        Stroke(axis([barrel, bottom, bottom, barrel], [wide, wide, -wide, -wide]), THIN),
        Stroke(axis(piston, [0.7 * wide, -0.7 * wide]), THIN | {"linewidth": 2.0}),
        Stroke(axis([piston, axis.length]), THIN),
    ]


def _cylinder(axis, reach, size, face="0.85"):
    """A closed barrel with a piston on a rod."""
    barrel, piston = _barrel_and_piston(axis, reach)
    wide = 1.2 * size
    box = {"facecolor": face, "edgecolor": DARK, "linewidth": 1.0, "zorder": 2.6}
    return [
        Stroke(axis([0.0, barrel, barrel, 0.0], [wide, wide, -wide, -wide]), box, True),
        Stroke(axis(piston, [0.9 * wide, -0.9 * wide]), THIN | {"linewidth": 2.2, "zorder": 2.7}),
        Stroke(axis([piston, axis.length]), THIN | {"linewidth": 2.0, "zorder": 2.65}),
    ]


def _bushing(axis, reach, size):
    """A sleeve of rubber in the middle."""
    angle = np.linspace(0.0, 2 * np.pi, 33)
    around = axis.start + axis.length / 2 * axis.along + 2.0 * size * np.column_stack([np.cos(angle), np.sin(angle)])
    rubber = {"facecolor": "0.72", "edgecolor": DARK, "linewidth": 1.0, "zorder": 3.6}
    return [Stroke(axis([0.0, axis.length]), THIN | {"linewidth": 2.0}), Stroke(around, rubber, True)]


def _rod(axis, reach, size):
    return [Stroke(axis([0.0, axis.length]), THIN | {"color": STEEL, "linewidth": 2.0})]


def _beam(axis, reach, size):
    beam = {"color": STEEL, "linewidth": 3.5, "solid_capstyle": "round", "zorder": 2.9}
    return [Stroke(axis([0.0, axis.length]), beam)]


_SYMBOLS = {
    "spring": _spring,
    "damper": _damper,
    "maxwell": _maxwell,
    "actuator": lambda axis, reach, size: _cylinder(axis, reach, size, COLORS[1]),
    "cylinder": _cylinder,
    "bushing": _bushing,
    "rod": _rod,
    "beam": _beam,
}
