"""Systems without freedom: evaluated at given times from the constraints alone, not integrated."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..kinematics import constraints
from ..kinematics.assembly import assemble, metric
from ..kinematics.poses import coordinate_rate, node_parameters
from ..kinematics.state import State
from ..math.linalg import saddle_solve
from .account import diagnose, observe, result_code, with_start
from .formulation import Problem
from .motion import Motion

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


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


@eqx.filter_jit
def prescribed_motion(system, start: State, ts) -> Motion:
    """The motion at the times ts (T,); the work account by Gauss quadrature between them (four points each)."""
    P = node_parameters(system)
    before = jnp.concatenate([start.t[None], ts[:-1]])
    half = (ts - before) / 2.0
    inner = (before + half)[:, None] + half[:, None] * jnp.asarray(_NODES, ts.dtype)[None]
    times = jnp.concatenate([inner, ts[:, None]], axis=1)
    states = prescribed_states(system, P, start, times.reshape(-1))
    states = jax.tree.map(lambda x: x.reshape(times.shape + x.shape[1:]), states)
    saved, between = jax.tree.map(lambda x: x[:, -1], states), jax.tree.map(lambda x: x[:, :-1], states)
    problem = Problem(system, P, jnp.ones_like(start.velocities), "velocity")
    power = jax.vmap(jax.vmap(lambda s: problem.rate(s.t, (s.coordinates, s.velocities, None))[2]))(between)
    work = jnp.cumsum(half[:, None] * jnp.einsum("k,tkn->tn", jnp.asarray(_WEIGHTS, ts.dtype), power), axis=0)
    observed = jax.vmap(lambda s: observe(system, P, s.coordinates, s.velocities, s.t))(with_start(start, saved))
    diagnostics = diagnose(system, observed, work, {})
    ended = jnp.zeros(ts.shape, bool)
    code = result_code(diffrax.RESULTS.successful, saved, diagnostics, ended, observed[2][0])
    return Motion(ts, saved, code, diagnostics)
