"""`simulate` of mechanisms: a formulation integrated with projection, and the motion's accounts and result code."""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from jax import lax

from ..assembly._state import State
from ..checks import as_flag, is_concrete
from ..constraints import _closures as closures
from ..constraints._mobility import with_mobility_at
from ..dynamics._corners import has_corners
from ..errors import SimulationError
from ..flexible._stiffening import warn_of_stiffening
from ..kinematics._configuration import at_state
from ..model._changes import Changes, check_in_force, with_changes
from ..model._entry_points import check_single_state
from ..model._internal_states import replace_field
from ..model._system import System
from ..ode._integrate import Arguments, attach_time_derivative, integrate_equations
from ..ode._loop import stop_gradients
from ..ode._options import LOOPS, check_memory, check_options, make_options, solver_or_default
from ..ode._save_times import save_times, valid_times
from ..reports import Note
from ..runtime import as_host_array, jit, note, progress_bar
from ..signal_flow._sampling import refuse_sampled, sample_periods
from ..status import succeeded
from ..typing import ArrayLike, WordedError
from ._accounts import CLOSED, gap
from ._choice import Choice, choose_solver
from ._event import Actions, EventLike, as_events
from ._failure import explain
from ._formulation import Formulation, num_powers
from ._formulations import Independent, Prescribed, Velocity
from ._hybrid import HybridEquations
from ._jam import with_jam
from ._motion import Motion
from ._options import choose_formulation
from ._prescribed import check_prescribed, is_prescribed, with_freedoms_told
from ._result import motion_of
from ._sampling import Sampling
from ._saved_step import SavedStep, with_internal_values, with_saved_steps
from ._stiffest_mode import advise

#: Default absolute tolerance of a step by the size of a number [bytes], of coordinates and velocities [m, rad, s]:
#: they are near one, so it is that of the relative tolerance; in single precision a few ten roundings.
ATOL = {8: 1e-9, 4: 3e-6}


def simulate(
    system: System,
    state: State,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: Any = "reverse",
    formulation: str | type[Formulation] | None = None,
    event: WordedError[EventLike | Sequence[EventLike] | None] = None,
    interpolate: bool = False,
    loop: str = "jaxmbs",
    max_steps: int = 100_000,
    max_events: int = 64,
    progress: bool | None = None,
    throw: bool = True,
) -> Motion:
    """The motion that starts at a state.

    Args:
        t1: end time [s] (default: the last of `ts`).
        ts: times to save (T,), increasing, from state.t on (default: 101 equal steps to t1); they have derivatives.
        dt: fixed step [s]; without it steps adapt to rtol, atol.
        solver: a diffrax solver, `jaxmbs.ode.Rodas5P()` for stiff systems, or, at fixed steps, `Gauss4()` and
            `ImplicitMidpoint()` (long motions), `SemiImplicitEuler()`; `benchmarks/solvers.py` has the error of each
            against its time.  By default Rodas5P where dampers, elastic bodies or internal states make a motion that
            dies out so fast that it would bound the steps of an explicit solver all along, by the slopes at the
            start; else, within a trace and at fixed steps Dopri8.  `motion.solver` says which and why.
        controller: of diffrax for adaptive steps, in place of `diffrax.PIDController` with rtol and atol.
        rtol, atol: tolerances of each step in coordinates and velocities [m, rad, s], default 1e-9 (single precision:
            3e-4 and 3e-6).
        gradient: derivative mode of the motion, "reverse" or "forward"; second derivatives by `jax.jacfwd` of either.
        formulation: "canonical" (default), "independent", "velocity", "prescribed" (the default of systems without
            freedom, whose coordinates then follow their branch), or a custom `Formulation`; "velocity" is the default
            where joints rub.
        event: function of a State to one number whose zero crossing ends the motion, as does one that is not a number
            where smaller steps do not help; the state there is saved too, right after the
            times before it, so the motion has one entry more (unused entries: times inf, states nan).  Or a
            `jaxmbs.motion.Event`, which may act and let the motion go on; a `diffrax.Event` of real functions
            (t, y, args) of the State y; a list of several.  `motion.events` has their names and times.
        interpolate: let steps pass over saved times, whose states come from the solver's interpolation and are closed
            again, with an error of about ten times the tolerance.  By default steps land on them: a four-bar with 101
            saved times costs twice as much at 1e-9, five times at 1e-3, and is right to 5e-12 at either, which
            passing over does not reach at any tolerance (`benchmarks/saved_times.py`).  Motions without freedom are
            always interpolated, the constraints determine them.
        loop: "jaxmbs" (default), or "diffeqsolve": the same steps by `diffrax.diffeqsolve` with diffrax's adjoints;
            without events that act.
        max_steps: bound on the integrator's steps.
        max_events: bound on the actions of events; the one after it ends the motion with status EVENTS.
        progress: show a bar; by default after three seconds, in a terminal or a notebook, while a tape runs.
        throw: raise when the motion fails (outside of tracing); else look at `motion.status`.

    Returns: a Motion; saved states satisfy the constraints to rounding.  In a batch, a design that is not assembled
    or that fails takes no further steps.  The status JAMMED is found after the motion: within a trace a jam has the
    status of its steps, and `dynamics.joint_friction` of the end says whether it is one.

    Raises:
        ValueError: contradictory options.  TypeError: an event that is no function to one number, an action that
            returns no State.
        SimulationError: the motion failed; carries what was computed as `.motion`.
    """
    check_single_state(system, state)
    check_in_force(system, state)
    system, named = with_changes(system, state), solver_or_default(solver)
    system, chosen = _with_formulation(system, state, formulation, named, dt)
    events = as_events(event, system, state, max_events)
    check_options(named, controller, dt, rtol, atol, gradient, loop)
    _check_formulation(system, state, chosen, named, events, loop)
    ts = save_times(state.t, t1, ts)
    t1 = ts[-1] if t1 is None else as_host_array(t1)
    choice, landings = Choice(named), 0 if interpolate else ts.size
    if solver is None and dt is None and controller is None and loop == LOOPS[0]:
        choice = choose_solver(system, state, (state.t, t1), landings, rtol, chosen)
    given = {"dt": dt, "rtol": rtol, "gradient": gradient, "max_steps": max_steps, "loop": loop}
    options = _options(system, state, t1, chosen, events, landings, atol, progress)(
        choice.solver, controller, **given
    )
    advice = functools.partial(advise, system, state, choice.solver)
    with progress_bar("simulate", state.t, t1, progress, advice):
        motion = _integrate(system, state, ts, t1, chosen, events, options)
    motion = with_freedoms_told(system, state, motion) if chosen is Prescribed else motion
    if sample_periods(system) is not None:
        motion = replace_field(motion, "sampling", Sampling.of(state.t, options, chosen, _integrate))
    motion = dataclasses.replace(with_jam(system, motion), solver=Note(choice.in_words(options, chosen)))
    return _with_verdict(system, motion, state.t, throw, choice.solver)


