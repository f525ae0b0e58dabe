"""Accounts of a motion: energies, work, residuals of the saved states, and the result code."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp

from ..dynamics._efforts import element_names
from ..dynamics._energy import energies
from ..flexible._stiffening import squared_spins, stiffening_errors
from ..kinematics import _constraints as constraints
from ..kinematics._configuration import Configuration, VelocityKinematics
from ..kinematics._state import State
from ..math._nan import nan_slope_where, nan_where
from ..status import Status, succeeded
from ._formulation import is_rheonomic
from ._motion import Diagnostics

CLOSED = 1e-6  # largest residual of constraints that count as met
_OFF = 0.1  # energy that is missing, of all that was exchanged
_ROUNDING = 1e-6  # and of the largest energy there is: a system at rest exchanges none
_CODES = {
    "successful": Status.SUCCESS,
    "event_occurred": Status.EVENT,
    "max_steps_reached": Status.MAX_STEPS,
    "dt_min_reached": Status.STEP_SIZE,
    "nonfinite_input": Status.NOT_FINITE,
}


def gap(system, at: Configuration):
    """Largest residual () of the positions."""
    if not system.has_constraints:
        return jnp.zeros_like(at.t)
    return jnp.max(jnp.abs(constraints.residual(system, at)), initial=0.0)


def observe(system, at: VelocityKinematics):
    """(kinetic, potential energy, largest position residual, largest velocity residual, squared speeds of rotation of
    elastic bodies)."""
    kinetic, potential = energies(system, at)
    spins = squared_spins(system, at)
    if not system.has_constraints:
        return kinetic, potential, gap(system, at), jnp.zeros_like(at.t), spins
    f, A = constraints.residual_and_jacobian(system, at)
    speed = A @ at.u + constraints.time_rate(system, at)
    return kinetic, potential, jnp.max(jnp.abs(f), initial=0.0), jnp.max(jnp.abs(speed)), spins


def diagnose(system, observed, work, walk) -> Diagnostics:
    """Diagnostics from what was observed at the start and at the saved times (1 + T,), the work account (T, n)
    and the walk."""
    kinetic, potential, drift, speed, spins = observed
    total = kinetic + potential
    names = element_names(system) + (("drives",) if is_rheonomic(system) else ())
    return Diagnostics(
        kinetic=kinetic[1:],
        potential=potential[1:],
        work={name: work[:, i] for i, name in enumerate(names)},
        energy_residual=total[1:] - total[0] - jnp.sum(work, axis=1),
        constraint_drift=drift[1:],
        velocity_drift=speed[1:],
        num_steps=walk.tried.astype(int),
        num_rejected=walk.rejected.astype(int),
        stiffening={name: x[1:] for name, x in stiffening_errors(system, spins).items()},
    )


def result_code(result, states, diagnostics, observed, ended, open_at_start, ts):
    """Result code (): the integrator's, overruled by states or times asked for (T,) that are not finite, states that
    break the constraints or the energy account; and which of the saved times are lost: all from the first bad one."""
    code = jnp.asarray(Status.FAILED)
    for name, value in _CODES.items():
        code = jnp.where(result == getattr(diffrax.RESULTS, name), value, code)
    finite = jnp.all(jnp.isfinite(states.coordinates), axis=1) & jnp.all(jnp.isfinite(states.velocities), axis=1)
    speed = 1.0 + jnp.max(jnp.abs(_counted(states.velocities)), initial=0.0)
    drift, velocity_drift = (_counted(x) for x in (diagnostics.constraint_drift, diagnostics.velocity_drift))
    broken = (drift > CLOSED) | (velocity_drift > CLOSED * speed)
    code = jnp.where(succeeded(code) & jnp.any(broken & ~ended), Status.INCONSISTENT, code)
    code = jnp.where(succeeded(code) & _is_off(diagnostics, observed, ended), Status.ENERGY, code)
    code = jnp.where(jnp.any(~finite & ~ended) | ~jnp.all(jnp.isfinite(ts)), Status.NOT_FINITE, code)
    code = jnp.where(open_at_start <= CLOSED, code, Status.NOT_ASSEMBLED)
    bad = ended | broken | ~finite | (code == Status.NOT_ASSEMBLED)
    return code, (jnp.cumsum(bad) > 0) & ~succeeded(code) & (code != Status.ENERGY)


def _counted(x):
    """x with zero for what is not a number."""
    return jnp.where(jnp.isnan(x), 0.0, x)


def _is_off(diagnostics, observed, ended):
    """Whether energy is missing: more than a tenth of what was exchanged, and more than rounding."""
    kinetic, potential = (_counted(x) for x in observed[:2])
    work = sum((jnp.abs(_counted(w)) for w in diagnostics.work.values()), jnp.zeros_like(kinetic[1:]))
    exchanged = jnp.max(kinetic) + jnp.max(jnp.abs(potential - potential[0])) + jnp.max(work, initial=0.0)
    largest = jnp.max(kinetic) + jnp.max(jnp.abs(potential))
    missing = jnp.where(ended, 0.0, jnp.abs(_counted(diagnostics.energy_residual)))
    return jnp.max(missing, initial=0.0) > _OFF * exchanged + _ROUNDING * largest


def mask_failed(ended, lost, kept, states, diagnostics, end):
    """States and accounts (T, ...) with NaN at the times after an end and at those that are lost, which have no
    derivative; nor has the end () unless it is `kept`."""

    def spoil(x):
        return nan_where(lost, masked(ended & ~lost, x, jnp.nan))

    def at(state, change):
        parts = change(state.coordinates), change(state.velocities)
        return State(state.t, *parts, state.residual, state.structure)

    accounts = (diagnostics.kinetic, diagnostics.potential, diagnostics.work, diagnostics.energy_residual)
    spoiled = jax.tree.map(spoil, accounts)
    places = lambda d: (d.kinetic, d.potential, d.work, d.energy_residual)  # noqa: E731
    end = at(end, lambda x: nan_slope_where(~kept, x))
    return at(states, spoil), eqx.tree_at(places, diagnostics, spoiled), end


def masked(mask, x, value):
    """x with the entries of its first axis where `mask` holds replaced by `value`."""
    mask = mask.reshape(mask.shape + (1,) * (x.ndim - 1))
    return jnp.where(mask, jnp.broadcast_to(jnp.asarray(value, x.dtype), x.shape), x)
