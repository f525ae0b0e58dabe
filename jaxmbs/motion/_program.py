"""The program of a motion: a formulation integrated with projection, and the result of its rows."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix
from jax import Array, lax

from ..assembly._state import State
from ..constraints import _closures as closures
from ..dynamics._corners import has_corners
from ..kinematics._configuration import at_state
from ..model._changes import Changes
from ..model._internal_states import replace_field
from ..model._system import System
from ..ode._integrate import Arguments, attach_time_derivative, integrate_equations
from ..ode._loop import stop_gradients
from ..ode._options import Options
from ..ode._save_times import valid_times
from ..signal_flow._sampling import sample_periods
from ._accounts import CLOSED, gap
from ._event import Actions
from ._formulation import Formulation, num_powers
from ._formulations import Velocity
from ._hybrid import HybridEquations
from ._motion import Motion
from ._result import motion_of
from ._saved_step import SavedStep, with_internal_values, with_saved_steps


def integrate(
    system: System,
    state: State,
    ts: Array,
    t1: Array,
    formulation: type[Formulation],
    events: Any,
    options: Options,
    samples_start: Array | None = None,
) -> Motion:
    """The motion from a state to t1, saved at `ts`.

    Args:
        events: of `as_events`; samples_start: time of the first sample of a motion of which this is a later part.
    """
    at = at_state(system, state)
    if system.rows:  # slopes and residuals of the same rows
        at = closures.residual_and_directions(system, at)[1]
    equations, p0 = formulation.begin(system, at, state.velocities, state.internal)
    no_work = jnp.zeros(num_powers(system), p0.dtype)
    open_at_start = lax.stop_gradient(jnp.maximum(state.residual, gap(system, at)))
    ts, valid = valid_times(ts, state.t, t1)
    valid = valid & (open_at_start <= CLOSED) & jnp.all(jnp.isfinite(state.coordinates))
    valid = valid & jnp.all(jnp.isfinite(state.velocities))
    if state.internal is not None:
        valid = valid & state.internal.ok
    names = () if events is None else events[1].names
    places = _changed_places(system, state, events)
    if events is not None:
        equations, events = _with_events(equations, events, _state_of(system, state, places), places)
        no_work = jnp.zeros(equations.size, p0.dtype) if any(events.acts) else no_work
    args = Arguments(equations, events)
    problem, final, y0 = integrate_equations(
        args,
        (state.coordinates, p0, no_work),
        (state.t, ts, t1),
        valid,
        options,
        has_projection=system.has_constraints,
        saves_projection=system.has_constraints
        and formulation.keeps_momenta
        and options.lands_on_times
        and events is None
        and options.loop == "jaxmbs",
        projection_is_error=formulation.follows_rows,
        projects_error=equations.projects_error and options.dt is None,
        norm=optimistix.rms_norm if formulation.follows_rows else None,
        has_corners=has_corners(system),
        periods=sample_periods(system),
        samples_start=samples_start,
    )
    if problem.saves_projection:  # rows of velocities, which need no formulation to be read
        args, t0 = Arguments(Velocity(system, at.P, jnp.ones_like(p0))), stop_gradients(state.t)
        start = (state.coordinates, with_internal_values(state), no_work)
        y0 = attach_time_derivative(start, 2.0 * t0 - state.t, t0, args.equations)
        final = with_saved_steps(final, SavedStep(*y0), problem.times <= t0, final.t > t0)
    return motion_of(args, state, y0, final, (ts, t1), open_at_start, options.lands_on_times, names, places)


def _changed_places(system, state, events):
    """Places of the leaves of the system that events change, or have changed before the start."""
    numbers, structure = jax.tree.flatten(system)
    others = [] if events is None else [other for other in events[1].systems if other is not None]
    found = set() if state.changes is None else set(state.changes.places)
    for other in others:
        leaves = structure.flatten_up_to(other)
        found |= {k for k, x in enumerate(leaves) if x is not None and eqx.is_inexact_array(numbers[k])}
    return tuple(sorted(found))


def _with_events(equations, events, state, places):
    """The equations with the actions, and the events; arrays that their functions close over are arguments."""
    if places and not any(events[0].acts):
        asked = tuple(_WithChanges(f, state.changes) for f in events[0].conditions)
        events, state = (
            (dataclasses.replace(events[0], conditions=asked), events[1]),
            replace_field(state, "changes", None),
        )
    events, actions = events[0].closed_over(state), events[1]
    if not any(events.acts):
        return equations, events
    converted = tuple(f if f is None else eqx.filter_closure_convert(f, state) for f in actions.actions)
    actions = Actions(converted, actions.systems, actions.names)
    return HybridEquations.of(equations, actions, events.max_actions, places), events


class _WithChanges(eqx.Module):
    """A condition as a function of a state whose changes do not change."""

    condition: Callable
    changes: Changes

    def __call__(self, state):
        return self.condition(replace_field(state, "changes", self.changes))


def _state_of(system, state, places):
    """The state as one of the system: one written by hand does not know the joints."""
    parts, changes = (state.t, state.coordinates, state.velocities), Changes.of(system, places)
    return State(*parts, structure=system.topology.structure, internal=state.internal, changes=changes)