def _options(system, state, t1, formulation, events, landings, atol, progress):
    """`make_options` with what the mechanism, its start and its events say."""
    return functools.partial(
        make_options,
        span=(state.t, t1),
        atol=ATOL[state.coordinates.dtype.itemsize] if atol is None else atol,
        lands_on_times=landings > 0 and not formulation.follows_rows,
        progress=progress is not None and as_flag("progress", progress),
        has_event=events is not None,
        max_actions=0 if events is None else events[0].max_actions,
        periods=sample_periods(system),
    )


def _with_formulation(system, state, formulation, solver, dt):
    """The system and the class of the formulation: the one asked for, or that of what the system has.

    Systems without freedom follow their rows.  Friction needs the accelerations, all that `Velocity` needs.
    """
    if formulation is None and is_prescribed(system, state):
        formulation = Prescribed
    elif formulation is None and system.friction is not None:
        formulation = Velocity
    if formulation in ("independent", Independent):
        system = with_mobility_at(system, state)
    return system, choose_formulation(formulation, solver, dt)


def _check_formulation(system, state, chosen, solver, events, loop):
    """Raises: ModelError, ValueError for a formulation, solver or loop that constraints, actions of events or sampled
    blocks do not go with."""
    if chosen is Prescribed:
        check_prescribed(system, state)
    if system.has_constraints:
        check_memory(solver, "the projection onto the constraints")
    if events is not None and any(events[0].acts):
        check_memory(solver, "the action of an event")
        _check_acting(chosen, loop)
    if sample_periods(system) is not None:
        _check_sampling(system, solver, loop)


def _with_verdict(system, motion, t0, throw, solver):
    """The motion.  Raises: SimulationError where it failed, if it shall throw; warns of stiffening."""
    note(lambda: motion.result)
    if throw and is_concrete(motion.result) and not np.all(succeeded(np.asarray(motion.result))):
        raise SimulationError(explain(system, motion, float(np.asarray(t0)), solver), motion)
    warn_of_stiffening(motion.diagnostics.stiffening)
    return motion


@jit
def _integrate(system, state, ts, t1, formulation, events, options, samples_start=None):
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


def _check_acting(formulation, loop):
    """Raises: ValueError for what cannot go on after the action of an event."""
    if formulation.follows_rows:
        raise ValueError(
            "an action changes velocities, and this mechanism has none that are free: its drives give all"
        )
    if loop != "jaxmbs":
        raise ValueError(f"loop={loop!r} has no events that act: diffrax's loop ends at an event; take loop='jaxmbs'")


def _check_sampling(system, solver, loop):
    """Raises: ValueError for a solver that samples would leave behind, ModelError for diffrax's loop."""
    check_memory(solver, "the sample of a block")
    if loop != "jaxmbs":
        refuse_sampled(system, f"loop={loop!r}")


def _state_of(system, state, places):
    """The state as one of the system: one written by hand does not know the joints."""
    parts, changes = (state.t, state.coordinates, state.velocities), Changes.of(system, places)
    return State(*parts, structure=system.topology.structure, internal=state.internal, changes=changes)
