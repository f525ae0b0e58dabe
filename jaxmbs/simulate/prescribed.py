"""Systems without freedom: positions, velocities at given times from the constraints alone."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from ..kinematics import constraints
from ..kinematics.assembly import assemble, metric
from ..kinematics.poses import coordinate_rate
from ..kinematics.state import State
from ..math.linalg import saddle_solve


def constrained_velocities(system, P, psi, t):
    """Velocities (nv,) that the rows prescribe, `A u = -f_t`."""
    A = constraints.jacobian(system, P, psi, t)
    b = -constraints.time_rate(system, psi, t)
    return saddle_solve(
        jnp.diag(metric(system)), A, jnp.zeros(A.shape[1], A.dtype), b, constraints.row_scale(system)
    )[0]


def prescribed_states(system, P, start: State, ts) -> State:
    """States (T, ...) of a wholly prescribed motion.

    A loose integration carries the coordinates from time to time on their branch; Newton's method then closes the
    rows to rounding at each time, with exact derivatives that never enter the integration.
    """
    fixed = jax.tree.map(lambda x: lax.stop_gradient(x) if eqx.is_inexact_array(x) else x, (system, P, start, ts))
    branch = _follow(*fixed)
    free = jnp.ones(system.topology.num_velocities, branch.dtype)

    def at(t, psi):
        psi = assemble(system, P, psi, t, free)
        return State(t, psi, constrained_velocities(system, P, psi, t))

    return jax.vmap(at)(ts, branch)


def _follow(system, P, start, ts):
    """Coordinates (T, nq) near the motion at each time."""

    def rate(t, psi, _):
        return coordinate_rate(system.topology, psi, constrained_velocities(system, P, psi, t))

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rate),
        diffrax.Tsit5(),
        start.t,
        ts[-1],
        None,
        start.coordinates,
        saveat=diffrax.SaveAt(ts=ts),
        stepsize_controller=diffrax.PIDController(rtol=1e-5, atol=1e-5),
        adjoint=diffrax.ForwardMode(),
        throw=False,
        max_steps=100_000,
    )
    return lax.stop_gradient(jnp.nan_to_num(solution.ys, posinf=0.0, neginf=0.0))
