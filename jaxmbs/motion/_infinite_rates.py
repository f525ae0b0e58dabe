"""Names of the internal states whose rates are not finite where a motion failed; on the host, for its message."""

import dataclasses

import jax
import numpy as np

from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._internal_states import internal_rates
from ..kinematics._poses import step_coordinates
from ..kinematics._state import State
from ..model._internal_states import with_internal
from ..model._system import System
from ..runtime import jit

_AHEAD = (0.0, 0.01, 0.1, 1.0, 3.0, 10.0)  # of the mean step: the last state is finite, the step after it is not


def describe_infinite_rates(system: System, end: State, step: float) -> str:
    """ "; rates of internal states that are not finite by t = ... s: names", of the motion that goes on from its end at
    its velocities and rates for up to ten mean steps [s]; empty where all are finite, or nothing of the end is."""
    if not np.isfinite(np.asarray(end.coordinates)).all() or not np.isfinite(np.asarray(end.velocities)).all():
        return ""
    times = float(end.t) + step * np.array(_AHEAD)
    rates = np.asarray(_rates_ahead(system, end, step * np.array(_AHEAD)))
    for t, bad in zip(times, ~np.isfinite(rates), strict=True):
        if bad.any():
            names = dict.fromkeys(end.internal.entries[k] for k in np.flatnonzero(bad))
            return f"; rates of internal states that are not finite by t = {t:.4g} s: {', '.join(names)}"
    return ""


@jit(compile="quick")
def _rates_ahead(system, end, ahead):
    now = _rates(system, end)

    def at(h):
        internal = dataclasses.replace(end.internal, values=end.internal.values + h * now)
        psi = step_coordinates(system.topology, end.coordinates, h * end.velocities)
        return _rates(system, dataclasses.replace(end, t=end.t + h, coordinates=psi, internal=internal))

    return jax.vmap(at)(ahead)


def _rates(system, state):
    system = with_internal(system, state.internal)
    return internal_rates(system, with_velocities(system, at_state(system, state, inertias=False), state.velocities))
