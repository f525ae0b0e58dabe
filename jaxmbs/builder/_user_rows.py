"""Checks of user functions for constraint rows: evaluated at some random states before they are relied on."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import is_concrete
from ..kinematics._poses import coordinate_rate
from ..model._rows import CoordinateRows, CoupledJoints, UserPositionRows, UserVelocityRows
from ..model._system import System
from ..runtime import explain_error, jit
from ..typing import AnyArray

_NUM_STATES = 6
_SEED = 11  # any, but the same in every build
_AFFINE_TOLERANCE = {8: 1e-8, 4: 1e-3}  # relative: what counts as affine, by precision


class _RowSamples(NamedTuple):
    """Samples (states, k) of a row: at velocities, at rest, slopes along velocities and along coordinates."""

    moving: AnyArray
    rest: AnyArray
    slope: AnyArray
    along: AnyArray


def shape_faults(row: CoordinateRows, psi: Array, u: Array) -> list[str]:
    """Faults of the arguments and the returned shape of a row's function, found without numbers."""
    if isinstance(row, UserVelocityRows):
        returned, takes = row.law.function, "coordinates (nq,), velocities (nv,), t"
        given: tuple = (psi, u)
    elif isinstance(row, UserPositionRows):
        returned, takes, given = row.law.function, "coordinates (nq,), t", (psi,)
    elif isinstance(row, CoupledJoints) and row.law.function is not None:
        q = psi[np.asarray(row.coordinates)]
        returned, takes = lambda q, t: row.law.function(*q), "the coordinates of its joints"
        given = (q,)
    else:
        return []
    where = f"constraint {row.name!r}: its function of {takes}"
    try:
        found = jax.eval_shape(returned, *given, jnp.zeros(()))
    except Exception as error:  # noqa: BLE001 - it is the user's function: anything may come
        return [f"{where} cannot be evaluated: {explain_error(error)}"]
    if not hasattr(found, "dtype") or not jnp.issubdtype(found.dtype, jnp.floating):
        kind = getattr(found, "dtype", type(found).__name__)
        return [f"{where} must return an array of real numbers, zero where the row is kept; it returns {kind}"]
    most = 0 if isinstance(row, CoupledJoints) else 1
    if found.ndim > most or found.size == 0:
        return [f"{where} must return {'one number' if not most else 'a number or (m,) of them'}, not {found.shape}"]
    return []


def row_faults(system: System) -> list[str]:
    """Faults of user rows that are not affine in the velocities, or do not depend on anything that moves.

    The library takes velocity rows as `A u = -f_t`, with A from their slope at rest: what is not affine would be
    dropped.  Rows with traced numbers cannot be checked.
    """
    rows = [row for row in system.rows if isinstance(row, UserPositionRows | UserVelocityRows | CoupledJoints)]
    rows = [row for row in rows if is_concrete(row)]
    if not rows or not system.topology.num_velocities:
        return []
    random, top, found = np.random.default_rng(_SEED), system.topology, []
    dtype = jnp.result_type(float)
    psi, u = (random.normal(size=(_NUM_STATES, n)).astype(dtype) for n in (top.num_coordinates, top.num_velocities))
    t = np.linspace(0.0, 1.0, _NUM_STATES).astype(dtype)
    for row in rows:
        tried = _RowSamples(*map(np.asarray, _sample_row(row, top, psi, u, t)))
        found += _velocity_faults(row, tried) if row.is_nonholonomic else _position_faults(row, tried)
    return found


@jit(compile="tape")
def _sample_row(row, top, psi, u, t):
    def at(psi, u, t):
        rate = coordinate_rate(top, psi, u)
        along = jax.jvp(lambda psi: row.residual(psi, t), (psi,), (rate,))[1]
        rest, slope = jax.jvp(lambda u: row.slip(psi, u, t), (jnp.zeros_like(u),), (u,))
        return _RowSamples(row.slip(psi, u, t), rest, slope, along)

    return jax.vmap(at)(psi, u, t)


def _velocity_faults(row, tried):
    gap = np.abs(tried.moving - tried.rest - tried.slope)
    size = np.abs(tried.moving) + np.abs(tried.rest) + np.abs(tried.slope)
    bent = np.flatnonzero(
        (gap > _AFFINE_TOLERANCE[gap.dtype.itemsize] * size).any(0)
    )  # false where something is not finite
    if bent.size:
        return [
            f"constraint {row.name!r}: row {', '.join(map(str, bent))} of its VelocityRows is not affine in the "
            "velocities, `a(q, t) . u + b(q, t)`, as every row must be: a product, a square or an absolute value of "
            "velocities would be dropped; give a row that is linear in them, or a force law"
        ]
    return _slope_faults(row, tried.slope, "velocities")


def _position_faults(row, tried):
    return _slope_faults(row, tried.along, "coordinates")


def _slope_faults(row, slope, of):
    """Faults of rows that have no slope at any of the states."""
    idle = np.flatnonzero((slope == 0.0).all(0))
    if not idle.size:
        return []
    number = f"row {', '.join(map(str, idle))} of its function"
    return [f"constraint {row.name!r}: {number} has no slope by the {of}, so it restricts nothing"]
