"""Arguments of `periodic`, checked, and the equations that they make."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..analysis._linearise import independent_positions
from ..assembly._state import State
from ..assembly._state_report import coordinate_names, velocity_names
from ..checks import any_concrete, count_faults, distinct_names, faults_if, is_concrete, no_such
from ..constraints import _constraints as constraints
from ..constraints._kic import independent_columns
from ..errors import ModelError
from ..kinematics._configuration import at_state
from ..model._entry_points import check_single_state, check_state
from ..model._system import System
from ..motion._event import acts
from ..motion._motion import Motion
from ..ode._options import GRADIENTS
from ..signal_flow._sampling import sample_periods
from ._flow import Flow
from ._shooting import Shooting, StartRows, numbers_of_state

_WHOLE = 1e-9  # part of a sample's period by which a segment may miss a whole number of them


def check_choices(period: Any, free: Any, gradient: Any, event: Any, counts: Mapping[str, tuple[Any, int]]) -> None:
    """Raises: ModelError for options that are none or contradict each other, all in one report.

    Args: counts: name -> (value, least one).
    """
    faults = [fault for name, (value, least) in counts.items() for fault in count_faults(name, value, least)]
    segments = counts["segments"][0]
    faults += faults_if(
        (free not in (None, "period"), f'free={free!r} must be "period" or None'),
        (period is None and free is None, 'give period= [s], or free="period" with a first guess of it as period='),
        (period is None and free == "period", 'free="period" needs a first guess: give period= as well'),
        (gradient not in GRADIENTS, f"gradient={gradient!r} must be one of {', '.join(GRADIENTS)}"),
        (event is not None and segments != 1, "a cycle with events has one segment: leave segments= out"),
    )
    faults += _event_faults(event)
    if period is not None:
        faults += _period_faults(period)
    if faults:
        raise ModelError(faults, "the cycle")


def _event_faults(event):
    events = event if isinstance(event, list | tuple) else [] if event is None else [event]
    ending = [getattr(one, "name", None) or f"event {k}" for k, one in enumerate(events) if not acts(one)]
    return [f"{name!r} ends the motion, and a cycle goes on: give it an action=" for name in ending]


def _period_faults(period):
    if np.ndim(period) or isinstance(period, str | bool) or jnp.iscomplexobj(period):
        return [f"period must be one number [s], got {period!r}"]
    if any_concrete(lambda T: ~np.isfinite(T) | (T <= 0), period):
        return [f"period must be positive and finite, got {period}"]
    return []


def first_state(system: System, start: State | Motion | None) -> State:
    """The state at which the search begins.  Raises: TypeError, ModelError, ValueError for what is none of one."""
    if start is None:
        return State.at(system)
    if not isinstance(start, Motion):
        check_single_state(system, start)
        return start
    check_state(system, start.states)
    if start.ts.ndim != 1:
        raise ValueError(f"start= takes one motion, use jax.vmap for many; its times have shape {start.ts.shape}")
    return start[0]


def check_samples(system: System, period: Array, segments: int, is_free: bool = False) -> None:
    """Raises: ModelError where a segment is no whole number of the periods of sampled blocks, or is free."""
    rhythms = sample_periods(system)
    if rhythms is None:
        return
    if is_free:
        raise ModelError(
            ["blocks are sampled: a period of the machine's own is no whole number of theirs"], "the cycle"
        )
    if not is_concrete(period, rhythms):
        return
    length = float(period) / segments
    share = length / np.asarray(rhythms)
    if np.any(np.abs(share - np.round(share)) > _WHOLE * np.maximum(share, 1.0)):
        each = ", ".join(f"{float(x):.6g} s" for x in np.asarray(rhythms))
        what = "a segment of the period" if segments > 1 else "the period"
        fault = f"blocks are sampled every {each}: {what}, {length:.6g} s, must be a whole number of those"
        raise ModelError([fault], "the cycle")


def make_shooting(
    system: System,
    begin: State,
    flow: Flow,
    turns: Any,
    held: Any,
    is_free: bool,
    segments: int,
) -> Shooting:
    """The equations of a cycle near a state.

    Args: turns, held: as of `periodic`, not checked yet.

    Raises: ModelError for unknown names, turns that are none.
    """
    top, dtype = system.topology, begin.coordinates.dtype
    gain, named = _gains(system, turns)
    winds = _closes_loops(system, begin) & ~named
    names = distinct_names("held", held)
    if is_free and not names and turns:
        names = (next(iter(turns)),)
    places = _places(system, begin, names)
    number = len(independent_positions(system)) + len(independent_columns(system)) + top.num_internal
    faults = faults_if(
        (bool(names) and not is_free, 'held= fixes the phase of a free period: give free="period" with it'),
        (is_free and number == 0, "nothing is free to move: the drives give the period, leave free= out"),
    )
    if faults:
        raise ModelError(faults, "the cycle")
    values = numbers_of_state(begin)[np.asarray(places, int)]
    fixed = StartRows(places, values, fixes_phase=is_free and not names)
    return Shooting(flow, begin.t, jnp.asarray(gain, dtype), jnp.asarray(winds), fixed, is_free, segments)


def _gains(system, turns):
    """Gains (nv,) of the coordinates over a cycle, and True for those that were named."""
    top, faults = system.topology, []
    gain, named = np.zeros(top.num_velocities), np.zeros(top.num_velocities, bool)
    for name, number in (turns or {}).items():
        if name not in top.joint_index:
            faults.append(f"turns: {no_such('joint', name, top.joint_names)}")
            continue
        joint = top.joints[top.joint_index[name]]
        column = joint.first_velocity if joint.num_velocities == 1 else None
        if column is None or not top.turns[column]:
            faults.append(f"turns: joint {name!r} has no one angle that turns")
            continue
        if isinstance(number, bool) or not isinstance(number, int | np.integer):
            faults.append(f"turns: of joint {name!r} they must be a whole number, not {number!r}")
            continue
        gain[column], named[column] = 2.0 * np.pi * number, True
    if faults:
        raise ModelError(faults, "the cycle")
    return gain, named


def _closes_loops(system, state):
    """True (nv,) for angles that some row depends on: of loops and of drives."""
    top = system.topology
    if not system.has_constraints:
        return np.zeros(top.num_velocities, bool)
    A = jax.lax.stop_gradient(constraints.jacobian(system, at_state(system, state, inertias=False)))
    return jnp.any(jnp.abs(A) > 0.0, axis=0) & np.asarray(top.turns > 0)


def _places(system, state, names):
    """Places of coordinates, velocities and internal states in the vector of all numbers of a state."""
    own = state_names(system, state)
    what = "coordinate, velocity or internal state"
    faults = [f"held: {no_such(what, name, own)}" for name in names if name not in own]
    if faults:
        raise ModelError(faults, "the cycle")
    return tuple(own.index(name) for name in names)


def state_names(system: System, state: State) -> list[str]:
    """Names of coordinates "pin", velocities "rate of pin" and internal states, as in one vector."""
    top = system.topology
    coordinates = coordinate_names(top.structure, top.num_coordinates)
    velocities = [f"rate of {name}" for name in velocity_names(top.structure, top.num_velocities)]
    return [*coordinates, *velocities, *(entry for record in top.internal for entry in record.entries)]
