"""Accounts of a motion: energies, work, residuals of the saved states, and the result code."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..assembly._state import State
from ..constraints import _constraints as constraints
from ..constraints._rows import is_rheonomic
from ..dynamics._efforts import element_names
from ..dynamics._energy import energies
from ..flexible._stiffening import squared_spins, stiffening_errors
from ..kinematics._configuration import Configuration, VelocityKinematics
from ..math._nan import masked, nan_slope_where, nan_where
from ..named_arrays import NamedRows
from ..status import Status, succeeded
from ._diagnostics import Diagnostics

#: Largest residual [m, rad] of constraints that count as satisfied: a thousand times the default tolerance of a step,
#: a thousandth of what a drawing's tolerance is in a mechanism of a metre.
CLOSED = 1e-6
#: Missing energy that fails a motion, of all that was exchanged: a motion that loses a tenth of its energy without a
#: damper answers another question; one at coarse tolerances loses a hundredth.
_MISSING_ENERGY = 0.1
#: and of the largest energy there is, as a system at rest exchanges none.
_ENERGY_ROUNDING = 1e-6


def gap(system, at: Configuration):
    """Largest residual () of the positions."""
    if not system.has_constraints:
        return jnp.zeros_like(at.t)
    return jnp.max(jnp.abs(constraints.residual(system, at)), initial=0.0)


def observe(system, at: VelocityKinematics, ends: list | None = None, others: Array | None = None):
    """(kinetic, potential energy, largest position residual, largest velocity residual, squared speeds of rotation of
    elastic bodies), and the largest residual of other velocities (nv,) if there are some."""
    kinetic, potential = energies(system, at, ends)
    spins = squared_spins(system, at)
    if not system.has_constraints:
        return kinetic, potential, gap(system, at), jnp.zeros_like(at.t), spins
    f, A = constraints.residual_and_jacobian(system, at)
    rate = constraints.time_rate(system, at)
    largest = lambda u: jnp.max(jnp.abs(A @ u + rate))
    more = () if others is None else (largest(others),)
    return kinetic, potential, jnp.max(jnp.abs(f), initial=0.0), largest(at.u), spins, *more


def diagnose(system, observed, work, final, events: tuple[str, ...] = ()) -> Diagnostics:
    """Diagnostics from what was observed at the start and at the saved times (1 + T,), the work account (T, n)
    and the loop after its last step.

    Args: events: names of those that act, whose energy follows the other work.
    """
    kinetic, potential, drift, speed, spins = observed
    total = kinetic + potential
    names = element_names(system) + (("drives",) if is_rheonomic(system) else ()) + events
    return Diagnostics(
        kinetic=kinetic[1:],
        potential=potential[1:],
        work=NamedRows.of([(names, work)] if names else [], leading=1),
        energy_residual=total[1:] - total[0] - jnp.sum(work, axis=1),
        constraint_drift=drift[1:],
        velocity_drift=speed[1:],
        num_steps=final.tried.astype(int),
        num_rejected=final.rejected.astype(int),
        stiffening={name: x[1:] for name, x in stiffening_errors(system, spins).items()},
    )


def result_code(code, states, diagnostics, observed, ended, open_at_start, ts):
    """Result code (): that of the end, overruled by states or times asked for (T,) that are not finite, states that
    break the constraints or the energy account; and which of the saved times are lost: all from the first bad one."""
    finite = jnp.all(jnp.isfinite(states.coordinates), axis=1) & jnp.all(jnp.isfinite(states.velocities), axis=1)
    if states.internal is not None:
        finite = finite & states.internal.ok
    speed = 1.0 + jnp.max(jnp.abs(_zero_for_nan(states.velocities)), initial=0.0)
    drift, velocity_drift = (_zero_for_nan(x) for x in (diagnostics.constraint_drift, diagnostics.velocity_drift))
    broken = (drift > CLOSED) | (velocity_drift > CLOSED * speed)
    code = jnp.where(succeeded(code) & jnp.any(broken & ~ended), Status.INCONSISTENT, code)
    code = jnp.where(succeeded(code) & _is_energy_missing(diagnostics, observed, ended), Status.ENERGY, code)
    code = jnp.where(jnp.any(~finite & ~ended) | ~jnp.all(jnp.isfinite(ts)), Status.NOT_FINITE, code)
    code = jnp.where(open_at_start <= CLOSED, code, Status.NOT_ASSEMBLED)
    bad = ended | broken | ~finite | (code == Status.NOT_ASSEMBLED)
    return code, (jnp.cumsum(bad) > 0) & ~succeeded(code) & (code != Status.ENERGY)


def _zero_for_nan(x):
    """x with zeros in place of NaN."""
    return jnp.where(jnp.isnan(x), 0.0, x)


def _is_energy_missing(diagnostics, observed, ended):
    """True () if energy is missing: more than a tenth of what was exchanged, and more than rounding."""
    kinetic, potential = (_zero_for_nan(x) for x in observed[:2])
    done = (jnp.sum(jnp.abs(_zero_for_nan(w)), axis=1) for w in diagnostics.work.groups)
    work = sum(done, jnp.zeros_like(kinetic[1:]))
    exchanged = jnp.max(kinetic) + jnp.max(jnp.abs(potential - potential[0])) + jnp.max(work, initial=0.0)
    largest = jnp.max(kinetic) + jnp.max(jnp.abs(potential))
    missing = jnp.where(ended, 0.0, jnp.abs(_zero_for_nan(diagnostics.energy_residual)))
    return jnp.max(missing, initial=0.0) > _MISSING_ENERGY * exchanged + _ENERGY_ROUNDING * largest


def mask_failed(ended, lost, kept, states, diagnostics, end):
    """States and accounts (T, ...) with NaN at the times after an end and at those that are lost, which have no
    derivative; nor has the end () unless it is `kept`."""

    def with_nan(x):
        return nan_where(lost, masked(ended & ~lost, x, jnp.nan))

    def at(state, change):
        parts = change(state.coordinates), change(state.velocities)
        internal, changes = jax.tree.map(change, (state.internal, state.changes))
        return State(state.t, *parts, state.residual, state.structure, internal=internal, changes=changes)

    accounts = (diagnostics.kinetic, diagnostics.potential, diagnostics.work, diagnostics.energy_residual)
    changed = jax.tree.map(with_nan, accounts)
    places = lambda d: (d.kinetic, d.potential, d.work, d.energy_residual)
    end = at(end, lambda x: nan_slope_where(~kept, x))
    return at(states, with_nan), eqx.tree_at(places, diagnostics, changed), end
