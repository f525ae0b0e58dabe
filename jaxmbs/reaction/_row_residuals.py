"""How far given accelerations are from those that the constraint rows allow."""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..dynamics._sparse_saddle import constraint_operator
from ..kinematics import _constraints as constraints
from ..kinematics._configuration import VelocityKinematics, node_accelerations
from ..math._linalg import relative
from ..model._system import System

#: Of what adds up in a row, or of the largest load: what may be left over (double, single precision).
ROUNDING_TOLERANCE = {8: 1e-6, 4: 1e-2}


def row_residuals(system: System, at: VelocityKinematics, a):
    """Gaps (rows,) `A a - gamma` of accelerations a (nv,)."""
    rest = node_accelerations(system.topology, at, jnp.zeros_like(at.u))
    gamma = constraints.acceleration_bias(system, at, rest)
    return constraints.jacobian(system, at) @ a - gamma


def relative_row_residual(system: System, at: VelocityKinematics, a, V_dot, gaps, loads):
    """The largest of the gaps (rows,) of the accelerations a (nv,), of the largest that adds up in them.

    Args: V_dot (nodes, 6): the rates of the nodes' twists; loads: see `_acceleration_scale`.
    """
    if not system.has_constraints:
        return jnp.zeros_like(at.t)
    rows = constraint_operator(system, at)
    return relative(rows.unit * gaps, rows.sizes(V_dot, a) + lax.stop_gradient(_acceleration_scale(system, *loads)))


def _acceleration_scale(system, wrench, *efforts):
    """What loads would do to the heaviest body [rad/s^2 and lengths/s^2]: at rest, where every acceleration is
    rounding, the rows' gaps are measured by it.

    Args: wrench (n, 6) of joints; efforts (nv,) along the velocities, several where they may balance at one joint.
    """
    top, length = system.topology, system.length
    arm = jnp.where(np.asarray(top.spins) > 0, length, 1.0)
    along = (jnp.max(jnp.abs(effort) / arm, initial=0.0) for effort in efforts)
    force = sum(along, jnp.max(jnp.abs(wrench[:, 3:]), initial=0.0))
    heaviest = jnp.maximum(jnp.max(system.mass, initial=0.0), jnp.finfo(force.dtype).tiny)
    return (jnp.sqrt(jnp.sum(system.gravity**2)) + force / heaviest) / length
