"""Closing the loops: coordinates and velocities that satisfy every constraint row, with exact derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math.jit import jit
from ..math.linalg import saddle_solve
from ..math.spd import spd_inverse
from ..model.system import System
from . import constraints
from .poses import coordinate_rate, geometry, node_parameters, normalise, step_coordinates

_ITERATIONS = 100


def metric(system: System):
    """Diagonal weights (nv,) that make lengths and angles comparable: 1 for turning, 1/L^2 for sliding columns."""
    spins = np.asarray(system.topology.spins)
    return spins + (1.0 - spins) / lax.stop_gradient(system.length) ** 2


def _linearised(system, P, psi, t, free):
    """Residual of the positions and its Jacobian in the free columns."""
    geo = geometry(system, P, psi)
    A = constraints.jacobian_at(system, geo, psi, t)[system.topology.position_rows]
    return constraints.residual_at(system, geo, psi, t), A * free[None, :]


def newton_step(system: System, P, psi, t, free):
    """One step of least size in `metric` towards closed loops, and the largest residual before it.

    Columns with free (nv,) = 0 stay.
    """
    f, A = _linearised(system, P, psi, t, free)
    delta = _least_step(system, A, -f)
    return step_coordinates(system.topology, psi, delta), jnp.max(jnp.abs(f), initial=0.0)


def _least_step(system, A, gap):
    """The step (nv,) of least size in `metric` with `A step = gap` (rows of positions,)."""
    rows = jax.tree.map(lambda x: x[system.topology.position_rows], constraints.row_scale(system))
    weight = metric(system)
    return saddle_solve(jnp.diag(weight), A, jnp.zeros_like(weight), gap, rows)[0]


def _levenberg_marquardt(system, P, psi, t, free):
    """Coordinates near psi with the least residual; robust far from a solution, no derivative passes."""
    top, weight = system.topology, metric(system)

    def cost(psi):
        f = constraints.residual(system, P, psi, t)
        return jnp.dot(f, f)

    def step(carry):
        k, psi, value, damping = carry
        f, A = _linearised(system, P, psi, t, free)
        normal = A.T @ A + damping * jnp.diag(weight)
        delta = -(spd_inverse(normal) @ (A.T @ f))
        trial = step_coordinates(top, psi, delta)
        new = cost(trial)
        better = new < value
        stuck = better & (value - new < 1e-6 * value)  # at the bottom, and open: what cannot close ends here
        psi = jnp.where(better, trial, psi)
        value = jnp.where(better, new, value)
        damping = jnp.clip(damping * jnp.where(better, 0.1, 10.0), 1e-12, 1e8)
        return k + 1, psi, value, jnp.where(stuck, 1e8, damping)

    def running(carry):
        k, _, value, damping = carry
        return (k < _ITERATIONS) & (value > 1e-20) & (damping < 1e7)

    start = (0, psi, cost(psi), jnp.asarray(1e-3, psi.dtype))
    return lax.while_loop(running, step, start)[1]


def assemble(system: System, P, psi, t, free):
    """Coordinates (nq,) on the constraint manifold near psi; columns with free (nv,) = 0 are held.

    First and second derivatives with respect to parameters, held coordinates and time are exact.
    """
    if not system.has_constraints:
        return psi
    return normalise(system.topology, _closed(system, P, psi, t, free))


@eqx.filter_custom_jvp
def _closed(system, P, psi, t, free):
    found = _levenberg_marquardt(system, P, psi, t, free)
    return lax.scan(lambda q, _: newton_step(system, P, q, t, free), found, length=3)[0]


@_closed.def_jvp
def _closed_jvp(primals, tangents):
    """Where psi and all else move the rows, the least step that closes them again is added to the motion of psi."""
    system, _, _, _, free = primals
    found = _closed(*primals)
    at = (system, primals[1], found, primals[3])

    def rows(system, P, psi, t):
        return _linearised(system, P, psi, t, free)

    (_, A), (f_dot, _) = eqx.filter_jvp(rows, at, tangents[:4])
    step = _least_step(system, A, -f_dot)
    psi_dot = jnp.zeros_like(found) if tangents[2] is None else tangents[2]
    return found, psi_dot + coordinate_rate(system.topology, found, step)


def consistent_velocities(system: System, P, psi, u, t, free):
    """Velocities of least change from u (nv,) that satisfy the rows; columns with free = 0 are held."""
    if not system.has_constraints:
        return u
    A = constraints.jacobian(system, P, psi, t)
    gap = -constraints.time_rate(system, psi, t) - A @ u
    delta, _ = saddle_solve(
        jnp.diag(metric(system)), A * free[None, :], jnp.zeros_like(u), gap, constraints.row_scale(system)
    )
    return u + delta


@jit(compile="quick")
def assembled(system: System, psi, u, t, free_position, free_velocity):
    """(coordinates, velocities, position residual, velocity residual) from guesses; see `State.at`."""
    P = node_parameters(system)
    psi = assemble(system, P, psi, t, free_position)
    u = consistent_velocities(system, P, psi, u, t, free_velocity)
    geo = geometry(system, P, psi)
    f = constraints.residual_at(system, geo, psi, t)
    g = constraints.jacobian_at(system, geo, psi, t) @ u + constraints.time_rate(system, psi, t)
    return psi, u, f, g
