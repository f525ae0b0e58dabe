"""Motion of joined components with laws between them that are not linear: gaps, stops, hardening springs."""

from collections.abc import Callable, Mapping, Sequence

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import known
from ..errors import SimulationError
from ..forces import AbstractScalarLaw
from ..math import lapack
from ..math.interpolation import interval
from ..math.jit import jit
from ..typing import ScalarLike
from .network import Network
from .primal import Assembly, interface_reactions

_ADJOINTS = {
    "reverse": diffrax.RecursiveCheckpointAdjoint,
    "forward": diffrax.ForwardMode,
    "both": diffrax.DirectAdjoint,
}


class Link(eqx.Module):
    """A law of forces on `x = sum coefficient * coordinate` of components, or of one and the ground.

    `Link(BumpStop(k, upper=gap), {("wing", 4): 1.0, ("store", 0): -1.0})` is a stop between two components.

    Attributes:
        law: `jaxmbs.forces`' scalar laws, or one of your own: the effort along increasing x.
        coefficients: (k,), by (component, coordinate): the component's number, or its name in a network, and one of
            its own coordinates.

    Raises: ValueError without a coordinate.
    """

    law: AbstractScalarLaw
    coefficients: Float[Array, " k"]
    places: tuple[tuple[int | str, int], ...] = eqx.field(static=True)

    def __init__(self, law: AbstractScalarLaw, row: Mapping[tuple[int | str, int], ScalarLike]):
        if not row:
            raise ValueError("a link needs at least one coordinate")
        self.law = law
        self.places = tuple((c if isinstance(c, str) else int(c), int(k)) for c, k in row)
        self.coefficients = jnp.stack([jnp.asarray(value, float) for value in row.values()])

    def forces(self, assembly: Assembly, efforts=1.0) -> list:
        """Forces (n_c, ...) of efforts (...) on every component, None where there are none."""
        efforts, found = jnp.asarray(efforts, assembly.mass.dtype), [None] * len(assembly.components)
        for (c, place), coefficient in zip(self.places, self.coefficients.astype(efforts.dtype), strict=True):
            if found[c] is None:
                found[c] = jnp.zeros((len(assembly.components[c].basis), *efforts.shape), efforts.dtype)
            found[c] = found[c].at[place].add(coefficient * efforts)
        return found


class Transient(eqx.Module):
    """A motion in the joined coordinates; `assembly.expand(motion.displacement)` is that of the components.

    Attributes:
        times: (T,) [s].
        displacement, velocity, acceleration: (N, T).
        efforts: (links, T) of the laws.
        forces: on each component's own coordinates (n_c, T), those of the links among them; None for none.
        ok: whether the integrator came to the end.
    """

    times: Float[Array, " T"]
    displacement: Float[Array, "N T"]
    velocity: Float[Array, "N T"]
    acceleration: Float[Array, "N T"]
    efforts: Float[Array, "links T"]
    forces: tuple
    ok: Array

    def reactions(self, joined: Assembly | Network):
        """Forces of the bonds, as `interface_reactions` or a network gives them.  Source: S1 (19)-(25)."""
        along = self.displacement, self.acceleration, self.velocity
        if isinstance(joined, Network):
            return joined.reactions(*along, dict(zip(joined.names, self.forces, strict=True)))
        return interface_reactions(joined, *along, self.forces)


def transient(
    joined: Assembly | Network,
    times,
    forces: Sequence | Mapping | Callable | None = None,
    links: Sequence[Link] = (),
    displacement=None,
    velocity=None,
    solver=None,
    rtol: float | None = None,
    atol: float | None = None,
    gradient: str = "reverse",
    max_steps: int = 100_000,
) -> Transient:
    """Motion of joined components under loads and laws of any kind, through diffrax.

    Without links `modal_transient` has no error of integration and is far cheaper.

    Args:
        joined: of `join` or `connect`.
        times: to save (T,), increasing [s]; the first is the start.
        forces: on the components' own coordinates (n_c, T), straight between the times: a list in the order of the
            components with None for none, or by name for a network; or a function of time that gives such of (n_c,).
        displacement, velocity: (N,) at the start, default 0.
        solver: of diffrax, default Dopri8; `diffrax.Kvaerno5()` where frequencies of no interest are high.
        rtol, atol: of each step, default the root and the 3/4 power of the rounding.
        gradient: "reverse", "forward" or "both".

    Raises: ValueError for what does not fit; SimulationError where the integrator does not come to the end, if
    concrete (else see `ok`).  Source: S1 (3), (9)-(12).
    """
    assembly, forces, links = by_number(joined, forces, links)
    times = jnp.asarray(times, assembly.mass.dtype)
    _check(assembly, times, forces, links, gradient)
    eps = jnp.finfo(times.dtype).eps
    tolerances = (float(eps**0.5) if rtol is None else rtol, float(eps**0.75) if atol is None else atol)
    zero = jnp.zeros(len(assembly.labels), times.dtype)
    start = tuple(zero if a is None else jnp.asarray(a, times.dtype) for a in (displacement, velocity))
    options = (diffrax.Dopri8() if solver is None else solver, gradient, max_steps)
    motion = _integrate(assembly, times, forces, tuple(links), start, tolerances, options)
    if known(motion.ok) and not np.all(np.asarray(motion.ok)):
        raise SimulationError(
            f"no end after {max_steps} steps: reduce the components further, or try solver=diffrax.Kvaerno5()", motion
        )
    return motion


