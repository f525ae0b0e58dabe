"""`simulate`: Hamilton's equations through diffrax, with projection, accounts and a result code."""

import math

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
from jax import lax

from ..errors import SimulationError
from ..kinematics import constraints
from ..kinematics.poses import node_parameters
from ..kinematics.state import State
from ..math.jit import jit
from ..math.lineax_solver import SquareSolver
from ..math.rows import over_rows
from ..model.question import check_fits
from ..model.system import System
from . import motion as codes
from .account import CLOSED, diagnose, masked, observe, result_code, without
from .failure import explain
from .formulation import FORMULATIONS, Problem, num_powers
from .motion import Motion
from .solvers import Projected, SemiImplicitEuler

_GRADIENTS = {"reverse": ("checkpointed", None), "forward": ("lax", None), "both": ("bounded", None)}


def simulate(
    system: System,
    state: State,
    t1=None,
    ts=None,
    dt=None,
    solver=None,
    rtol=1e-9,
    atol=1e-9,
    gradient="reverse",
    formulation=None,
    event=None,
    interpolate=False,
    max_steps=100_000,
    progress=False,
    throw=True,
) -> Motion:
    """The motion that starts at a state.

    Args:
        t1: end time [s] (default: the last of `ts`).
        ts: times to save (T,), increasing, from state.t on (default: 101 equal steps to t1); they have derivatives,
            zero only where the motion has no duration.
        dt: fixed step [s]; without it steps adapt to rtol, atol (coordinates and velocities, m, rad, s).
        solver: a diffrax solver (default Dopri8; stiff systems: diffrax.Kvaerno5()), or one of ours at fixed steps:
            `Gauss4()` and `ImplicitMidpoint()` (long motions), `SemiImplicitEuler()`.
        gradient: derivative mode of the motion: "reverse", "forward" or "both".
        formulation: "canonical" (default), "independent", "velocity", or "prescribed" (the default of systems without
            freedom, whose coordinates then follow their branch); see `formulation.py`.
        event: function of a State whose zero crossing ends the motion; the state there is saved too, right after the
            times before it, so the motion has one entry more (unused entries: times inf, states nan).
        interpolate: let steps pass over saved times, whose states come from the solver's interpolation and are closed
            again: for many saved times, cheaper and with an error of about ten times the tolerance.  By default
            steps land on them (motions without freedom: always interpolated, the constraints determine them).
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
    if formulation is None and system.topology.mobility == 0:
        formulation = "prescribed"
    solver, formulation = _choose(solver, dt, rtol, atol, gradient, formulation)
    t0 = state.t
    ts = _save_times(t0, t1, ts)
    t1 = ts[-1] if t1 is None else jnp.asarray(t1, float)
    steps = _fixed_steps(t0, t1, dt)
    lands = dt is None and not interpolate and formulation != "prescribed"
    most = max_steps if steps is None else steps + 2
    options = (solver, gradient, formulation, most, steps, lands, bool(progress))
    motion = _integrate(system, state, ts, t1, dt, rtol, atol, event, options)
    if throw and not isinstance(motion.result, jax.core.Tracer) and np.any(np.asarray(motion.result) > codes.EVENT):
        raise SimulationError(explain(system, motion), motion)
    return motion


def _choose(solver, dt, rtol, atol, gradient, formulation):
    """Solver and formulation; ValueError for options that contradict each other."""
    if isinstance(gradient, diffrax.BacksolveAdjoint):
        raise ValueError("BacksolveAdjoint differentiates the unprojected flow; use gradient='reverse'")
    if not isinstance(gradient, str) or gradient not in _GRADIENTS:
        raise ValueError(f"gradient={gradient!r} must be one of {', '.join(_GRADIENTS)}")
    solver = diffrax.Dopri8() if solver is None else solver
    if not isinstance(solver, diffrax.AbstractSolver):
        raise ValueError(f"solver must be a diffrax solver such as diffrax.Dopri8(), got {solver!r}")
    euler = isinstance(solver, SemiImplicitEuler)
    formulation = formulation or ("velocity" if euler else "canonical")
    if euler and formulation == "prescribed":
        formulation = "velocity"
    if formulation not in FORMULATIONS:
        raise ValueError(f"formulation={formulation!r} must be one of {', '.join(FORMULATIONS)}")
    if euler and (dt is None or formulation != "velocity"):
        raise ValueError("SemiImplicitEuler needs dt= and formulation='velocity'")
    adaptive = isinstance(solver, diffrax.AbstractAdaptiveSolver)
    if dt is None and not adaptive:
        raise ValueError(f"{type(solver).__name__} has no error estimate: give dt=")
    if isinstance(solver, diffrax.AbstractImplicitSolver) and isinstance(solver.root_finder, diffrax.VeryChord):
        solver = eqx.tree_at(lambda s: s.root_finder, solver, _newton(dt, rtol, atol))
    kind = _GRADIENTS[gradient][0]
    if hasattr(solver, "scan_kind"):
        solver = eqx.tree_at(lambda s: s.scan_kind, solver, kind, is_leaf=lambda x: x is None)
    return solver, formulation


def _newton(dt, rtol, atol):
    """Newton with a fresh Jacobian in place of diffrax's default: that one fails at every second step of A05."""
    if dt is not None:
        return optimistix.Newton(rtol=rtol, atol=atol, linear_solver=SquareSolver())
    return diffrax.with_stepsize_controller_tols(optimistix.Newton)(linear_solver=SquareSolver())


