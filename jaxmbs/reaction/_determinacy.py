"""Determinacy of joint reactions at a pose: components that self-stresses or contacts of couplers leave open."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..constraints import _constraints as constraints
from ..constraints._coupled_joints import coupled_joints, couplers_and_user_rows
from ..constraints._joint_wrenches import joint_wrenches
from ..constraints._reaction_map import reaction_carriers
from ..constraints._rows import has_frames
from ..kinematics._configuration import VelocityKinematics
from ..model._system import System
from ..runtime import gather_static
from ._self_stress import UNIQUE_TOLERANCE, project_out_range, relative_share


class JointDeterminacy(NamedTuple):
    """By carrier: unique components (carriers, 3) bool of force and of moment, and, None without couplers, whether
    (carriers,) the forces are left out that act where a coupler touches."""

    force: Array
    moment: Array
    lacks_contact: Array | None


def joint_determinacy(system: System, at: VelocityKinematics, stresses, placed: Callable) -> JointDeterminacy:
    """Components of the joint reactions that self-stresses and the contacts of couplers leave determined.

    Args: stresses (n, rows), multipliers in the rows' common unit; placed: from world wrenches
         (carriers, 6) to forces and moments (carriers, 3) in the axes asked.
    """
    number, dtype = len(reaction_carriers(system)), at.u.dtype
    acting, size = couplers_and_user_rows(system), jnp.zeros((0, number, 6), dtype)
    if system.closures or has_frames(system):
        none = jnp.zeros((system.topology.bodies.size, 6), dtype)
        y = constraints.row_scale(system).unit[None] * stresses
        size = jax.vmap(lambda y: joint_wrenches(system, at, none, y).wrench)(y)
    touched = _joints_with_contact(system, at, acting, number) if acting else None
    if acting:
        size = jnp.concatenate([size, _contact_wrenches(system, at, touched)[None]])
    if not len(size):
        every = jnp.ones((number, 3), bool)
        return JointDeterminacy(every, every, touched)
    force, moment = jax.vmap(placed)(size)
    size = lax.stop_gradient(jnp.abs(jnp.concatenate([force * system.length, moment], axis=-1)))
    inside = relative_share(jnp.max(size[: len(size) - bool(acting)], axis=0, initial=0.0))
    unique = inside <= UNIQUE_TOLERANCE[dtype.itemsize]  # false for NaN
    if acting:
        unique = unique & (jax.vmap(relative_share)(size[-1]) <= UNIQUE_TOLERANCE[dtype.itemsize])
    return JointDeterminacy(unique[:, :3], unique[:, 3:], touched)


def _joints_with_contact(system, at, acting, number):
    """True (carriers,) for each joint that the contact of some coupler would load."""
    every = jnp.any(jnp.stack([coupled_joints(system, row, at) for row in acting]), axis=0)
    return jnp.concatenate([every, np.zeros(number - len(every), bool)])


def _contact_wrenches(system, at, touched):
    """Random world wrenches (carriers, 6) on the joints with contact, without effort along their freedoms."""
    top, number = system.topology, len(touched)
    columns = np.full((number, 6), top.num_velocities)
    for k, joint in enumerate(top.joints):
        columns[k, : joint.num_velocities] = np.arange(joint.num_velocities) + joint.first_velocity
    freedoms = gather_static(jnp.concatenate([at.S, jnp.zeros_like(at.S[:1])]), columns).transpose(0, 2, 1)
    unit = jnp.concatenate([jnp.full(3, system.length, at.S.dtype), jnp.ones(3, at.S.dtype)])
    # any seed but a fixed one: a random wrench has no zero component, and marks must not change from call to call
    tried = unit[None] * np.random.default_rng(6).normal(size=(number, 6)).astype(at.S.dtype)
    wrench = jax.vmap(lambda S, w: project_out_range(S, w[None])[0])(*lax.stop_gradient((freedoms, tried)))
    return jnp.where(touched[:, None], wrench, 0.0)
