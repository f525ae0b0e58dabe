"""Slip of the rubbing surfaces of joints."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..friction._joint_friction import JointFriction
from ..friction._surfaces import SurfaceRows, surface_rows
from ..math._spatial import cross
from ..model._system import System
from ..runtime import gather_static, segment_sum_static
from ._configuration import VelocityKinematics
from ._poses import frame_twists

_THREAD_AXIS = np.eye(1, 6, 5)


class Slips(NamedTuple):
    """Surfaces at a configuration with velocities.

    Attributes:
        rows: of the surfaces' kinds.
        bears: (loads, 6) components of the loads per world wrench of the joint on its child.
        directions: (slips, 6) world wrench of a unit friction along each component of the slip.
        slip: (slips,) components of the slip [m/s]; square: (n,) their sums of squares.
        tangent: (n,) of the angle of a thread; zero for all others.
    """

    rows: SurfaceRows
    bears: Array
    directions: Array
    slip: Array
    square: Array
    tangent: Array


def slips_of(system: System, at: VelocityKinematics) -> Slips:
    """The slips of all surfaces."""
    f, dtype = system.friction, at.u.dtype
    rows = surface_rows(f.kinds, dtype)
    arm = jnp.where(rows.is_thread, f.radius, 1.0)
    lean = jnp.hypot(arm, f.pitch)
    cosine, sine = arm / lean, f.pitch / lean  # of the angle of a thread; one and zero for all others
    of, on = rows.surface_of_load, rows.surface_of_slip
    bears = rows.load / gather_static(cosine, of)[:, None]
    bears = bears + rows.load_by_length / gather_static(f.length, of)[:, None]
    slips = rows.slip + gather_static(f.radius * cosine, on)[:, None] * rows.slip_by_radius
    slips = slips + gather_static(sine, on)[:, None] * (_THREAD_AXIS * rows.is_thread[on][:, None]).astype(dtype)
    first, second = _in_world(f, at, np.concatenate([of, on]), jnp.concatenate([bears, slips]).astype(dtype))
    m = len(of)
    bears = jnp.concatenate([first[:m], second[:m] + cross(gather_static(at.x, _of(f.points, of)), first[:m])], 1)
    turns, slides = first[m:], second[m:]
    slips = jnp.concatenate([turns + cross(gather_static(at.x, _of(f.points, on)), slides), slides], axis=1)
    frames = frame_twists(system, at.V)
    twist = gather_static(frames, _of(f.children, on)) - gather_static(frames, _of(f.parents, on))
    slip = jnp.sum(slips * twist, axis=1)
    square = segment_sum_static(slip * slip, on, len(f.joints))
    return Slips(rows, bears, slips, slip, square, sine / cosine)


def _of(frames, surfaces):
    """Frames of the surfaces."""
    return np.asarray(frames)[surfaces]


def _in_world(f: JointFriction, at, surfaces, rows):
    """World components of the two vectors (k, 3) of rows (k, 6) in the axes of their surfaces."""
    basis = gather_static(f.basis.astype(rows.dtype), surfaces)
    R = gather_static(at.R, _of(f.axes, surfaces))
    both = rows.reshape(-1, 2, 1, 3)
    inner = jnp.sum(basis[:, None] * both, axis=3)
    both = jnp.sum(R[:, None] * inner[:, :, None, :], axis=3)
    return both[:, 0], both[:, 1]
