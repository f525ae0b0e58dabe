"""`simulate`: Hamilton's equations by diffrax's steps, with projection, accounts and a result code."""

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import is_concrete
from ..errors import SimulationError
from ..flexible._stiffening import warn_of_stiffening
from ..kinematics._configuration import at_state
from ..kinematics._mobility import with_mobility_at
from ..kinematics._state import State
from ..model._entry_points import check_single_state
from ..model._system import System
from ..ode._adjoint import integrate_with_adjoint
from ..ode._loop import OdeProblem, integrate, rows_for, stop_gradients
from ..runtime import FORWARD_MODE, as_array, jit, reverse_only
from ..status import succeeded
from ..typing import ArrayLike, WordedError
from ._accounts import CLOSED, gap
from ._failure import explain
from ._formulation import Formulation, num_powers
from ._formulations import Independent, Prescribed, Velocity
from ._motion import Motion
from ._options import EARLY, check_event, choose, fixed_steps, save_times, step_sizes, with_tolerances
from ._result import attach_time_derivative, crossing, motion_of, shown, state_at

_TRIALS = 200  # steps made again, at most, for an event among fixed ones


def simulate(
    system: System,
    state: State,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike = 1e-9,
    atol: ArrayLike = 1e-9,
    gradient: Any = "reverse",
    formulation: str | type[Formulation] | None = None,
    event: WordedError[Callable | None] = None,
    interpolate: bool = False,
    max_steps: int = 100_000,
    progress: bool = False,
    throw: bool = True,
) -> Motion:
    """The motion that starts at a state.

    Args:
        t1: end time [s] (default: the last of `ts`).
        ts: times to save (T,), increasing, from state.t on (default: 101 equal steps to t1); they have derivatives.
        dt: fixed step [s]; without it steps adapt to rtol, atol (coordinates and velocities, m, rad, s).
        solver: a diffrax solver (default Dopri8; stiff systems: diffrax.Kvaerno5()), or, at fixed steps,
            `Gauss4()` and `ImplicitMidpoint()` (long motions), `SemiImplicitEuler()`.
        controller: of diffrax for adaptive steps, in place of `diffrax.PIDController` with rtol and atol.
        gradient: derivative mode of the motion, "reverse" or "forward"; second derivatives by `jax.jacfwd` of either.
        formulation: "canonical" (default), "independent", "velocity", "prescribed" (the default of systems without
            freedom, whose coordinates then follow their branch), or a `Formulation` of your own.
        event: function of a State to one number whose zero crossing ends the motion, as does one that is not a number
            where smaller steps do not help; the state there is saved too, right after the
            times before it, so the motion has one entry more (unused entries: times inf, states nan).
        interpolate: let steps pass over saved times, whose states come from the solver's interpolation and are closed
            again, with an error of about ten times the tolerance.  By default steps land on them: a four-bar with 101
            saved times costs twice as much at 1e-9, five times at 1e-3, and is right to 5e-12 at either, which
            passing over does not reach at any tolerance (`benchmarks/saved_times.py`).  Motions without freedom are
            always interpolated, the constraints determine them.
        max_steps: bound on the integrator's steps.
        progress: show a progress bar.
        throw: raise when the motion fails (outside of tracing); else look at `motion.status`.

    Returns: a Motion; saved states satisfy the constraints to rounding.  In a batch, a design that is not assembled
    or that fails takes no further steps.

    Raises:
        ValueError: contradictory options.  TypeError: an event that is no function to one number.
        SimulationError: the motion failed; carries what was computed as `.motion`.
    """
    check_single_state(system, state)
    if formulation is None and _is_prescribed(system, state):
        formulation = Prescribed
    if formulation in ("independent", Independent):
        system = with_mobility_at(system, state)
    check_event(event, state)
    solver, formulation = choose(solver, controller, dt, rtol, atol, gradient, formulation)
    t0 = state.t
    ts = save_times(t0, t1, ts)
    t1 = ts[-1] if t1 is None else as_array(t1)
    steps = fixed_steps(t0, t1, dt)
    max_steps = max_steps if steps is None else steps + (2 if event is None else _TRIALS)
    numbers = [None if x is None else as_array(x) for x in (dt, rtol, atol)]
    numbers = (*numbers, as_array(max_steps, np.int32))  # arrays: with another number no new program
    lands = dt is None and not interpolate and not formulation.follows_rows
    options = (gradient, formulation, lands, bool(progress), rows_for(max_steps))
    motion = _integrate(system, state, ts, t1, numbers, solver, controller, event, options)
    if throw and is_concrete(motion.result) and not np.all(succeeded(np.asarray(motion.result))):
        raise SimulationError(explain(system, motion, float(np.asarray(t0))), motion)
    warn_of_stiffening(motion.diagnostics.stiffening, stacklevel=4)
    return motion


