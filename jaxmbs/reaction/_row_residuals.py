"""Residuals of the constraint rows for given accelerations, relative to the terms that add up in them."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..constraints import _constraints as constraints
from ..constraints._saddle_operator import constraint_operator
from ..kinematics._configuration import VelocityKinematics, node_accelerations
from ..math._linalg import relative
from ..model._system import System

#: Largest residual that counts as rounding, relative to the terms of a row or to the largest load (double, single
#: precision): far above the rounding of well-posed mechanisms, far below the residual of wrong reactions.
ROUNDING_TOLERANCE = {8: 1e-6, 4: 1e-2}


def row_residuals(system: System, at: VelocityKinematics, a):
    """Gaps (rows,) `A a - gamma` of accelerations a (nv,)."""
    rest = node_accelerations(system.topology, at, jnp.zeros_like(at.u))
    gamma = constraints.acceleration_bias(system, at, rest)
    return constraints.jacobian(system, at) @ a - gamma


def relative_row_residual(system: System, at: VelocityKinematics, a, V_dot, gaps, loads):
    """Largest of the residuals (rows,) of accelerations a (nv,), relative to the terms that add up in the rows.

    Args: V_dot (nodes, 6): the rates of the nodes' twists; loads: see `_acceleration_scale`.
    """
    if not system.has_constraints:
        return jnp.zeros_like(at.t)
    rows = constraint_operator(system, at)
    return relative(rows.unit * gaps, rows.sizes(V_dot, a) + lax.stop_gradient(_acceleration_scale(system, *loads)))


def _acceleration_scale(system, wrench, *efforts):
    """Acceleration of the heaviest body under the loads [rad/s^2 and lengths/s^2], a scale for the rows' residuals at
    rest, where every acceleration is rounding.

    Args: wrench (n, 6) of joints; efforts (nv,) along the velocities, several where they may balance at one joint.
    """
    top, length = system.topology, system.length
    arm = jnp.where(np.asarray(top.spins) > 0, length, 1.0)
    along = (jnp.max(jnp.abs(effort) / arm, initial=0.0) for effort in efforts)
    force = sum(along, jnp.max(jnp.abs(wrench[:, 3:]), initial=0.0))
    heaviest = jnp.maximum(jnp.max(system.mass, initial=0.0), jnp.finfo(force.dtype).tiny)
    return (jnp.sqrt(jnp.sum(system.gravity**2)) + force / heaviest) / length