def _save_times(t0, t1, ts):
    if ts is None:
        if t1 is None:
            raise ValueError("give t1= (end time) or ts= (times to save)")
        _check_end(t0, t1)
        return jnp.linspace(t0, jnp.asarray(t1, float), 101)
    ts = jnp.asarray(ts, float)
    known = not any(isinstance(x, jax.core.Tracer) for x in (t0, ts))
    if known and not np.all(np.isfinite(ts)):
        raise ValueError(f"ts must be finite times, got {np.asarray(ts)[~np.isfinite(ts)][:3]}")
    if ts.ndim != 1 or ts.shape[0] == 0:
        raise ValueError(f"ts must be a list of times, got shape {ts.shape}")
    if known and (np.any(np.diff(ts) < 0) or ts[0] < t0 - 1e-12):
        raise ValueError(f"ts must increase and start at or after the state's time {float(t0)}")
    return ts


def _check_end(t0, t1):
    """ValueError for an end time that is known, and not finite or before the start."""
    known = not any(isinstance(x, jax.core.Tracer) for x in (t0, t1))
    if known and not (np.isfinite(t1) and np.asarray(t1) >= np.asarray(t0)):  # jnp would trace it
        raise ValueError(f"t1={t1} must be a finite time, not before the state's time {t0}")


def _fixed_steps(t0, t1, dt):
    """Number of fixed steps where it is known, else None."""
    if dt is None or any(isinstance(x, jax.core.Tracer) for x in (t0, t1, dt)):
        return None
    if not dt > 0:
        raise ValueError(f"dt must be positive, got {dt}")
    return max(1, math.ceil(float(t1 - t0) / float(dt) - 1e-9))


@jit
def _integrate(system, state, ts, t1, dt, rtol, atol, event, options):
    solver, gradient, formulation, max_steps, steps, lands, progress = options
    P = node_parameters(system)
    psi, t0 = state.coordinates, state.t
    problem, p0 = Problem.begin(system, P, formulation, psi, state.velocities, t0)
    y0 = (psi, p0, jnp.zeros(num_powers(system), psi.dtype))
    open_at_start = lax.stop_gradient(jnp.maximum(state.residual, _gap(problem, psi, t0)))
    fit = (open_at_start <= CLOSED) & jnp.all(jnp.isfinite(psi)) & jnp.all(jnp.isfinite(state.velocities))
    fit = fit & jnp.all(jnp.isfinite(ts)) & jnp.isfinite(t1)
    t1, times = jnp.where(fit, t1, t0), jnp.where(fit, ts, t0)  # a loop of no steps
    if system.has_constraints:
        solver = Projected(solver, _project, watched=formulation == "prescribed")
    adjoint = {
        "reverse": diffrax.RecursiveCheckpointAdjoint(checkpoints=min(steps, 4000) if steps else None),
        "forward": diffrax.ForwardMode(),
        "both": diffrax.DirectAdjoint(),
    }[gradient]
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(_rate),
        solver,
        t0,
        t1,
        1e-3 * (t1 - t0) if dt is None else dt,
        y0,
        args=problem,
        saveat=diffrax.SaveAt(ts=times, t1=True),
        stepsize_controller=_controller(formulation, dt, rtol, atol, t1 - t0, times if lands else None),
        adjoint=adjoint,
        event=None if event is None else _event(event),
        max_steps=max_steps,
        throw=False,
        progress_meter=diffrax.TqdmProgressMeter() if progress else diffrax.NoProgressMeter(),
    )
    return _motion(problem, state, y0, solution, ts, open_at_start, event is not None, lands)


