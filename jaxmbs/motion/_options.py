"""What may be asked of `simulate`: solvers, step sizes, times, and what contradicts itself."""

import math

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import lineax
import numpy as np
import optimistix

from ..checks import any_concrete, is_concrete
from ..ode._linear_solver import SquareSolver
from ..ode._semi_implicit_euler import SemiImplicitEuler
from ..runtime import as_array
from ._formulation import Formulation
from ._formulations import FORMULATIONS, Prescribed, Velocity

GRADIENTS = ("reverse", "forward")
EARLY = 1e-12  # a time to save that is so much before the start [s] is the start


def choose(solver, controller, dt, rtol, atol, gradient, formulation):
    """Solver and formulation; ValueError for options that contradict each other."""
    if isinstance(gradient, diffrax.BacksolveAdjoint):
        raise ValueError("BacksolveAdjoint differentiates the unprojected flow; use gradient='reverse'")
    if not isinstance(gradient, str) or gradient not in GRADIENTS:
        raise ValueError(f"gradient={gradient!r} must be one of {', '.join(GRADIENTS)}")
    solver = diffrax.Dopri8() if solver is None else solver
    _check_solver(solver)
    euler = isinstance(solver, SemiImplicitEuler)
    formulation = formulation or ("velocity" if euler else "canonical")
    if not (isinstance(formulation, type) and issubclass(formulation, Formulation)):
        if formulation not in FORMULATIONS:
            raise ValueError(f"formulation={formulation!r} must be one of {', '.join(FORMULATIONS)}")
        formulation = FORMULATIONS[formulation]
    if euler and formulation is Prescribed:
        formulation = Velocity
    if euler and (dt is None or formulation is not Velocity):
        raise ValueError("SemiImplicitEuler needs dt= and formulation='velocity'")
    if controller is not None and not isinstance(controller, diffrax.AbstractAdaptiveStepSizeController):
        raise ValueError(
            f"controller must be an adaptive one of diffrax, got {controller!r}; for fixed steps give dt="
        )
    for name, value in {"rtol": rtol, "atol": atol}.items():
        if np.iscomplexobj(value) or any_concrete(lambda x: ~np.isfinite(x) | (x < 0), value):
            raise ValueError(f"{name}={value} must be finite and not negative")
    if controller is not None and dt is not None:
        raise ValueError("give dt= (fixed steps) or controller= (adaptive steps), not both")
    if dt is None and not isinstance(solver, diffrax.AbstractAdaptiveSolver):
        raise ValueError(f"{type(solver).__name__} has no error estimate: give dt=")
    if isinstance(solver, diffrax.AbstractImplicitSolver):
        solver = _with_finder(solver, dt, rtol, atol)
    return solver, formulation


def _check_solver(solver):
    """ValueError unless it is a solver of diffrax for one ordinary differential equation."""
    if not isinstance(solver, diffrax.AbstractSolver):
        raise ValueError(f"solver must be a diffrax solver such as diffrax.Dopri8(), got {solver!r}")
    if isinstance(solver, diffrax.SemiImplicitEuler):
        raise ValueError(
            "diffrax.SemiImplicitEuler() splits two equations: give jaxmbs.motion.SemiImplicitEuler(), and dt="
        )
    if solver.term_structure is not diffrax.AbstractTerm:
        raise ValueError(
            f"{type(solver).__name__} is for stochastic or split equations; a mechanism takes one for ordinary ones, "
            "such as diffrax.Dopri8() or, if stiff, diffrax.Kvaerno5()"
        )


def check_event(event, state):
    """TypeError unless an event, if there is one, is a function of a State to one real number."""
    if event is None:
        return
    if isinstance(event, list | tuple | diffrax.Event) or not callable(event):
        raise TypeError(
            "event= takes one function of a State whose zero ends the motion, such as lambda s: s.coordinates[0], "
            f"not {type(event).__name__}; for the first of two that start positive: lambda s: jnp.minimum(f(s), g(s))"
        )
    found = jax.eval_shape(event, state)
    if not (hasattr(found, "dtype") and found.shape == () and jnp.issubdtype(found.dtype, jnp.floating)):
        raise TypeError(f"the event must return one real number (), got {found}")


