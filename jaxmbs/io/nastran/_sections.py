"""Sections by their dimensions, PBARL and PBEAML: areas, moments and shares of shear as beam theory has them.

A section is a sum of rectangles, (width along z, height along y, centre z, centre y); plane 1 bends along y.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np


class Shape(NamedTuple):
    """Area, I1 (in plane 1), I2, torsion J, shear factors K1 and K2; whether its shear centre is its centroid."""

    area: float
    inertia_1: float
    inertia_2: float
    torsion: float
    shear: tuple[float, float]
    is_centred: bool = True


def _rod(r):
    I = np.pi * r**4 / 4
    return Shape(np.pi * r**2, I, I, 2 * I, (0.9, 0.9))


def _tube(outer, inner):
    I = np.pi * (outer**4 - inner**4) / 4
    return Shape(np.pi * (outer**2 - inner**2), I, I, 2 * I, (0.5, 0.5) if inner else (0.9, 0.9))


def _bar(w, h):
    a, b = max(w, h), min(w, h)
    J = a * b**3 * (1 / 3 - 0.21 * b / a * (1 - b**4 / (12 * a**4)))
    return Shape(w * h, w * h**3 / 12, h * w**3 / 12, J, (5 / 6, 5 / 6))


def _box(w, h, t1, t2):
    """Walls: t1 of top and bottom, t2 of the sides; torsion by Bredt's formula."""
    a, b = w - 2 * t2, h - 2 * t1
    A = w * h - a * b
    J = 2 * t1 * t2 * (w - t2) ** 2 * (h - t1) ** 2 / (w * t2 + h * t1 - t2**2 - t1**2)
    return Shape(A, (w * h**3 - a * b**3) / 12, (h * w**3 - b * a**3) / 12, J, (2 * t2 * h / A, 2 * t1 * w / A))


def _open(rectangles, upright: Sequence[int], is_centred=False):
    """A thin-walled open section; those rectangles carry the shear of plane 1, the others that of plane 2."""
    w, h, z, y = np.array(rectangles, float).T
    A = w * h
    cz, cy = A @ z / A.sum(), A @ y / A.sum()
    web = float(sum(A[k] for k in upright))
    I1, I2 = np.sum(w * h**3 / 12 + A * (y - cy) ** 2), np.sum(h * w**3 / 12 + A * (z - cz) ** 2)
    J = np.sum(np.maximum(w, h) * np.minimum(w, h) ** 3) / 3
    shear = web / A.sum(), float(A.sum() - web) / A.sum()
    return Shape(float(A.sum()), float(I1), float(I2), float(J), shear, is_centred)


def _i(h, w1, w2, tw, t1, t2):
    """Height, widths of the lower and the upper flange, thickness of the web and of the two flanges."""
    web = h - t1 - t2
    parts = [(w1, t1, 0, t1 / 2), (tw, web, 0, t1 + web / 2), (w2, t2, 0, h - t2 / 2)]
    return _open(parts, [1], w1 == w2 and t1 == t2)


def _i1(flange, tw, web, h):
    """Width of the flanges beside the web, thickness and height of the web, height."""
    t = (h - web) / 2
    return _i(h, flange + tw, flange + tw, tw, t, t)


def _h(inner, outer, h, t):
    """Width of the bar between the sides, of both sides together, height, thickness of the bar."""
    side = outer / 2
    at = (inner + side) / 2
    return _open([(side, h, -at, 0), (inner, t, 0, 0), (side, h, at, 0)], [0, 2], True)


def _t(w, h, tf, tw):
    """Width, height, thickness of the flange, of the web."""
    return _open([(w, tf, 0, h - tf / 2), (tw, h - tf, 0, (h - tf) / 2)], [1])


def _t2(w, h, tf, tw):
    """Width, height, thickness of the flange, which lies below, of the web."""
    return _open([(w, tf, 0, tf / 2), (tw, h - tf, 0, tf + (h - tf) / 2)], [1])


def _channel(w, h, tw, tf):
    """Width, height, thickness of the web, of the flanges."""
    inner = w - tw
    parts = [(tw, h, tw / 2, 0), (inner, tf, tw + inner / 2, (h - tf) / 2), (inner, tf, tw + inner / 2, (tf - h) / 2)]
    return _open(parts, [0])


#: By name: how many dimensions, what must hold of them, and the section.
SECTIONS: dict[str, tuple[int, Callable[..., bool], Callable[..., Shape]]] = {
    "ROD": (1, lambda r: r > 0, _rod),
    "TUBE": (2, lambda a, b: a > b >= 0, _tube),
    "TUBE2": (2, lambda a, t: 0 < t <= a, lambda a, t: _tube(a, a - t)),
    "BAR": (2, lambda w, h: min(w, h) > 0, _bar),
    "BOX": (4, lambda w, h, t1, t2: min(t1, t2) > 0 and w > 2 * t2 and h > 2 * t1, _box),
    "I": (6, lambda h, w1, w2, tw, t1, t2: min(w1, w2, tw, t1, t2) > 0 and h > t1 + t2 and tw <= min(w1, w2), _i),
    "I1": (4, lambda f, tw, web, h: min(f, tw, web) > 0 and h > web, _i1),
    "H": (4, lambda inner, outer, h, t: min(inner, outer, t) > 0 and h > t, _h),
    "T": (4, lambda w, h, tf, tw: min(tf, tw) > 0 and h > tf and w > tw, _t),
    "T2": (4, lambda w, h, tf, tw: min(tf, tw) > 0 and h > tf and w > tw, _t2),
    "CHAN": (4, lambda w, h, tw, tf: min(tw, tf) > 0 and h > 2 * tf and w > tw, _channel),
}
