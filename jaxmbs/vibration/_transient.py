"""Transient response: motion of linear systems under loads and under nonlinear laws such as gaps and stops."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..blocksparse import BlockMatrix
from ..checks import as_flag, is_concrete
from ..errors import SimulationError
from ..linear._mass_rank import is_dependent_in_blocks
from ..linear._massless import condense_massless
from ..linear._static_response import StaticResponse
from ..linear._system import LinearSystem
from ..math._nan import nan_slope_where, nan_where
from ..ode._events import Events
from ..ode._failure import describe_end
from ..ode._integrate import (
    Arguments,
    end_of_motion,
    integrate_equations,
    masked,
    saved_rows,
    solves_stages,
    status_of,
)
from ..ode._options import check_event, check_options, make_options, solver_or_default
from ..ode._save_times import save_times, valid_times
from ..ode._stages_of_equations import shared_diagonal
from ..runtime import as_array, as_dtype, jit, progress_bar
from ..status import Status, succeeded
from ..typing import AnyArray, ArrayLike, WordedError
from ._block_equations import BlockCondensation, BlockEquations
from ._linear_equations import LinearEquations, coefficient_rows, forces_at, load_function, sampled_load
from ._linear_motion import CoordinateLaw, LinearMotion, LinearState, ModalSuperposition
from ._modal_response import modal_response

#: Default absolute tolerance of a step by the size of a number [bytes]: displacements of structures are three decades
#: smaller than those of mechanisms; in single precision likewise.
ATOL = {8: 1e-12, 4: 6e-6}
#: (rtol, atol) of implicit methods likewise.  They are taken where high frequencies are of no interest: at smaller
#: tolerances the vibration that every kink of the loads excites there would set the step.
IMPLICIT_TOLERANCES = {8: (1e-6, 1e-9), 4: (3e-4, 6e-6)}


def simulate(
    system: LinearSystem,
    start: StaticResponse | LinearState | tuple | None = None,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    *,
    forces: Mapping | Callable | AnyArray | None = None,
    laws: Sequence[CoordinateLaw] = (),
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: Any = "reverse",
    event: WordedError[Callable | None] = None,
    interpolate: bool = False,
    max_steps: int = 100_000,
    progress: bool | None = None,
    throw: bool = True,
) -> LinearMotion:
    """Motion of a linear system, also of a network of components, under loads and laws between its coordinates.

    Args:
        start: `(displacement, velocity)`, each (n,) or None for zero, the result of `equilibrium`, or the `end` of
            another motion, whose time is then the start; default at rest.
        t1: end time [s] (default: the last of `ts`).
        ts: times to save (T,), increasing (default: 101 equal steps to t1); the first is the start unless
            `start` has a time; where only t1 is given the start is at 0.  They have derivatives.
        forces: as `LinearSystem.load` takes them, each (T, ...), straight between the times; or a function of time
            that gives such without the axis of times.
        laws: laws between coordinates.
        dt: fixed step [s]; without it steps adapt to rtol, atol (displacements and velocities).
        solver: of diffrax, by default as for mechanisms; `diffrax.Kvaerno5()` where frequencies of no interest are
            high, whose stages are solved with one inverse, the same for equal steps, as those of
            `ImplicitMidpoint()`; at fixed steps `Gauss4()`, `ImplicitMidpoint()` or `SemiImplicitEuler()`.  Without
            laws `ModalSuperposition(...)`, at equal steps of time: no error of integration and far cheaper.
        controller: of diffrax for adaptive steps, in place of `diffrax.PIDController` with rtol and atol.
        rtol: of each step, default 1e-9 (3e-4 in single precision), as for mechanisms; 1e-6 of implicit solvers.
        atol: of each step, default 1e-12 (6e-6 in single precision): less than for mechanisms, as displacements of
            structures are smaller; 1e-9 of implicit solvers, which else would follow frequencies of no interest.
        gradient: derivative mode, "reverse" or "forward"; second derivatives by `jax.jacfwd` of either.
        event: function of a `LinearState` to one number whose zero crossing ends the motion, as for mechanisms: the
            state there is saved too, so the motion has one entry more (unused entries: times inf, numbers nan).
        interpolate: let steps pass over saved times, whose states come from the solver's interpolation; by default
            steps land on them, so that they meet every kink of sampled forces.
        max_steps: bound on the integrator's steps.
        progress: show a bar; by default after three seconds, in a terminal or a notebook, while a tape runs.
        throw: raise when the motion fails (outside of tracing); else look at `motion.status`.

    Rows without mass are condensed, which is exact, and put back: they follow the others and the loads on them
    statically, their rates the others alone; so their part of a start is not used.

    Raises: ValueError for what does not fit, laws and damping on rows without mass too, by name; UnknownNameError;
    TypeError for an event that is no function to one number; SimulationError: the motion failed; carries what was
    computed as `.motion`.  Source: S1 (3), (9)-(12).
    """
    laws = tuple(laws)
    forces = None if isinstance(forces, Mapping) and not forces else forces
    modal = solver if isinstance(solver, ModalSuperposition) else None
    solver = solver_or_default(None if modal else solver)
    check_options(solver, controller, dt, rtol, atol, gradient)
    system = system if _keeps_blocks(system, modal, solver) else system.to_dense()
    t0, x0 = _start(system, start, ts)
    ts = save_times(t0, t1, ts, system.dtype)
    t1 = ts[-1] if t1 is None else as_dtype(t1, ts.dtype)
    condensation = _condensation(system, modal, laws, forces, (t0, ts, t1))
    if modal is not None:
        _check_modal(start, laws, forces, (dt, controller, event))
        return _in_modes(system, condensation, ts, forces, modal)
    check_event(event, LinearState(t0, *x0), "s.displacement[0]")
    own = _tolerances(solver, rtol, atol, system.dtype) | {"span": (t0, t1), "has_event": event is not None}
    own |= {"dt": dt, "gradient": gradient, "max_steps": max_steps, "lands_on_times": not interpolate}
    bar = progress is not None and as_flag("progress", progress)
    options = make_options(solver, controller, **own, progress=bar, dtype=ts.dtype)
    with progress_bar("simulate", t0, t1, progress):
        motion = _integrate(system, condensation, LinearState(t0, *x0), ts, t1, forces, laws, event, options)
    if throw and is_concrete(motion.result) and not np.all(succeeded(np.asarray(motion.result))):
        raise SimulationError(_explain(motion, float(np.asarray(t0))), motion)
    return motion


def _condensation(system, modal, laws, forces, times):
    """The system without its rows without mass; of modes with given ratios its damping is of no use.

    Raises: ValueError for samples of forces that do not fit the times, and what acts on rows without mass.
    """
    if forces is not None and not callable(forces):
        _check_samples(*times)
    if isinstance(system.stiffness, BlockMatrix):
        found = BlockCondensation.of(system)
    else:
        found = condense_massless(system, damped=modal is None or modal.ratios is None)
    if found.light:
        _check_light(system, found, laws, forces, times[1])
    return found


def _tolerances(solver, rtol, atol, dtype):
    """rtol and atol: those given, or else the usual ones of the solver; None for rtol leaves it to `make_options`."""
    implicit = isinstance(solver, diffrax.AbstractImplicitSolver)
    usual = IMPLICIT_TOLERANCES[dtype.itemsize] if implicit else (None, ATOL[dtype.itemsize])
    given = {"rtol": rtol, "atol": atol}
    return {name: usual[k] if x is None else x for k, (name, x) in enumerate(given.items())}


def _keeps_blocks(system, modal, solver):
    """True for block matrices and methods that only take products with them: all but modes and implicit stages.

    Motions without mass that are no coordinates are condensed in dense matrices.
    """
    is_implicit = isinstance(solver, diffrax.AbstractImplicitSolver) or getattr(solver, "newton", False)
    if not isinstance(system.stiffness, BlockMatrix) or modal is not None or is_implicit:
        return False
    return not is_dependent_in_blocks(system.mass)


def _explain(motion, t0):
    finite = np.isfinite(np.asarray(motion.displacement)).all(-1) & np.isfinite(np.asarray(motion.ts))
    saved = np.asarray(motion.ts)[finite]
    text = describe_end(motion.status, t0, motion.end.t, saved, motion.num_steps)
    if motion.status in (Status.MAX_STEPS, Status.STEP_SIZE):
        text += "; reduce the components further, or take a stiff solver (solver=diffrax.Kvaerno5())"
    return text


def _start(system, start, ts):
    """Time of the start, and displacement and velocity (n,) there."""
    zero, first = as_array(np.zeros(system.num_rows), system.dtype), 0.0
    if ts is not None:
        times = np.asarray(ts) if is_concrete(ts) else as_dtype(ts, system.dtype)
        first = times[0] if times.ndim == 1 and len(times) else 0.0
    first = as_dtype(first, system.dtype)
    if start is None:
        return first, (zero, zero)
    if isinstance(start, StaticResponse):
        return first, (start.displacement, zero)
    if isinstance(start, LinearState):
        first, start = as_dtype(start.t, system.dtype), start[1:]
    if len(start) != 2:
        raise ValueError(f"start is (displacement, velocity), got {len(start)} parts")
    parts = tuple(zero if a is None else as_dtype(a, system.dtype) for a in start)
    if any(a.shape != zero.shape for a in parts):
        raise ValueError(f"start has parts of shapes {[a.shape for a in parts]}, not ({system.num_rows},)")
    return first, parts


@jit
def _integrate(system, condensation, start, ts, t1, forces, laws, event, options):
    ts, valid = valid_times(ts, start.t, t1)
    kind = BlockEquations if isinstance(condensation, BlockCondensation) else LinearEquations
    equations = kind.of(system, condensation, laws, load_function(system, ts, forces))
    if event is not None:
        event = eqx.filter_closure_convert(event, start)
    if solves_stages(equations, options.solver) and (options.dt is not None or options.lands_on_times):
        equations = equations.expecting(shared_diagonal(options.solver) * _usual_step(options, ts))
    args = Arguments(equations, Events.ending(event))
    y0 = (*map(condensation.heavy_part, start[1:]), jnp.zeros(0, system.dtype))
    _, final, y0 = integrate_equations(args, y0, (start.t, ts, t1), valid, options)
    t_end, y_end, _ = end_of_motion(final, y0, t1, args)
    times, (x, v, _), beyond = saved_rows(final, ts, (t_end, y_end), args)
    lost = ~(jnp.all(jnp.isfinite(x), axis=1) & jnp.all(jnp.isfinite(v), axis=1))
    # rows that are not saved, or not finite, are evaluated at the end: what they would be harms no derivative
    at, x, v = (masked(beyond | lost, a, end) for a, end in zip((times, x, v), (t_end, *y_end[:2]), strict=True))
    a, efforts = jax.vmap(equations.acceleration)(at, x, v), jax.vmap(equations.efforts)(at, x, v)
    loads = jax.vmap(equations.load)(at) if condensation.light and equations.load is not None else None
    given = (
        () if forces is None else (forces if event is None and not callable(forces) else forces_at(at, ts, forces),)
    )
    given += tuple(law.forces(effort) for law, effort in zip(laws, efforts.T, strict=True))

    code = status_of(final.result)
    code = jnp.where(jnp.any(lost & ~beyond) | ~jnp.all(jnp.isfinite(ts)), Status.NOT_FINITE, code)
    failed = (jnp.cumsum(beyond | lost) > 0) & ~succeeded(code)
    rows = (condensation.expand(x, loads), condensation.expand(v), condensation.expand(a), efforts)
    rows = tuple(nan_where(failed, masked(beyond & ~failed, row, jnp.nan)) for row in rows)
    end = equations.state_at(t_end, y_end)
    end = LinearState(t_end, *(nan_slope_where(~succeeded(code), part) for part in end[1:]))
    counts = final.tried.astype(int), final.rejected.astype(int)
    return LinearMotion(ts if event is None else times, *rows, given, code, end, *counts)


def _usual_step(options, ts):
    """The step that most steps of the motion have: the fixed one, or the least interval between saved times."""
    if options.dt is not None:
        return options.dt
    between = jnp.diff(ts)
    return jnp.min(between, where=between > 0.0, initial=jnp.max(ts))


def _in_modes(system, condensation, ts, forces, modal):
    """The motion by superposition of natural modes."""
    if is_concrete(ts) and not np.allclose(np.diff(np.asarray(ts)), float(ts[1] - ts[0]), rtol=1e-6):
        raise ValueError("ModalSuperposition needs equal steps of time")
    load = sampled_load(system, ts, forces)
    heavy = condensation.system
    damping, ratios = (heavy.damping, 0.0) if modal.ratios is None else (None, modal.ratios)
    matrices = {"K": heavy.stiffness, "M": heavy.mass, "C": damping}
    options = {"num": modal.num, "static_start": modal.static_start, "diagonal": condensation.diagonal}
    moved = modal_response(**matrices, load=condensation.load(load), step=ts[1] - ts[0], ratios=ratios, **options)
    rows = condensation.expand(moved[0], load), *map(condensation.expand, moved[1:])
    none, zero = jnp.zeros((len(ts), 0), load.dtype), jnp.zeros((), int)
    given = None if modal.ratios is None else jnp.asarray(ratios, system.dtype)
    end = LinearState(ts[-1], rows[0][-1], rows[1][-1])
    return LinearMotion(ts, *rows, none, (forces,), jnp.asarray(int(Status.SUCCESS)), end, zero, zero, given)


def _check_modal(start, laws, forces, step_options):
    """Raises: ValueError for arguments that the superposition of modes has no use for."""
    if start is not None or laws or callable(forces) or forces is None:
        raise ValueError("ModalSuperposition moves a system from rest under sampled forces, without laws")
    if any(option is not None for option in step_options):
        raise ValueError("ModalSuperposition takes no steps: leave out dt, controller and event")


def _check_samples(t0, ts, t1):
    """Raises: ValueError, if concrete, for times that sampled forces cannot be interpolated between."""
    if len(ts) < 2 or (is_concrete(ts) and np.any(np.diff(np.asarray(ts)) <= 0)):
        raise ValueError("sampled forces need two or more times, and ts must increase without repetition")
    if is_concrete(t0, ts, t1) and not (ts[0] == t0 and ts[-1] == t1):
        raise ValueError(
            f"forces are sampled from {float(ts[0])} to {float(ts[-1])} s, the motion is from {float(t0)} to "
            f"{float(t1)} s: give them as a function of time"
        )


def _check_light(system, condensation, laws, forces, ts):
    """Raises: ValueError for what acts on rows without mass and is no static load, by name, if concrete."""
    light = np.array(condensation.light)
    rows = coefficient_rows(system, laws)
    touched = _works(condensation, rows) if is_concrete(rows, condensation) else np.zeros(len(light), bool)
    if np.any(touched):
        names = ", ".join(system.label(k) for k in light[touched])
        raise ValueError(
            f"laws act on {names}, which have no mass: give them some, or take Rubin in place of MacNeal"
        )
    load = None if system.damping is None or forces is None else load_function(system, ts, forces)
    if load is None or not is_concrete(system.damping, ts):
        return
    loaded = jax.vmap(load)(ts)
    damped = _damped_rows(system.damping, condensation)
    bad = light[damped & _works(condensation, loaded)] if is_concrete(loaded, condensation) else ()
    if len(bad):
        names = ", ".join(system.label(k) for k in bad)
        raise ValueError(f"loads act on {names}, which have damping and no mass: give them some mass")


def _works(condensation, forces):
    """Flags (light,) of motions without mass in which some of the forces (k, n) do work, to rounding."""
    work, size = condensation.light_load(forces), jnp.max(jnp.abs(forces), axis=1, keepdims=True)
    return np.any(np.abs(np.asarray(work)) > 1e-12 * np.asarray(size), axis=0)


def _damped_rows(damping, condensation):
    """Flags of motions without mass that have damping of their own; none of blocks, which refuse them."""
    if isinstance(damping, BlockMatrix):
        return np.zeros(len(condensation.light), bool)
    return np.any(np.asarray(condensation.in_light(damping)), axis=1)