def _gap(problem, psi, t):
    """Largest residual () of the positions."""
    if not problem.system.has_constraints:
        return jnp.zeros_like(t)
    return jnp.max(jnp.abs(constraints.residual(problem.system, problem.P, psi, t)), initial=0.0)


def _rate(t, y, problem):
    return problem.rate(t, y)


def _project(t, y, problem):
    return problem.project(t, y)


def _controller(formulation, dt, rtol, atol, span, ts):
    """Fixed steps, or adaptive ones that land on the times `ts`: interpolation would cost digits, unless the
    constraints alone bring them back."""
    if dt is not None:
        return diffrax.ConstantStepSize()

    def norm(y):
        # the work account follows, it does not lead, except where the rows alone give everything else
        return optimistix.rms_norm(y if formulation == "prescribed" else y[:2])

    adaptive = diffrax.PIDController(rtol=rtol, atol=atol, norm=norm, dtmin=1e-13 * jnp.abs(span))
    return adaptive if ts is None else diffrax.ClipStepSizeController(adaptive, step_ts=ts)


def _event(function):
    def crossing(t, y, args, **_):
        t = jnp.asarray(t, y[0].dtype)
        return function(State(t, y[0], args.velocities(t, *y[:2]), structure=args.system.topology.structure))

    return diffrax.Event(crossing, optimistix.Newton(rtol=1e-10, atol=1e-10, linear_solver=SquareSolver()))


def _motion(problem, start, y0, solution, ts, open_at_start, with_event, lands):
    """Saved states back on the constraints where steps did not land on them, accounts and the result code.

    What diffrax saved ends with the state that it reached, right after the last time before it.
    """
    saved, (psi, p, work) = solution.ts, solution.ys
    if problem.formulation == "prescribed":
        psi = lax.stop_gradient(psi)  # the constraints alone determine it, and its derivative
    count = jnp.sum(jnp.isfinite(saved))
    last = [jnp.sum(masked(jnp.arange(len(saved)) != count - 1, x, 0.0), axis=0) for x in (saved, psi, p)]
    if not with_event:
        saved = jnp.where(jnp.arange(len(ts)) < count - 1, ts, jnp.inf)
        psi, p, work = psi[:-1], p[:-1], work[:-1]
    ended = ~jnp.isfinite(saved)  # after an event or a failure nothing is saved

    def sample(row):
        t, psi, p = row
        if with_event or not lands:
            psi, _ = problem.project_position(t, psi)
        u = problem.velocities(t, psi, p)
        return psi, u, observe(problem.system, problem.P, psi, u, t)

    # what is not saved stands at the last state, so that the derivative of what is lost meets all parameters as NaN
    filled = [masked(ended, x, x1) for x, x1 in zip((saved, psi, p), last, strict=True)]
    begin = (start.t, *y0[:2])
    rows = tuple(jnp.concatenate([x0[None], x, x1[None]]) for x0, x, x1 in zip(begin, filled, last, strict=True))
    psi, u, observed = over_rows(sample, rows)
    structure = problem.system.topology.structure
    end = lax.stop_gradient(State(last[0], psi[-1], u[-1], observed[2][-1], structure))
    psi, u, observed = jax.tree.map(lambda x: x[:-1], (psi, u, observed))
    states = State(saved, psi[1:], u[1:], observed[2][1:], structure)
    diagnostics = diagnose(problem.system, observed, masked(ended, work, jnp.nan), solution.stats)
    code, lost = result_code(solution.result, states, diagnostics, observed, ended, open_at_start, ts)
    if problem.formulation == "prescribed":
        code = jnp.where((code == codes.STEP_SIZE) | (code == codes.FAILED), codes.INCONSISTENT, code)
    states, diagnostics = without(ended, lost, states, diagnostics)
    return Motion(saved if with_event else ts, states, code, diagnostics, end)
