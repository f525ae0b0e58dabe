"""Rows of drives, couplers and user functions of coordinates and velocities; nonholonomic ones come last."""

import jax
import jax.numpy as jnp

from ..model._system import System
from ._poses import coordinate_rate


def residual(system: System, psi, t):
    """Rows of drives, couplers and user functions of position."""
    rows = [row.residual(psi, t) for row in system.rows if not row.is_nonholonomic]
    return jnp.concatenate([jnp.zeros(0, psi.dtype), *rows])


def rates(system, psi, t, u):
    """Rates of the coordinate rows and the user's velocity rows at velocities u, without their dependence on time."""
    rate = coordinate_rate(system.topology, psi, u)
    rates = jax.jvp(lambda q: residual(system, q, t), (psi,), (rate,))[1]
    slips = jax.jvp(lambda v: _velocity_rows(system, psi, t, v), (jnp.zeros_like(u),), (u,))[1]
    return jnp.concatenate([rates, slips])


def _velocity_rows(system, psi, t, u):
    """The user's velocity rows; they come last."""
    rows = [row.slip(psi, u, t) for row in system.rows if row.is_nonholonomic]
    return jnp.concatenate([jnp.zeros(0, psi.dtype), *rows])


def time_rates(system, psi, t):
    """Rates of the same rows at rest: the partial derivatives by time, and nonholonomic rows at zero velocities."""
    rate = jax.jvp(lambda t: residual(system, psi, t), (t,), (jnp.ones_like(t),))[1]
    rest = jnp.zeros(system.topology.num_velocities, psi.dtype)
    return jnp.concatenate([rate, _velocity_rows(system, psi, t, rest)])


def efforts(system: System, psi, t, multipliers):
    """Efforts (nv,) of the multipliers (rows,) of drives, couplers and user rows: their part of `A^T lambda`."""
    rest = jnp.zeros(system.topology.num_velocities, psi.dtype)
    if not system.rows:
        return rest
    known = system.topology.num_rows - sum(len(g.names) * g.kind.num_rows for g in system.closures)
    return jax.linear_transpose(lambda v: rates(system, psi, t, v), rest)(multipliers[-known:])[0]
