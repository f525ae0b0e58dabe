"""Closing the loops: coordinates and velocities that satisfy every constraint row, with exact derivatives."""

import equinox as eqx
import jax.numpy as jnp
from jax import lax

from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._linear_rows import joints_first, linear_rows, rows_of_numbers
from ..constraints._rounding import residual_without_rounding
from ..constraints._saddle_operator import stop_gradients
from ..kinematics._configuration import configuration
from ..kinematics._poses import coordinate_rate, node_parameters, normalise, step_coordinates
from ..model._system import System
from ..runtime import jit
from ._levenberg_marquardt import CLOSED_RESIDUAL, minimise_in_trace


def linearise_rows(system: System, P, psi, t, free):
    """Residual of the positions (rows,), and its `linear_rows` in the free columns."""
    f, at = _at_pose(system, P, psi, t)
    return f, linear_rows(system, at, free, system.topology.position_rows)


def linearise_for_search(system: System, P, psi, t, free):
    """`linearise_rows`, the residual zero where it is rounding: no step follows from that."""
    f, at = _at_pose(system, P, psi, t)
    return residual_without_rounding(system, at, f), linear_rows(system, at, free, system.topology.position_rows)


def closing_step(system: System, P, psi, t, free):
    """One step of least size in `metric` towards closed loops, and the largest residual before it.

    Columns with free (nv,) = 0 stay.
    """
    f, rows = linearise_rows(system, P, psi, t, free)
    return step_coordinates(system.topology, psi, rows.least_step(-f)), jnp.max(jnp.abs(f), initial=0.0)


def assemble_coordinates(system: System, P, psi, t, free, search: bool = True):
    """Coordinates (nq,) on the constraint manifold near psi; columns with free (nv,) = 0 are held.

    Without a search psi is there already.  First and second derivatives with respect to parameters, held coordinates
    and time are exact.
    """
    if not system.has_constraints:
        return psi
    return normalise(system.topology, _closed_coordinates(system, P, psi, t, free, search))


@eqx.filter_custom_jvp
def _closed_coordinates(system, P, psi, t, free, search):
    if not search:
        return psi
    places = system.topology.position_rows

    def search(psi, free):
        return minimise_in_trace(
            lambda psi: _residual_and_numbers(system, P, psi, t, free),
            lambda numbers, f, damping: rows_of_numbers(system, numbers, free, places).damped_step(f, damping),
            lambda psi, delta: step_coordinates(system.topology, psi, delta),
            psi,
        )

    if not len(system.topology.deformations):
        return search(psi, free)[0]

    def search_again(carry, stage):
        psi, is_open = carry
        found, square = search(psi, jnp.where(is_open, stage, 0.0))
        return (found, square > CLOSED_RESIDUAL[psi.dtype.itemsize] ** 2), None

    return lax.scan(search_again, (psi, jnp.asarray(True)), jnp.stack(joints_first(system, free)))[0][0]


def _residual_and_numbers(system, P, psi, t, free):
    f, rows = linearise_for_search(system, P, psi, t, free)
    return f, rows.numbers


@_closed_coordinates.def_jvp
def _closed_coordinates_jvp(primals, tangents):
    """Derivative rule: the least-norm step that closes the perturbed rows again is added to the tangent of psi."""
    system, _, _, _, free, _ = primals
    found = _closed_coordinates(*primals)
    at = (system, primals[1], found, primals[3])

    def residual(system, P, psi, t):
        return constraints.residual(system, configuration(system, P, psi, t, inertias=False))

    f_dot = eqx.filter_jvp(residual, at, tangents[:4])[1]
    psi_dot = jnp.zeros_like(found) if tangents[2] is None else tangents[2]
    if f_dot is None:  # nothing that moves the rows is differentiated
        return found, psi_dot
    step = _least_step(lambda free: linearise_rows(*at, free)[1], system, free, -f_dot, fading=True)
    return found, psi_dot + coordinate_rate(system.topology, found, step)


def consistent_velocities(system: System, P, psi, u, t, free):
    """Velocities of least change from u (nv,) that satisfy the rows; columns with free = 0 are held."""
    if not system.has_constraints:
        return u
    return _nearest_velocities(system, _at_pose(system, P, psi, t)[1], u, free, fading=False)


def _at_pose(system, P, psi, t):
    """Residual (rows of position,) and the configuration with the directions of its closures."""
    parts, at = closures.residual_and_directions(system, configuration(system, P, psi, t, inertias=False))
    return constraints.rows_together(system, at, parts), at


def _nearest_velocities(system, at, u, free, fading):
    """u with the least change that makes `A u = -f_t`."""
    f_t = constraints.time_rate(system, at)
    every = linear_rows(system, at, jnp.ones_like(free))
    return u + _least_step(lambda free: linear_rows(system, at, free), system, free, -f_t - every.rates(u), fading)


def _least_step(rows_in, system, free, gap, fading):
    """The step (nv,) of least size that closes a gap (rows,), by the motions of joints where they can.

    Args: rows_in: the linear rows in free columns (nv,); fading: rows that nearly vanish are closed too, as where a
        held crank is near the edge of its reach.
    """
    first, *more = joints_first(system, free)
    if not more:
        return rows_in(first).least_step(gap, fading)
    every = rows_in(jnp.ones_like(free))

    def take(step, stage):
        return step + rows_in(stage).least_step(gap - every.rates(step), fading), None

    return lax.scan(take, jnp.zeros_like(free), jnp.stack([first, *more]))[0]


@jit(compile="tape")
def assemble_in_trace(system: System, psi, u, t, free_position, free_velocity, search: bool = True):
    """(coordinates, velocities, position residual, velocity residual, rows) from guesses; see `State.at`."""
    P = node_parameters(system)
    psi = assemble_coordinates(system, P, psi, t, free_position, search)
    f, at = _at_pose(system, P, psi, t)
    if system.has_constraints:
        u = _nearest_velocities(system, at, u, free_velocity, fading=True)
    rows = linear_rows(system, at, jnp.ones_like(u))
    return psi, u, f, rows.rates(u) + constraints.time_rate(system, at), stop_gradients(rows.numbers)
