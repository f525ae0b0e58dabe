"""Motion of linear systems under loads, and laws between their coordinates that are not linear: gaps, stops."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, is_concrete
from ..errors import SimulationError
from ..linear._massless import condense_massless
from ..linear._static_response import StaticResponse
from ..linear._system import LinearSystem
from ..math._interpolation import interval
from ..runtime import FORWARD_MODE, as_dtype, jit, lapack, reverse_only
from ..typing import AnyArray, ArrayLike
from ._linear_motion import LinearMotion, Link, Modal
from ._modal_response import modal_response

_ADJOINTS = {
    "reverse": diffrax.RecursiveCheckpointAdjoint,
    "forward": diffrax.ForwardMode,
    "both": diffrax.DirectAdjoint,
}


def simulate(
    system: LinearSystem,
    start: StaticResponse | tuple | None = None,
    *,
    ts: ArrayLike,
    forces: Mapping | Callable | AnyArray | None = None,
    links: Sequence[Link] = (),
    solver: Any = None,
    rtol: float | None = None,
    atol: float | None = None,
    gradient: str = "reverse",
    max_steps: int = 100_000,
    throw: bool = True,
) -> LinearMotion:
    """Motion of a linear system, of a network of components too, under loads and laws of any kind.

    Args:
        start: `(displacement, velocity)`, each (n,), or what `equilibrium` found; default at rest.
        ts: times to save (T,), increasing [s]; the first is the start.
        forces: as `LinearSystem.load` takes them, each (T, ...), straight between the times; or a function of time
            that gives such without the axis of times.
        links: laws between coordinates.
        solver: of diffrax, default Dopri8; `diffrax.Kvaerno5()` where frequencies of no interest are high.  Or
            `Modal(...)`, without links: no error of integration and far cheaper, at equal steps of time.
        rtol, atol: of each step, default the root and the 3/4 power of the rounding.
        gradient: "reverse", "forward" or "both".
        throw: raise where the integrator does not come to the end, if concrete; else see `ok`.

    Rows without mass are condensed, which is exact, and put back: they follow the others and the loads on them
    statically, their rates the others alone; of a start their part is what follows.

    Raises: ValueError for what does not fit, links and damping on rows without mass too, by name; UnknownNameError;
    SimulationError.  Source: S1 (3), (9)-(12).
    """
    system, ts = system.to_dense(), as_dtype(ts, system.dtype)
    forces = None if isinstance(forces, Mapping) and not forces else forces
    _check(system, ts, gradient)
    for name, value in {"rtol": rtol, "atol": atol}.items():
        if value is not None and (np.iscomplexobj(value) or any_concrete(lambda x: ~np.isfinite(x) | (x < 0), value)):
            raise ValueError(f"{name}={value} must be finite and not negative")
    whole = condense_massless(system, damped=not (isinstance(solver, Modal) and solver.ratios is not None))
    if whole.light:
        _check_light(system, whole, links, forces, ts)
    if isinstance(solver, Modal):
        return _in_modes(system, whole, start, ts, forces, links, solver)
    eps = jnp.finfo(ts.dtype).eps
    tolerances = (float(eps**0.5) if rtol is None else rtol, float(eps**0.75) if atol is None else atol)
    options = (diffrax.Dopri8() if solver is None else solver, gradient, max_steps)
    motion = _integrate(system, whole, ts, forces, tuple(links), _state(system, start), tolerances, options)
    if throw and is_concrete(motion.ok) and not np.all(np.asarray(motion.ok)):
        raise SimulationError(
            f"no end after {max_steps} steps: reduce the components further, or try solver=diffrax.Kvaerno5()", motion
        )
    return motion


def _in_modes(system, whole, start, ts, forces, links, modal):
    if start is not None or links or callable(forces) or forces is None:
        raise ValueError("Modal() moves a system from rest under sampled forces, without links")
    if is_concrete(ts) and not np.allclose(np.diff(np.asarray(ts)), float(ts[1] - ts[0]), rtol=1e-6):
        raise ValueError("Modal() needs equal steps of time")
    load = _sampled(system, forces, ts)
    own = whole.system
    damping, ratios = (own.damping, 0.0) if modal.ratios is None else (None, modal.ratios)
    matrices = {"K": own.stiffness, "M": own.mass, "C": damping}
    options = {"num": modal.num, "static_start": modal.static_start}
    x, *rates = modal_response(**matrices, load=whole.load(load), step=ts[1] - ts[0], ratios=ratios, **options)
    found = whole.expand(x, load), *map(whole.expand, rates)
    none = jnp.zeros((len(ts), 0), load.dtype)
    given = None if modal.ratios is None else jnp.asarray(ratios, system.dtype)
    return LinearMotion(ts, *found, none, (forces,), jnp.array(True), given)


def _state(system, start):
    zero = jnp.zeros(system.num_rows, system.dtype)
    if start is None:
        return zero, zero
    if isinstance(start, StaticResponse):
        return start.displacement, zero
    if len(start) != 2:
        raise ValueError(f"start is (displacement, velocity), got {len(start)} parts")
    start = tuple(zero if a is None else as_dtype(a, system.dtype) for a in start)
    if any(a.shape != zero.shape for a in start):
        raise ValueError(f"start has parts of shapes {[a.shape for a in start]}, not ({system.num_rows},)")
    return start


@jit
def _integrate(system, whole, ts, forces, links, start, tolerances, options):
    solver, gradient, max_steps = options
    if gradient == "reverse":
        given = system, whole, ts, forces, links, start
        system, whole, ts, forces, links, start = reverse_only(given, FORWARD_MODE)
    K, C, M = whole.system.stiffness, whole.system.damping, whole.system.mass
    start = tuple(map(whole.heavy_part, start))
    rows = _rows(system, links)[:, np.array(whole.heavy, int)]
    C = jnp.zeros_like(K) if C is None else C
    solved = lapack.solve_positive(M, jnp.concatenate([K, C, rows.T, jnp.eye(len(M), dtype=M.dtype)], axis=1))
    parts = jnp.split(solved, np.cumsum([len(M), len(M), len(rows)]), axis=1)

    def rate(t, state, args):
        (by_x, by_v, by_effort, by_force), rows, laws, load = args
        x, v = state
        a = -(by_x @ x) - by_v @ v + by_effort @ _efforts(laws, rows @ x, rows @ v, t)
        return v, a if load is None else a + by_force @ whole.load(load(t))

    laws = jax.tree.map(lambda a: a.astype(M.dtype) if hasattr(a, "astype") else a, [link.law for link in links])
    args = (parts, rows, laws, _load(system, ts, forces))
    control = diffrax.PIDController(rtol=tolerances[0], atol=tolerances[1])
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rate),
        solver,
        ts[0],
        ts[-1],
        1e-3 * (ts[1] - ts[0]),
        start,
        args,
        saveat=diffrax.SaveAt(ts=ts),
        stepsize_controller=diffrax.ClipStepSizeController(control, step_ts=ts),
        adjoint=_ADJOINTS[gradient](),
        max_steps=max_steps,
        throw=False,
    )
    x, v = solution.ys
    a = jax.vmap(lambda t, *state: rate(t, state, args)[1])(ts, x, v)
    efforts = jax.vmap(lambda t, x, v: _efforts(args[2], rows @ x, rows @ v, t))(ts, x, v)
    loads = jax.vmap(args[3])(ts) if whole.light and args[3] is not None else None
    x, v, a = whole.expand(x, loads), whole.expand(v), whole.expand(a)
    given = jax.vmap(forces)(ts) if callable(forces) else forces
    total = [] if given is None else [given]
    total += [link.forces(effort) for link, effort in zip(links, efforts.T, strict=True)]
    return LinearMotion(ts, x, v, a, efforts, tuple(total), solution.result == diffrax.RESULTS.successful)


def _efforts(laws, x, v, t):
    found = [law.effort(x[k], v[k], t) for k, law in enumerate(laws)]
    return jnp.stack([jnp.asarray(e, x.dtype) for e in found]) if found else jnp.zeros_like(x)


def _load(system, ts, forces):
    """The loads (n,) as a function of time, or None."""
    if forces is None:
        return None
    if callable(forces):
        return lambda t: system.load(forces(t))
    samples = _sampled(system, forces, ts)

    def at(t):
        i = interval(ts, t)
        share = (t - ts[i]) / (ts[i + 1] - ts[i])
        return samples[i] + share * (samples[i + 1] - samples[i])

    return at


def _sampled(system, forces, ts):
    load = system.load(forces)
    if load.shape != (len(ts), system.num_rows):
        raise ValueError(f"forces make loads of shape {load.shape}, not ({len(ts)}, {system.num_rows}): times first")
    return load


def _check(system, ts, gradient):
    if gradient not in _ADJOINTS:
        raise ValueError(f"gradient={gradient!r} must be one of {', '.join(_ADJOINTS)}")
    if ts.ndim != 1 or len(ts) < 2:
        raise ValueError(f"ts must be a list of two or more times, got shape {ts.shape}")
    if is_concrete(ts) and not np.all(np.isfinite(np.asarray(ts))):
        raise ValueError("ts must be finite times")
    if is_concrete(ts) and np.any(np.diff(np.asarray(ts)) <= 0):
        raise ValueError("ts must increase")


def _rows(system, links):
    """(links, n) coefficients of the links by coordinate."""
    rows = [system.load(link.forces(jnp.ones((), system.dtype))) for link in links]
    return jnp.stack(rows) if rows else jnp.zeros((0, system.num_rows), system.dtype)


def _check_light(system, whole, links, forces, ts):
    """Raises: ValueError for what acts on rows without mass and is no static load, by name, if concrete."""
    light = np.array(whole.light)
    rows = _rows(system, links)[:, light]
    touched = np.any(np.asarray(rows) != 0, axis=0) if is_concrete(rows) else np.zeros(len(light), bool)
    if np.any(touched):
        names = ", ".join(system.label(k) for k in light[touched])
        raise ValueError(
            f"links act on {names}, which have no mass: give them some, or take Rubin in place of MacNeal"
        )
    load = None if system.damping is None or forces is None else _load(system, ts, forces)
    if load is None or not is_concrete(system.damping, ts):
        return
    loaded = jax.vmap(load)(ts)[:, light]
    damped = np.any(np.asarray(system.damping)[np.ix_(light, light)], axis=1)
    bad = light[damped & np.any(np.asarray(loaded) != 0, axis=0)] if is_concrete(loaded) else ()
    if len(bad):
        names = ", ".join(system.label(k) for k in bad)
        raise ValueError(f"loads act on {names}, which have damping and no mass: give them some mass")
