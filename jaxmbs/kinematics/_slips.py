"""Slip of the rubbing surfaces of joints."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..friction._joint_friction import JointFriction
from ..friction._surfaces import SurfaceRows, surface_rows
from ..math._spatial import cross
from ..model._system import System
from ..runtime import constant_product, gather_static, segment_sum_static
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
    f, dtype = system.joint_friction, at.u.dtype
    rows = surface_rows(f.kinds, dtype)
    of, on = rows.surface_of_load, rows.surface_of_slip
    bears, slips, tangent = _local_rows(f, rows)
    # all that rows need of their surfaces, in one product
    frames = jnp.sum(gather_static(at.R, f.axes)[:, :, :, None] * f.basis.astype(dtype)[:, None], axis=2)
    table = jnp.concatenate([frames.reshape(-1, 9), gather_static(at.x, f.points)], axis=1)
    of_row = constant_product(np.concatenate([of, on])[:, None] == np.arange(len(f.joints)), table)
    local = jnp.concatenate([bears, slips]).astype(dtype).reshape(-1, 2, 1, 3)
    first, second = jnp.moveaxis(jnp.sum(of_row[:, :9].reshape(-1, 1, 3, 3) * local, axis=3), 1, 0)
    m = len(of)
    arm = cross(of_row[:, 9:], jnp.concatenate([first[:m], second[m:]]))
    bears = jnp.concatenate([first[:m], second[:m] + arm[:m]], axis=1)
    slips = jnp.concatenate([first[m:] + arm[m:], second[m:]], axis=1)
    ends = [np.asarray(frames)[on][:, None] == np.arange(len(at.x)) for frames in (f.children, f.parents)]
    twist = constant_product(ends[0].astype(float) - ends[1], frame_twists(system, at.V))
    slip = jnp.sum(slips * twist, axis=1)
    square = segment_sum_static(slip * slip, on, len(f.joints))
    return Slips(rows, bears, slips, slip, square, tangent)


def _local_rows(f: JointFriction, rows: SurfaceRows):
    """Rows (k, 6) of loads and of slips in the axes of their surfaces, and tangents (n,) of the angles of threads.

    What no surface has, threads, lengths or radii, adds no equation.
    """
    of, on = rows.surface_of_load, rows.surface_of_slip
    load, arm, tangent = jnp.asarray(rows.load), f.radius, jnp.zeros_like(f.radius)
    slips = jnp.asarray(rows.slip)
    if rows.is_thread.any():
        arm = jnp.where(rows.is_thread, f.radius, 1.0)
        lean = jnp.hypot(arm, f.pitch)
        cosine, sine = arm / lean, f.pitch / lean  # of the angle of a thread; one and zero for all others
        load, arm, tangent = load / gather_static(cosine, of)[:, None], f.radius * cosine, sine / cosine
        slips = slips + gather_static(sine, on)[:, None] * (_THREAD_AXIS * rows.is_thread[on][:, None])
    if rows.load_by_length.any():
        load = load + rows.load_by_length / gather_static(f.length, of)[:, None]
    if rows.slip_by_radius.any():
        slips = slips + gather_static(arm, on)[:, None] * rows.slip_by_radius
    return load, slips, tangent
