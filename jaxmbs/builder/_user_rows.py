"""Checks of user functions for constraint rows: evaluated at some random states before they are relied on."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..joints._rows import AbstractRows
from ..kinematics._poses import coordinate_rate
from ..model._rows import row_elements
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


def row_count(name: str, law: AbstractRows, psi: AnyArray, u: AnyArray, frames: int, joints: int) -> tuple:
    """Number of rows of an element, and faults of the arguments and the returned shape of its function, without
    numbers.

    Args: frames, joints: numbers of those that it acts on and reads; psi, u: coordinates and velocities of all.
    """
    q = psi if law.reads_all else psi[:joints]
    what = f"its function of {law.takes}" if law.takes else f"the function of its {type(law).__name__}"
    where, given = f"constraint {name!r}: {what}", (q, u)
    if not law.takes and not law.is_nonholonomic:
        given = (np.broadcast_to(np.eye(3), (frames, 3, 3)), np.zeros((frames, 3)), q)
    function = law.called if law.takes else law.slip if law.is_nonholonomic else law.value
    try:
        # within a function of its own: JAX compares those it has seen, and arrays in them have no truth
        found = jax.eval_shape(lambda *x: function(*x), *given, 0.0)
    except Exception as error:  # noqa: BLE001 - it is the user's function: anything may come
        return 0, [f"{where} cannot be evaluated: {explain_error(error)}"]
    if not hasattr(found, "dtype") or not jnp.issubdtype(found.dtype, jnp.floating):
        kind = getattr(found, "dtype", type(found).__name__)
        return 0, [f"{where} must return an array of real numbers, zero where the row is kept; it returns {kind}"]
    least, most = (0, 0 if law.gives_one else 1) if law.takes else (1, 1)
    if not least <= found.ndim <= most or found.size == 0:
        asked = "one number" if not most else "(m,) numbers" if least else "a number or (m,) of them"
        return 0, [f"{where} must return {asked}, not {found.shape}"]
    return found.size, []


def row_faults(system: System) -> list[str]:
    """Faults of user rows that are not affine in the velocities, or do not depend on anything that moves.

    The library takes velocity rows as `A u = -f_t`, with A from their slope at rest: what is not affine would be
    dropped.  Rows with traced numbers cannot be checked.
    """
    inside = (row for row in row_elements(system.rows) if row.group.acts_in_joints and not row.frames)
    rows = [row for row in inside if is_concrete(row.law)]
    if not rows or not system.topology.num_velocities:
        return []
    random, top, found = np.random.default_rng(_SEED), system.topology, []
    dtype = jnp.result_type(float)
    psi, u = (random.normal(size=(_NUM_STATES, n)).astype(dtype) for n in (top.num_coordinates, top.num_velocities))
    t = np.linspace(0.0, 1.0, _NUM_STATES).astype(dtype)
    for row in rows:
        tried = _RowSamples(*map(np.asarray, _sample_row(row.law, row.coordinates, top, psi, u, t)))
        found += _velocity_faults(row, tried) if row.law.is_nonholonomic else _position_faults(row, tried)
    return found


@jit(compile="tape")
def _sample_row(law, coordinates, top, psi, u, t):
    def value(psi, t):
        q = psi[np.array(coordinates)] if coordinates else psi
        return law.value(jnp.zeros((0, 3, 3)), jnp.zeros((0, 3)), q, t)

    def at(psi, u, t):
        if law.is_nonholonomic:
            rest, slope = jax.jvp(lambda u: law.slip(psi, u, t), (jnp.zeros_like(u),), (u,))
            return _RowSamples(law.slip(psi, u, t), rest, slope, jnp.zeros_like(slope))
        along = jax.jvp(lambda psi: value(psi, t), (psi,), (coordinate_rate(top, psi, u),))[1]
        return _RowSamples(*3 * (jnp.zeros(0),), along)

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