def _with_finder(solver, dt, rtol, atol):
    """The solver with our root finder for diffrax's default, and no batches for LAPACK (`math.lapack`)."""
    finder = solver.root_finder
    if isinstance(finder, diffrax.VeryChord):
        return eqx.tree_at(lambda s: s.root_finder, solver, _newton(dt, rtol, atol))
    if isinstance(getattr(finder, "linear_solver", None), lineax.AutoLinearSolver):
        return eqx.tree_at(lambda s: s.root_finder.linear_solver, solver, SquareSolver())
    return solver


def _newton(dt, rtol, atol):
    """Newton with a fresh Jacobian in place of diffrax's default: that one fails at every second step of A05."""
    if dt is not None:
        tolerances = {"rtol": as_array(rtol), "atol": as_array(atol)}  # arrays: no new program
        return optimistix.Newton(**tolerances, linear_solver=SquareSolver())
    return diffrax.with_stepsize_controller_tols(optimistix.Newton)(linear_solver=SquareSolver())


def save_times(t0, t1, ts):
    """The times to save; ValueError for those that are known and cannot be."""
    if ts is None:
        if t1 is None:
            raise ValueError("give t1= (end time) or ts= (times to save)")
        _check_end(t0, t1)
        if not is_concrete(t0, t1):
            return jnp.linspace(t0, jnp.asarray(t1, float), 101)
        return as_array(np.linspace(np.asarray(t0), np.asarray(t1, float), 101))  # compiles nothing
    ts = as_array(ts)
    if is_concrete(t0, ts) and not np.all(np.isfinite(ts)):
        raise ValueError(f"ts must be finite times, got {np.asarray(ts)[~np.isfinite(ts)][:3]}")
    if ts.ndim != 1 or ts.shape[0] == 0:
        raise ValueError(f"ts must be a list of times, got shape {ts.shape}")
    if is_concrete(t0, ts) and (np.any(np.diff(ts) < 0) or np.asarray(ts)[0] < np.asarray(t0) - EARLY):
        raise ValueError(f"ts must increase and start at or after the state's time {float(t0)}")
    if t1 is not None:
        _check_end(t0, t1)
    if t1 is not None and is_concrete(t0, ts, t1) and np.asarray(ts)[-1] > np.asarray(t1):
        raise ValueError(f"ts must end at or before t1={t1}, got {float(ts[-1])}")
    return ts


def _check_end(t0, t1):
    """ValueError for an end time that is known, and not finite or before the start."""
    if is_concrete(t0, t1) and not (np.isfinite(t1) and np.asarray(t1) >= np.asarray(t0)):  # jnp would trace it
        raise ValueError(f"t1={t1} must be a finite time, not before the state's time {t0}")


def fixed_steps(t0, t1, dt):
    """Number of fixed steps where it is known, else None."""
    if dt is None or not is_concrete(t0, t1, dt):
        return None
    if not (dt > 0 and np.isfinite(dt)):
        raise ValueError(f"dt must be positive, got {dt}")
    return max(1, math.ceil(float(np.asarray(t1) - np.asarray(t0)) / float(dt) - 1e-9))


def step_sizes(formulation, given, dt, rtol, atol, span):
    """The controller of diffrax: one given, fixed steps, or adaptive ones."""
    if given is not None:
        return given
    if dt is not None:
        return diffrax.ConstantStepSize()

    def norm(y):
        # the work account follows, it does not lead, except where the rows alone give everything else
        return optimistix.rms_norm(y if formulation.follows_rows else y[:2])

    return diffrax.PIDController(rtol=rtol, atol=atol, norm=norm, dtmin=1e-13 * jnp.abs(span))


def with_tolerances(solver, controller):
    """The solver, its root finder with the controller's tolerances where it has none of its own.

    Raises: ValueError where steps are fixed and the root finder has none.
    """
    if not isinstance(solver, diffrax.AbstractImplicitSolver):
        return solver
    finder = solver.root_finder
    values = {name: getattr(finder, name) for name in ("rtol", "atol", "norm")}
    missing = [name for name, value in values.items() if not (eqx.is_array_like(value) or callable(value))]
    if missing and not isinstance(controller, diffrax.AbstractAdaptiveStepSizeController):
        raise ValueError(f"{type(solver).__name__} at fixed steps needs a root finder with tolerances of its own")
    found = [getattr(controller, name) for name in missing]
    return eqx.tree_at(lambda s: [getattr(s.root_finder, name) for name in missing], solver, found)
