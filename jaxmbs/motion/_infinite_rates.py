"""Names of the internal states whose rates are not finite where a motion failed; on the host, for its message."""

import dataclasses

import jax
import numpy as np

from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._poses import step_coordinates
from ..model._changes import with_changes
from ..model._system import System
from ..runtime import jit
from ..signal_flow._internal_states import internal_rates
from ._motion import Motion

_NUM_AHEAD = 16  # places between the last state that is known and the end
_BEYOND = 10.0  # mean steps after the end: the steps that failed began there and were longer or shorter


def describe_infinite_rates(system: System, motion: Motion, step: float) -> str:
    """Words for a failed motion that goes on from its last finite state at its velocities and rates: the internal
    states whose rates are then not finite, and by when; empty where all are finite.

    Args: step: mean step of the motion [s].
    """
    rows = [_row(motion.states, k) for k in range(len(motion.ts))] + [motion.end]
    known = [row for row in rows if _is_finite(row)]
    if not known or not np.isfinite(motion.end.t):
        return ""
    last = known[-1]
    ahead = np.linspace(0.0, float(motion.end.t) - float(last.t) + _BEYOND * step, _NUM_AHEAD)
    rates = np.asarray(_rates_ahead(system, last, ahead))
    for t, bad in zip(float(last.t) + ahead, ~np.isfinite(rates), strict=True):
        if bad.any():
            names = dict.fromkeys(last.internal.entries[k] for k in np.flatnonzero(bad))
            return f"; rates of internal states that are not finite by t = {t:.4g} s: {', '.join(names)}"
    return ""


def _row(states, k):
    return jax.tree.map(lambda x: np.asarray(x)[k], states)


def _is_finite(state):
    return all(np.isfinite(np.asarray(x)).all() for x in jax.tree.leaves(state))


@jit(compile="tape")
def _rates_ahead(system, last, ahead):
    now = _rates(system, last)

    def at(h):
        internal = dataclasses.replace(last.internal, values=last.internal.values + h * now)
        psi = step_coordinates(system.topology, last.coordinates, h * last.velocities)
        return _rates(system, dataclasses.replace(last, t=last.t + h, coordinates=psi, internal=internal))

    return jax.vmap(at)(ahead)


def _rates(system, state):
    system = with_changes(system, state)
    return internal_rates(system, with_velocities(system, at_state(system, state, inertias=False), state.velocities))
