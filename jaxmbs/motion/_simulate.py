"""`simulate` of mechanisms: its options, and the verdict on the motion."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..assembly._state import State
from ..checks import as_flag, is_concrete
from ..constraints._mobility import with_mobility_at
from ..errors import SimulationError
from ..flexible._stiffening import warn_of_stiffening
from ..model._changes import check_in_force, with_changes
from ..model._entry_points import check_single_state
from ..model._internal_states import replace_field
from ..model._system import System
from ..ode._options import LOOPS, check_options, make_options
from ..ode._save_times import save_times
from ..reports import Note
from ..runtime import as_host_array, jit, note, progress_bar
from ..signal_flow._sampling import refuse_sampled, sample_periods
from ..status import succeeded
from ..typing import ArrayLike, WordedError
from ._choice import Choice, choose_solver
from ._event import EventLike, as_events
from ._motion import Motion
from ._options import choose_formulation, class_of, follows_rows
from ._prescribed import check_prescribed, is_prescribed, with_freedoms_told
from ._sampling import Sampling

if TYPE_CHECKING:
    from ._formulation import Formulation

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
    formulation: "str | type[Formulation] | None" = None,
    event: WordedError[EventLike | Sequence[EventLike] | None] = None,
    interpolate: bool = False,
    loop: str = "jaxmbs",
    max_steps: int = 100_000,
    max_events: int = 64,
    longest_step: ArrayLike | None = None,
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
        longest_step: bound on adaptive steps [s], for pulses that a step may pass over, and derivatives of motions at
            rest, which tolerances do not see.
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
    system = with_changes(system, state)
    system, chosen = _with_formulation(system, state, formulation, solver, dt)
    events = as_events(event, system, state, max_events)
    check_options(solver, controller, dt, rtol, atol, gradient, loop, longest_step)
    _check_formulation(system, state, chosen, solver, events, loop)
    ts = save_times(state.t, t1, ts)
    t1 = ts[-1] if t1 is None else as_host_array(t1)
    choice, landings = Choice(solver), 0 if interpolate else ts.size
    if solver is None and dt is None and controller is None and loop == LOOPS[0]:
        choice = choose_solver(system, state, (state.t, t1), landings, rtol, chosen)
    given = {"dt": dt, "rtol": rtol, "gradient": gradient, "max_steps": max_steps, "loop": loop}
    options = _options(system, state, t1, chosen, events, landings, atol, progress)(
        choice.solver, controller, longest_step=longest_step, **given
    )
    advice = functools.partial(_advise, system, state, choice.solver)
    with progress_bar("simulate", state.t, t1, progress, advice):
        motion = _integrate(system, state, ts, t1, chosen, events, options)
    motion = with_freedoms_told(system, state, motion) if chosen == "prescribed" else motion
    if sample_periods(system) is not None:
        motion = replace_field(motion, "sampling", Sampling.of(state.t, options, chosen, _integrate))
    if system.friction is not None:
        from ._jam import with_jam

        motion = with_jam(system, motion)
    motion = dataclasses.replace(motion, solver=Note(choice.in_words(options, chosen)))
    return _with_verdict(system, motion, state.t, throw, choice.solver)


def _options(system, state, t1, formulation, events, landings, atol, progress):
    """`make_options` with what the mechanism, its start and its events say."""
    return functools.partial(
        make_options,
        span=(state.t, t1),
        atol=ATOL[state.coordinates.dtype.itemsize] if atol is None else atol,
        lands_on_times=landings > 0 and not follows_rows(formulation),
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
        formulation = "prescribed"
    elif formulation is None and system.friction is not None:
        formulation = "velocity"
    chosen = choose_formulation(formulation, solver, dt)
    return with_mobility_at(system, state) if chosen == "independent" else system, chosen


def _check_formulation(system, state, chosen, solver, events, loop):
    """Raises: ModelError, ValueError for a formulation, solver or loop that constraints, actions of events or sampled
    blocks do not go with."""
    if chosen == "prescribed":
        check_prescribed(system, state)
    acts, samples = events is not None and any(events[0].acts), sample_periods(system) is not None
    if acts:
        _check_acting(chosen, loop)
    if samples and loop != LOOPS[0]:
        refuse_sampled(system, f"loop={loop!r}")
    if solver is not None:
        from ..ode._named_solver import check_memory  # with all of diffrax

        moved = {
            "the projection onto the constraints": system.has_constraints,
            "the action of an event": acts,
            "the sample of a block": samples,
        }
        for why in (why for why, happens in moved.items() if happens):
            check_memory(solver, why)


def _with_verdict(system, motion, t0, throw, solver):
    """The motion.  Raises: SimulationError where it failed, if it shall throw; warns of stiffening."""
    note(lambda: motion.result)
    if throw and is_concrete(motion.result) and not np.all(succeeded(np.asarray(motion.result))):
        from ._failure import explain

        raise SimulationError(explain(system, motion, float(np.asarray(t0)), solver), motion)
    warn_of_stiffening(motion.diagnostics.stiffening)
    return motion


@jit
def _integrate(system, state, ts, t1, formulation, events, options, samples_start=None):
    from ._program import integrate  # and with it what is needed to trace a motion, not to take one from the store

    return integrate(system, state, ts, t1, class_of(formulation), events, options, samples_start)


def _check_acting(formulation, loop):
    """Raises: ValueError for what cannot go on after the action of an event."""
    if follows_rows(formulation):
        raise ValueError(
            "an action changes velocities, and this mechanism has none that are free: its drives give all"
        )
    if loop != "jaxmbs":
        raise ValueError(f"loop={loop!r} has no events that act: diffrax's loop ends at an event; take loop='jaxmbs'")


def _advise(system, state, solver):
    from ._stiffest_mode import advise

    return advise(system, state, solver)
