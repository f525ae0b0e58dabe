"""Geometry of rubbing joints: loads of their surfaces from the wrench that the joint carries, and speeds of slip.

Six-vectors are local: about the surface's point, in its axes, z along its own axis; (moment, force) and (angular
velocity, velocity).  A bearing of a given length has two ends, each a point that takes a transverse force; without a
length it is one point, and moments do not load it.
"""

from typing import NamedTuple

import numpy as np

_MX, _MY, _MZ, _FX, _FY, _FZ = _WX, _WY, _WZ, _VX, _VY, _VZ = range(6)


class Surface(NamedTuple):
    """One geometry.

    Attributes:
        patches: of the places where it bears, the components of the load: each of (column of the wrench, factor,
            factor over the length).
        slips: components of the slip: columns of the twist; rotations are multiplied by the radius.
        freedoms: columns of the wrench along the freedoms of the joint.
    """

    patches: tuple
    slips: tuple[int, ...]
    freedoms: tuple[int, ...]
    is_thread: bool = False


def _component(*terms):
    return terms


_POINT = ((_component((_FX, 1.0, 0.0)), _component((_FY, 1.0, 0.0))),)
_ENDS = tuple(
    (
        _component((_FX, 0.5, 0.0), (_MY, 0.0, sign)),
        _component((_FY, 0.5, 0.0), (_MX, 0.0, -sign)),
    )
    for sign in (1.0, -1.0)
)
_ALONG = ((_component((_FZ, 1.0, 0.0)),),)
_BALL = ((_component((_FX, 1.0, 0.0)), _component((_FY, 1.0, 0.0)), _component((_FZ, 1.0, 0.0))),)
_CORNERS = tuple(
    (_component((_FZ, 0.25, 0.0), (_MX, 0.0, a / 2), (_MY, 0.0, b / 2)),) for a in (1.0, -1.0) for b in (1.0, -1.0)
)

SURFACES = {
    "Revolute": Surface(_POINT, (_WZ,), (_MZ,)),
    "Revolute with length": Surface(_ENDS + _ALONG, (_WZ,), (_MZ,)),
    "Universal": Surface(_POINT, (_WZ,), (_MZ,)),
    "Universal with length": Surface(_ENDS + _ALONG, (_WZ,), (_MZ,)),
    "Prismatic": Surface(_POINT, (_VZ,), (_FZ,)),
    "Prismatic with length": Surface(_ENDS, (_VZ,), (_FZ,)),
    "Cylindrical": Surface(_POINT, (_VZ, _WZ), (_FZ, _MZ)),
    "Cylindrical with length": Surface(_ENDS, (_VZ, _WZ), (_FZ, _MZ)),
    "Spherical": Surface(_BALL, (_WX, _WY, _WZ), (_MX, _MY, _MZ)),
    "Planar": Surface(_ALONG, (_VX, _VY, _WZ), (_FX, _FY, _MZ)),
    "Planar with length": Surface(_CORNERS, (_VX, _VY, _WZ), (_FX, _FY, _MZ)),
    "Screw": Surface(_ALONG, (_WZ,), (_MZ,), is_thread=True),  # the advance enters by the pitch
}


class SurfaceRows(NamedTuple):
    """Components of the loads and of the slips of several surfaces, one row each.

    Attributes:
        load, load_by_length: (loads, 6); surface_of_load, patch_of_load: (loads,); surface_of_patch: (patches,).
        slip, slip_by_radius: (slips, 6); surface_of_slip: (slips,).
        is_thread: (surfaces,).
    """

    load: np.ndarray
    load_by_length: np.ndarray
    surface_of_load: np.ndarray
    patch_of_load: np.ndarray
    surface_of_patch: np.ndarray
    slip: np.ndarray
    slip_by_radius: np.ndarray
    surface_of_slip: np.ndarray
    is_thread: np.ndarray


def surface_rows(kinds: tuple[str, ...], dtype) -> SurfaceRows:
    """The rows of surfaces of these kinds, in numbers of a type."""
    loads, by_length, of_load, patch_of, of_patch, slips, of_slip = [], [], [], [], [], [], []
    for k, kind in enumerate(kinds):
        for patch in SURFACES[kind].patches:
            for terms in patch:
                rows = np.zeros((2, 6))
                for column, factor, factor_by_length in terms:
                    rows[:, column] = factor, factor_by_length
                loads.append(rows[0])
                by_length.append(rows[1])
                of_load.append(k)
                patch_of.append(len(of_patch))
            of_patch.append(k)
        slips += SURFACES[kind].slips
        of_slip += [k] * len(SURFACES[kind].slips)
    unit = np.eye(6, dtype=dtype)[slips]
    is_turn = (np.array(slips) < 3)[:, None]
    rows = (
        np.array(loads, dtype),
        np.array(by_length, dtype),
        np.array(of_load),
        np.array(patch_of),
        np.array(of_patch),
    )
    is_thread = np.array([SURFACES[kind].is_thread for kind in kinds])
    return SurfaceRows(*rows, unit * ~is_turn, unit * is_turn, np.array(of_slip), is_thread)
