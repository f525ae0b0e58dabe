"""Geometry of rubbing joints: loads of their surfaces from the wrench that the joint carries, and speeds of slip.

Six-vectors are local: about the surface's point, in its axes, z along its own axis; (moment, force) and (angular
velocity, velocity).  A bearing of a given length has two ends, each a point that takes a transverse force; without a
length it is one point, and moments do not load it.
"""

from typing import NamedTuple

import numpy as np

#: Places where a surface bears, each with a load of three components.
PATCHES = 4
_MX, _MY, _MZ, _FX, _FY, _FZ = range(6)


class Surface(NamedTuple):
    """One geometry: load of the patches (PATCHES, 3, 6) by the wrench, its part to be divided by the length; slip
    (3, 6) by the twist, its part to be multiplied by the radius; and the wrench's parts along the freedoms (k, 6)."""

    load: np.ndarray
    load_by_length: np.ndarray
    slip: np.ndarray
    slip_by_radius: np.ndarray
    freedoms: np.ndarray
    needs_radius: bool
    takes_length: bool
    is_thread: bool = False


def _rows(*places):
    """Matrix (3, 6) with a one in each place (row, column)."""
    found = np.zeros((3, 6))
    for row, column in places:
        found[row, column] = 1.0
    return found


def _patches(*rows):
    """Tables (PATCHES, 3, 6) from lists of (row, column, value)."""
    found = np.zeros((PATCHES, 3, 6))
    for patch, entries in enumerate(rows):
        for row, column, value in entries:
            found[patch, row, column] = value
    return found


_POINT = _patches([(0, _FX, 1.0), (1, _FY, 1.0)])
_HALVES = [(0, _FX, 0.5), (1, _FY, 0.5)]
_COUPLE = _patches([(0, _MY, 1.0), (1, _MX, -1.0)], [(0, _MY, -1.0), (1, _MX, 1.0)])
_ENDS = _patches(_HALVES, _HALVES)
_ENDS_AND_COLLAR = _patches(_HALVES, _HALVES, [(2, _FZ, 1.0)])
_NONE = _patches()
_CORNERS = _patches(*([(2, _FZ, 0.25)],) * 4)
_TILTS = _patches(*([(2, _MX, a / 2), (2, _MY, b / 2)] for a in (1.0, -1.0) for b in (1.0, -1.0)))

_SPIN, _SLIDE, _STILL = _rows((0, _MZ)), _rows((0, _FZ)), _rows()
_AXIS = np.eye(6)


def _both(kind, with_length, slip, spin, freedoms, needs_radius):
    """Surfaces of a kind without and with a length: their keys and geometries."""
    point = Surface(_POINT, _NONE, slip, spin, _AXIS[freedoms], needs_radius, True)
    return {kind: point, f"{kind} with length": point._replace(load=with_length, load_by_length=_COUPLE)}


SURFACES = {
    **_both("Revolute", _ENDS_AND_COLLAR, _STILL, _SPIN, [_MZ], True),
    **_both("Universal", _ENDS_AND_COLLAR, _STILL, _SPIN, [_MZ], True),
    **_both("Prismatic", _ENDS, _SLIDE, _STILL, [_FZ], False),
    **_both("Cylindrical", _ENDS, _SLIDE, _rows((1, _MZ)), [_FZ, _MZ], True),
    "Spherical": Surface(
        _patches([(0, _FX, 1.0), (1, _FY, 1.0), (2, _FZ, 1.0)]),
        _NONE,
        _STILL,
        _rows((0, _MX), (1, _MY), (2, _MZ)),
        _AXIS[[_MX, _MY, _MZ]],
        True,
        False,
    ),
    "Planar": Surface(
        _patches([(2, _FZ, 1.0)]),
        _NONE,
        _rows((0, _FX), (1, _FY)),
        _rows((2, _MZ)),
        _AXIS[[_FX, _FY, _MZ]],
        False,
        True,
    ),
    # along the thread; the advance enters by the pitch
    "Screw": Surface(_patches([(2, _FZ, 1.0)]), _NONE, _STILL, _SPIN, _AXIS[[_MZ]], True, False, True),
}
SURFACES["Planar with length"] = SURFACES["Planar"]._replace(load=_CORNERS, load_by_length=_TILTS)


def table(kinds, field):
    """Tables of a field (n, ...) of all surfaces."""
    return np.stack([getattr(SURFACES[kind], field) for kind in kinds])
