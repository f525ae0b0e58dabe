"""Rows of drives, couplers, cables and user functions of coordinates and velocities; nonholonomic ones come last."""

import itertools

import jax
import jax.numpy as jnp

from ..model._rows import CableRow, Drive
from ..model._system import System
from ..runtime import gather_static
from ._cable_rows import cable_residual
from ._driven_values import driven_values
from ._poses import coordinate_rate


def residual(system: System, psi, t):
    """Rows of drives, couplers and user functions of position."""
    return _position_rows(system, psi, t, driven_values(system, t, psi.dtype))


def _position_rows(system, psi, t, driven):
    """The rows, from the values (drives,) that the drives hold their coordinates at."""
    rows, number = [jnp.zeros(0, psi.dtype)], 0
    for is_drive, some in itertools.groupby(system.rows, lambda row: isinstance(row, Drive)):
        if is_drive:
            places = [place for row in some for place in row.coordinates]
            rows.append(gather_static(psi, places) - driven[number : number + len(places)])
            number += len(places)
        else:
            rows += [_residual_of(system, row, psi, t) for row in some if not row.is_nonholonomic]
    return jnp.concatenate(rows)


def _residual_of(system, row, psi, t):
    return cable_residual(system, row, psi, t) if isinstance(row, CableRow) else row.residual(psi, t)


def rates(system, psi, t, u):
    """Rates of the coordinate rows and the user's velocity rows at velocities u, without their dependence on time."""
    rate = coordinate_rate(system.topology, psi, u)
    still = jnp.zeros(sum(isinstance(row, Drive) for row in system.rows), psi.dtype)  # their values have no rate here
    rates = jax.jvp(lambda q: _position_rows(system, q, t, still), (psi,), (rate,))[1]
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
