"""`simulate`: Hamilton's equations by diffrax's steps, with projection, accounts and a result code."""

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import known
from ..errors import SimulationError
from ..flexible.spin import warn_of_stiffening
from ..kinematics.configuration import at_state, configuration, moving
from ..kinematics.mobility import system_at
from ..kinematics.state import State
from ..math.host import as_array
from ..math.jit import jit
from ..math.march import March, held, rows_for, walked
from ..math.march_adjoint import walked_reverse
from ..math.reverse_only import FORWARD_MODE, reverse_only
from ..math.rows import over_rows
from ..model.question import check_fits
from ..model.system import System
from ..status import Status, succeeded
from ..typing import ArrayLike
from .account import CLOSED, diagnose, gap, masked, observe, result_code, without
from .failure import explain
from .formulation import Formulation, num_powers
from .formulations import Independent, Prescribed, Velocity
from .motion import Motion
from .options import EARLY, choose, fixed_steps, save_times, step_sizes, with_tolerances


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
    event: Callable | None = None,
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
        event: function of a State whose zero crossing ends the motion; the state there is saved too, right after the
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
        ValueError: contradictory options.
        SimulationError: the motion failed; carries what was computed as `.motion`.
    """
    check_fits(system, state)
    if formulation is None and _is_prescribed(system, state):
        formulation = Prescribed
    if formulation in ("independent", Independent):
        system = system_at(system, state)
    solver, formulation = choose(solver, controller, dt, rtol, atol, gradient, formulation)
    t0 = state.t
    ts = save_times(t0, t1, ts)
    t1 = ts[-1] if t1 is None else as_array(t1)
    steps = fixed_steps(t0, t1, dt)
    max_steps = max_steps if steps is None else steps + 2
    numbers = [None if x is None else as_array(x) for x in (dt, rtol, atol)]
    numbers = (*numbers, as_array(max_steps, np.int32))  # arrays: with another number no new program
    lands = dt is None and not interpolate and not formulation.follows_rows
    options = (gradient, formulation, lands, bool(progress), rows_for(max_steps))
    motion = _integrate(system, state, ts, t1, numbers, solver, controller, event, options)
    if throw and known(motion.result) and not np.all(succeeded(np.asarray(motion.result))):
        raise SimulationError(explain(system, motion, float(np.asarray(t0))), motion)
    warn_of_stiffening(motion.diagnostics.stiffening, stacklevel=4)
    return motion


def _is_prescribed(system, state):
    """Whether no freedom is left, at the pose of the build or at the start; one that lost rank there is singular."""
    freedoms = system.topology.mobility
    gained = int(state.rank_change) if state.rank_change.ndim == 0 and known(state.rank_change) else 0
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
    span, t0, times = held((t1 - state.t, state.t, ts))
    end, times = jnp.where(fit, t0 + span, t0), jnp.where(fit, times, t0)  # a march of no steps
    sizes = step_sizes(formulation, controller, dt, *held((rtol, atol)), span)
    march = March(
        held(with_tolerances(solver, sizes)),
        held(sizes),
        times,
        end,
        max_steps,
        _rate,
        close=_close if system.has_constraints else None,
        shows=system.has_constraints and formulation.keeps_momenta and lands and event is None,
        watched=formulation.follows_rows,
        crossing=None if event is None else _crossing,
        lands=lands,
        meter=diffrax.TqdmProgressMeter() if progress else diffrax.NoProgressMeter(),
        rows=rows,
    )
    event = None if event is None else eqx.filter_closure_convert(event, state)
    args, first = (problem, event), held(1e-3 * span if dt is None else dt)
    y0 = shifted(y0, 2.0 * t0 - state.t, t0, problem)  # a later start: what flows for less time
    if gradient == "reverse":
        walk = walked_reverse(reverse_only((y0, args), FORWARD_MODE), march, t0, first)
    else:
        walk = walked(march, y0, t0, first, args)
    if march.shows:  # velocities are saved: the rows of another formulation
        args, still = (Velocity(system, at.P, jnp.ones_like(p0)), event), jnp.zeros(num_powers(system), p0.dtype)
        y0 = shifted((state.coordinates, state.velocities, still), 2.0 * t0 - state.t, t0, args[0])
        walk = _shown(walk, y0, times <= t0, walk.t > t0)
    return _motion(args, state, y0, walk, ts, open_at_start, lands)


def _shown(walk, y0, early, moves):
    """The walk with what was shown in place of what was integrated; at times up to the start that is y0."""
    ys = jax.tree.map(lambda x, x0: masked(early, x, x0[None]), walk.ys, y0)
    y = walk.y[0], jnp.where(moves, walk.shown[1], y0[1]), walk.y[2]
    return eqx.tree_at(lambda w: (w.ys, w.y), walk, (ys, y))


@jit
def _rate(t, y, args):
    return args[0].rate(t, y)


@jit
def _close(t, y, args):
    return args[0].project(t, y)


def _crossing(t, y, args):
    problem, event = args
    return event(State(t, y[0], problem.velocities(t, *y[:2]), structure=problem.system.topology.structure))


@eqx.filter_custom_jvp
def shifted(y, t, held_t, problem):
    """y (or rows of it), found at `held_t` with that time held: its derivative by the time is its rate."""
    return y


@shifted.def_jvp
def _shifted_jvp(primals, tangents):
    y, _, held_t, problem = primals
    y_dot, t_dot, _, _ = tangents
    if t_dot is None:
        return y, y_dot
    rate = jax.vmap(problem.rate)(held_t, y) if held_t.ndim else problem.rate(held_t, y)
    along = lambda r: r * t_dot.reshape(t_dot.shape + (1,) * (r.ndim - t_dot.ndim))  # noqa: E731
    return y, tuple(along(r) if d is None else d + along(r) for r, d in zip(rate, y_dot, strict=True))


def _on_the_event(t, y, args):
    """(time, state) of the event from those that a march ended with beside it: one Newton step along the motion."""
    problem, _ = args
    rate = problem.rate(t, y)
    value, slope = jax.jvp(lambda t, y: _crossing(t, y, args), (t, y), (jnp.ones_like(t), rate))
    late = value / jnp.where(slope == 0.0, 1.0, slope)
    return t - late, jax.tree.map(lambda y, r: y - late * r, y, rate)


def _motion(args, start, y0, walk, ts, open_at_start, lands):
    """Saved states back on the constraints where steps did not land on them, accounts and the result code.

    With an event the state that the march reached follows the last time before it.
    """
    (problem, event), index = args, jnp.arange(len(ts), dtype=jnp.int32)
    ended, last = (index >= walk.saved) | ~jnp.isfinite(ts), (walk.t, walk.y)  # after an end nothing is saved
    times, ys = masked(ended, ts, jnp.inf), shifted(walk.ys, ts, held(ts), problem)
    if event is not None:
        happened = walk.result == diffrax.RESULTS.event_occurred
        last = jax.tree.map(lambda a, b: jnp.where(happened, a, b), _on_the_event(*last, args), last)
        here = jnp.arange(len(ts) + 1, dtype=jnp.int32) == walk.saved
        times, ys = jax.tree.map(
            lambda x, x1: masked(here, jnp.concatenate([x, x1[None]]), x1[None]), (times, ys), last
        )
        times = jnp.where(jnp.arange(len(ts) + 1, dtype=jnp.int32) <= walk.saved, times, jnp.inf)
        ended = ~jnp.isfinite(times)
    psi, p, work = ys
    if problem.follows_rows:
        psi = lax.stop_gradient(psi)  # the constraints alone determine it, and its derivative

    def sample(row):
        t, psi, p = row
        if event is not None or not lands:
            psi, _ = problem.project_position(t, psi)
        at = configuration(problem.system, problem.P, psi, t)
        u = problem.velocities_at(at, p)
        return psi, u, observe(problem.system, moving(problem.system, at, u))

    # what is not saved stands at the last state, so that the derivative of what is lost meets all parameters as NaN
    first, reached = (start.t, *y0[:2]), (last[0], *last[1][:2])
    filled = [masked(ended, x, x1) for x, x1 in zip((times, psi, p), reached, strict=True)]
    rows = tuple(jnp.concatenate([x0[None], x, x1[None]]) for x0, x, x1 in zip(first, filled, reached, strict=True))
    psi, u, observed = over_rows(sample, rows)
    structure = problem.system.topology.structure
    end = lax.stop_gradient(State(last[0], psi[-1], u[-1], observed[2][-1], structure))
    psi, u, observed = jax.tree.map(lambda x: x[:-1], (psi, u, observed))
    states = State(times, psi[1:], u[1:], observed[2][1:], structure)
    diagnostics = diagnose(problem.system, observed, masked(ended, work, jnp.nan), walk)
    code, lost = result_code(walk.result, states, diagnostics, observed, ended, open_at_start, ts)
    if problem.follows_rows:
        code = jnp.where((code == Status.STEP_SIZE) | (code == Status.FAILED), Status.INCONSISTENT, code)
    states, diagnostics = without(ended, lost, states, diagnostics)
    return Motion(ts if event is None else times, states, code, diagnostics, end)