def _is_prescribed(system, state):
    """Whether no freedom is left, at the pose of the build or at the start; one that lost rank there is singular."""
    freedoms = system.topology.mobility
    gained = int(state.rank_change) if state.rank_change.ndim == 0 and is_concrete(state.rank_change) else 0
    return freedoms - max(gained, 0) <= 0


@jit
def _integrate(system, state, ts, t1, numbers, solver, controller, event, options):
    gradient, formulation, lands, progress, rows = options
    dt, rtol, atol, max_steps = numbers
    at = at_state(system, state)
    problem, p0 = formulation.begin(system, at, state.velocities)
    y0 = (state.coordinates, p0, jnp.zeros(num_powers(system), p0.dtype))
    open_at_start = lax.stop_gradient(jnp.maximum(state.residual, gap(system, at)))
    fit = (open_at_start <= CLOSED) & jnp.all(jnp.isfinite(state.coordinates))
    rising = jnp.all(ts[1:] >= ts[:-1]) & (ts[0] >= state.t - EARLY) & (ts[-1] <= t1)
    ts = jnp.where(rising, ts, jnp.nan)  # traced times that are no times
    fit = fit & jnp.all(jnp.isfinite(state.velocities)) & jnp.all(jnp.isfinite(ts)) & jnp.isfinite(t1)
    span, t0, times = stop_gradients((t1 - state.t, state.t, ts))
    end, times = jnp.where(fit, t0 + span, t0), jnp.where(fit, times, t0)  # a march of no steps
    sizes = step_sizes(formulation, controller, dt, *stop_gradients((rtol, atol)), span)
    march = OdeProblem(
        stop_gradients(with_tolerances(solver, sizes)),
        stop_gradients(sizes),
        times,
        end,
        max_steps,
        _rate,
        close=_close if system.has_constraints else None,
        shows=system.has_constraints and formulation.keeps_momenta and lands and event is None,
        watched=formulation.follows_rows,
        crossing=None if event is None else crossing,
        lands=lands,
        meter=diffrax.TqdmProgressMeter() if progress else diffrax.NoProgressMeter(),
        rows=rows,
    )
    if event is not None:
        event = eqx.filter_closure_convert(event, state_at(system, state.t, state.coordinates, state.velocities))
    args, first = (problem, event), stop_gradients(1e-3 * span if dt is None else dt)
    y0 = attach_time_derivative(y0, 2.0 * t0 - state.t, t0, problem)  # a later start: what flows for less time
    if gradient == "reverse":
        walk = integrate_with_adjoint(reverse_only((y0, args), FORWARD_MODE), march, t0, first)
    else:
        walk = integrate(march, y0, t0, first, args)
    if march.shows:  # velocities are saved: the rows of another formulation
        args, still = (Velocity(system, at.P, jnp.ones_like(p0)), event), jnp.zeros(num_powers(system), p0.dtype)
        y0 = attach_time_derivative((state.coordinates, state.velocities, still), 2.0 * t0 - state.t, t0, args[0])
        walk = shown(walk, y0, times <= t0, walk.t > t0)
    return motion_of(args, state, y0, walk, (ts, t1), open_at_start, lands)


@jit
def _rate(t, y, args):
    return args[0].rate(t, y)


@jit
def _close(t, y, args):
    return args[0].project(t, y)