@jit
def _integrate(assembly, times, forces, links, start, tolerances, options):
    solver, gradient, max_steps = options
    K, C, M = assembly.stiffness, assembly.damping, assembly.mass
    rows = [assembly.load(link.forces(assembly)) for link in links]
    rows = jnp.stack(rows) if rows else jnp.zeros((0, len(M)), M.dtype)
    C = jnp.zeros_like(K) if C is None else C
    solved = lapack.solve_positive(M, jnp.concatenate([K, C, rows.T, jnp.eye(len(M), dtype=M.dtype)], axis=1))
    parts = jnp.split(solved, np.cumsum([len(M), len(M), len(rows)]), axis=1)
    load = _load(assembly, times, forces)

    def rate(t, state, args):
        (by_x, by_v, by_effort, by_force), rows, laws, load = args
        x, v = state
        a = -(by_x @ x) - by_v @ v + by_effort @ _efforts(laws, rows @ x, rows @ v, t)
        return v, a if load is None else a + by_force @ load(t)

    laws = jax.tree.map(lambda a: a.astype(M.dtype) if eqx.is_inexact_array(a) else a, [link.law for link in links])
    args = (parts, rows, laws, load)
    control = diffrax.PIDController(rtol=tolerances[0], atol=tolerances[1])
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(rate),
        solver,
        times[0],
        times[-1],
        1e-3 * (times[1] - times[0]),
        start,
        args,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.ClipStepSizeController(control, step_ts=times),
        adjoint=_ADJOINTS[gradient](),
        max_steps=max_steps,
        throw=False,
    )
    x, v = solution.ys
    a = jax.vmap(lambda t, *state: rate(t, state, args)[1])(times, x, v)
    efforts = jax.vmap(lambda t, x, v: _efforts(args[2], rows @ x, rows @ v, t))(times, x, v).T
    given = jax.vmap(forces, out_axes=-1)(times) if callable(forces) else forces
    total = [None] * len(assembly.components) if given is None else list(given)
    for link, effort in zip(links, efforts, strict=True):
        total = [_sum(a, b) for a, b in zip(total, link.forces(assembly, effort), strict=True)]
    return Transient(times, x.T, v.T, a.T, efforts, tuple(total), solution.result == diffrax.RESULTS.successful)


def by_number(joined: Assembly | Network, forces, links: Sequence[Link] = ()):
    """The assembly of a network, forces in the order of its components, links between numbers; else as they are."""
    if not isinstance(joined, Network):
        return joined, forces, links
    names = joined.names
    named = {c for link in links for c, _ in link.places}
    named |= set(forces) if isinstance(forces, Mapping) else set()
    stray = sorted(str(name) for name in named - set(names))
    if stray:
        raise ValueError(f"forces or links on {', '.join(stray)}: the components are {', '.join(names)}")
    ordered = lambda found: [found.get(name) for name in names]  # noqa: E731
    if forces is not None:
        given = forces
        forces = (lambda t: ordered(given(t))) if callable(given) else ordered(given)
    rows = [{(names.index(c), i): w for (c, i), w in zip(k.places, k.coefficients, strict=True)} for k in links]
    links = [Link(link.law, row) for link, row in zip(links, rows, strict=True)]
    return joined.assembly, forces, links


def _efforts(laws, x, v, t):
    found = [law.effort(x[k], v[k], t) for k, law in enumerate(laws)]
    return jnp.stack([jnp.asarray(e, x.dtype) for e in found]) if found else jnp.zeros_like(x)


def _load(assembly, times, forces):
    """The loads (N,) as a function of time, or None."""
    if forces is None:
        return None
    if callable(forces):
        return lambda t: assembly.load(forces(t))
    samples = assembly.load(forces).T

    def at(t):
        i = interval(times, t)
        share = (t - times[i]) / (times[i + 1] - times[i])
        return samples[i] + share * (samples[i + 1] - samples[i])

    return at


def _sum(a, b):
    return b if a is None else a if b is None else a + b


def _check(assembly, times, forces, links, gradient):
    if gradient not in _ADJOINTS:
        raise ValueError(f"gradient={gradient!r} must be one of {', '.join(_ADJOINTS)}")
    if times.ndim != 1 or len(times) < 2:
        raise ValueError(f"times must be a list of two or more, got shape {times.shape}")
    if known(times) and np.any(np.diff(np.asarray(times)) <= 0):
        raise ValueError("times must increase")
    check_masses(assembly)
    sizes = [len(c.basis) for c in assembly.components]
    for link in links:
        for c, k in link.places:
            if not (0 <= c < len(sizes) and 0 <= k < sizes[c]):
                raise ValueError(f"a link names coordinate {k} of component {c}; their sizes are {sizes}")
    if forces is not None and not callable(forces):
        check_forces(assembly, forces, len(times))


def check_masses(assembly: Assembly) -> None:
    """Raises: ValueError for coordinates that no component gives mass to."""
    if assembly.massless:
        names = ", ".join(assembly.labels[i] for i in assembly.massless)
        raise ValueError(f"no mass on {names}: take rubin in place of macneal, or give the bonds a mass")


def check_forces(assembly: Assembly, forces: Sequence, count: int) -> None:
    """Raises: ValueError for sampled forces that do not fit the components and the number of times."""
    sizes = [len(c.basis) for c in assembly.components]
    if len(forces) != len(sizes):
        raise ValueError(f"{len(sizes)} components, but forces on {len(forces)}")
    for c, (f, n) in enumerate(zip(forces, sizes, strict=True)):
        if f is not None and np.shape(f) != (n, count):
            raise ValueError(f"forces on component {c} have shape {np.shape(f)}, not ({n}, {count})")
