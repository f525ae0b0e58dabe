"""Closing the loops: coordinates and velocities that satisfy every constraint row, with exact derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math._linalg import saddle_solve
from ..model._system import System
from ..runtime import jit
from . import _constraints as constraints
from ._configuration import configuration
from ._levenberg_marquardt import minimise_in_trace
from ._poses import coordinate_rate, node_parameters, normalise, step_coordinates


def metric(system: System):
    """Diagonal weights (nv,) that make lengths and angles comparable: 1 for turning, 1/L^2 for sliding columns."""
    spins = np.asarray(system.topology.spins)
    return spins + (1.0 - spins) / lax.stop_gradient(system.length) ** 2


def metric_matrix(system: System):
    """`metric` as a matrix (nv, nv)."""
    return metric(system)[:, None] * np.eye(system.topology.num_velocities)


def linearise_rows(system: System, P, psi, t, free):
    """Residual of the positions (rows,) and its Jacobian (rows, nv) in the free columns."""
    at = configuration(system, P, psi, t, inertias=False)
    f, A = constraints.residual_and_jacobian(system, at)
    return f, A[system.topology.position_rows] * free[None, :]


def newton_step(system: System, P, psi, t, free):
    """One step of least size in `metric` towards closed loops, and the largest residual before it.

    Columns with free (nv,) = 0 stay.
    """
    f, A = linearise_rows(system, P, psi, t, free)
    delta = _least_norm_step(system, A, -f)
    return step_coordinates(system.topology, psi, delta), jnp.max(jnp.abs(f), initial=0.0)


def _least_norm_step(system, A, gap):
    """The step (nv,) of least size in `metric` with `A step = gap` (rows of positions,)."""
    rows = jax.tree.map(lambda x: x[system.topology.position_rows], constraints.row_scale(system))
    return saddle_solve(metric_matrix(system), A, jnp.zeros(A.shape[1], A.dtype), gap, rows)[0]


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
    return minimise_in_trace(
        lambda psi: linearise_rows(system, P, psi, t, free),
        lambda psi, delta: step_coordinates(system.topology, psi, delta),
        psi,
        metric_matrix(system),
        len(system.topology.position_rows),
    )


@_closed_coordinates.def_jvp
def _closed_coordinates_jvp(primals, tangents):
    """Derivative rule: the least-norm step that closes the perturbed rows again is added to the tangent of psi."""
    system, _, _, _, free, _ = primals
    found = _closed_coordinates(*primals)
    at = (system, primals[1], found, primals[3])

    def rows(system, P, psi, t):
        return linearise_rows(system, P, psi, t, free)

    (_, A), (f_dot, _) = eqx.filter_jvp(rows, at, tangents[:4])
    psi_dot = jnp.zeros_like(found) if tangents[2] is None else tangents[2]
    if f_dot is None:  # nothing that moves the rows is differentiated
        return found, psi_dot
    step = _least_norm_step(system, A, -f_dot)
    return found, psi_dot + coordinate_rate(system.topology, found, step)


def consistent_velocities(system: System, P, psi, u, t, free):
    """Velocities of least change from u (nv,) that satisfy the rows; columns with free = 0 are held."""
    if not system.has_constraints:
        return u
    at = configuration(system, P, psi, t, inertias=False)
    A, f_t = constraints.jacobian(system, at), constraints.time_rate(system, at)
    return _nearest_velocities(system, A, f_t, u, free)


def _nearest_velocities(system, A, f_t, u, free):
    """u with the least change that makes `A u = -f_t`."""
    rows, still = constraints.row_scale(system), jnp.zeros_like(u)
    return u + saddle_solve(metric_matrix(system), A * free[None, :], still, -f_t - A @ u, rows)[0]


@jit(compile="quick")
def assemble_in_trace(system: System, psi, u, t, free_position, free_velocity, search: bool = True):
    """(coordinates, velocities, position residual, velocity residual, rows) from guesses; see `State.at`."""
    P = node_parameters(system)
    psi = assemble_coordinates(system, P, psi, t, free_position, search)
    at = configuration(system, P, psi, t, inertias=False)
    (f, A), f_t = constraints.residual_and_jacobian(system, at), constraints.time_rate(system, at)
    if system.has_constraints:
        u = _nearest_velocities(system, A, f_t, u, free_velocity)
    return psi, u, f, A @ u + f_t, lax.stop_gradient(A)
