"""Harmonic balance of linear systems with local nonlinear laws, by alternating frequency and time.

The linear part is eliminated: unknowns are the harmonics of the local displacements alone.
Source: Cameron and Griffin, An alternating frequency/time domain method (1989); Krack and Gross, Harmonic balance for
nonlinear vibration problems (2019).
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..checks import any_concrete, count_faults, faults_if, is_concrete
from ..errors import ModelError, UnknownNameError, warn
from ..linear._storage import to_dense
from ..linear._system import LinearSystem
from ..math import _square as square
from ..math._nan import nan_where
from ..ode._loop import stop_gradients
from ..runtime import as_array, jit
from ..typing import ArrayLike, WordedError
from ._harmonic_cycles import HarmonicCycles

_MOST_STEPS, _LEAST_LENGTH = 40, 1e-4
_MOST_SAMPLES = 100_000
_NEGLECTED, _ROUNDING = 0.01, 1e-10  # share of displacements that is told; of forces that are none
_CLOSED = 1e-9  # residual over the size, up to which a search has ended


class _Laws(NamedTuple):
    """Local laws: their functions, directions (n, p) of their displacements, and columns of each."""

    functions: tuple
    directions: Array
    columns: tuple[tuple[int, ...], ...]


def harmonic_balance(
    system: LinearSystem | Callable[[Any], LinearSystem],
    omega: ArrayLike,
    forces: WordedError[Mapping[str, ArrayLike]],
    laws: WordedError[Mapping[str, tuple[Any, Callable]]],
    harmonics: WordedError[int | Sequence[int]] = 7,
    samples: WordedError[int | None] = None,
    start: WordedError[Mapping[str, ArrayLike] | None] = None,
) -> HarmonicCycles:
    """Steady states of a linear system with local nonlinear laws under harmonic forces, over frequencies.

    Args:
        system: a component, a network or a reduced one; or a function of omega that gives it, as `Rotor.at_speed`.
        omega: (S,) [rad/s], in order: the search begins at the state of the frequency before, so that the order tells
            the branch.
        forces: coordinate -> complex amplitude () or (S,) [N, N m] of `Re F exp(i omega t)`; under a pair
            (coordinate, k) that of the harmonic k, 0 a steady one.
        laws: name -> (coordinates, function of (x, v) to the forces on them): one coordinate, or a list of d of them,
            of which x, v and forces are (d,).  A pair (a, b) for a coordinate is the difference `x_a - x_b`.
        harmonics: highest one, or their numbers, as (1, 3, 5) of symmetric laws.
        samples: instants in a period at which laws are evaluated; default eight times the highest harmonic.
        start: coordinate -> complex amplitude of the first harmonic, near the state at the first frequency.

    Warns where harmonics that are left out, up to two above the highest, matter: `neglected`.
    Forward and reverse derivatives by the implicit function theorem.  Its stability is not told: `periodic` of the
    mechanism does.

    Raises: ModelError for unknown coordinates, numbers that are none.
    """
    omega = as_array(omega)
    numbers = tuple(range(harmonics + 1)) if isinstance(harmonics, int | np.integer) else tuple(harmonics)
    faults = _number_faults(omega, numbers, harmonics, samples)
    if faults:
        raise ModelError(faults, "the harmonic balance")
    first = _first_of(system, omega)
    found, names = _laws(first, laws)
    loads = _loads(first, forces, numbers, omega)
    guess = jnp.zeros((found.directions.shape[1], len(numbers)), complex)
    if start:
        begin = jnp.zeros(first.num_rows, complex)
        for name, value in start.items():
            begin = begin.at[_row(first, name)].set(jnp.asarray(value, complex))
        guess = guess.at[:, numbers.index(1)].set(found.directions.T.astype(complex) @ begin)
    samples = samples or 8 * max(max(numbers), 2)
    labels = tuple(first.label(k) for k in range(first.num_rows))
    return _warned(_balance(system, omega, loads, found, numbers, samples, guess, labels, names))


def _first_of(system, omega):
    """The linear part at the first frequency; that at the highest one is asked for too, since it may warn."""
    if not callable(system):
        return system
    if is_concrete(omega):
        system(jnp.max(omega))
    return system(omega[0])


def _warned(found):
    """The same; warns where harmonics that were left out matter."""
    if is_concrete(found.neglected) and (most := np.max(np.nan_to_num(found.neglected), initial=0.0)) > _NEGLECTED:
        warn(
            f"harmonic_balance: forces at harmonics beside {found.harmonics} would move the laws by {most:.2g} of "
            "what they do; give more as harmonics= (0 and even ones for laws that are not symmetric)"
        )
    return found


def _number_faults(omega, numbers, harmonics, samples):
    faults = faults_if(
        (omega.ndim != 1 or not omega.size, "omega must be a row of frequencies [rad/s]"),
        (any_concrete(lambda w: ~((w > 0) & np.isfinite(w)), omega), "frequencies must be positive"),
    )
    for k in [harmonics] if np.ndim(harmonics) == 0 else numbers:
        faults += count_faults("harmonics", k)
    if not faults and (1 not in numbers or len(set(numbers)) < len(numbers) or max(numbers) > 1000):
        faults.append("harmonics: the first one must be among them, none twice, none above 1000")
    if not count_faults("samples", samples or 0) and (samples or 0) > _MOST_SAMPLES:
        faults.append(f"samples must be at most {_MOST_SAMPLES}")
    return faults + ([] if samples is None else count_faults("samples", samples, 2 * max(numbers, default=1) + 1))


def _row(system, name):
    """Row of a coordinate.  Raises: ModelError."""
    rows = system.rows(name)
    if len(rows) != 1:
        raise ModelError([f"{name!r} has {len(rows)} coordinates, name one"], "the harmonic balance")
    return rows[0]


def _laws(system, laws):
    """The local laws and the names of their displacements.  Raises: ModelError."""
    directions, columns, names = [], [], []
    for name, both in laws.items():
        if not isinstance(both, tuple) or len(both) != 2 or not callable(both[1]):
            raise ModelError([f"law {name!r} takes (coordinates, function of (x, v))"], "the harmonic balance")
        places = both[0] if isinstance(both[0], list) else [both[0]]
        columns.append(tuple(range(len(directions), len(directions) + len(places))))
        for place in places:
            row = np.zeros(system.num_rows)
            for part, sign in zip(place if isinstance(place, tuple) else (place,), (1.0, -1.0), strict=False):
                row[_row(system, part)] += sign
            directions.append(row)
            names.append(name if len(places) == 1 else f"{name} {len(names) - columns[-1][0]}")
    at = np.stack(directions, axis=1) if directions else np.zeros((system.num_rows, 0))
    return _Laws(tuple(both[1] for both in laws.values()), jnp.asarray(at), tuple(columns)), tuple(names)


def _loads(system, forces, numbers, omega):
    """Complex forces (S, H, n)."""
    loads = jnp.zeros((omega.shape[0], len(numbers), system.num_rows), complex)
    for name, value in forces.items():
        name, k = name if isinstance(name, tuple) else (name, 1)
        if k not in numbers:
            raise UnknownNameError(f"forces: harmonic {k} is not among {numbers}")
        if is_concrete(value) and np.asarray(value).dtype.kind not in "iufc":
            raise ModelError([f"force at {name!r} must be a number, complex for a phase"], "the harmonic balance")
        if np.shape(value) not in ((), omega.shape):
            raise ModelError([f"force at {name!r} must be one number or {omega.shape}"], "the harmonic balance")
        loads = loads.at[:, numbers.index(k), _row(system, name)].add(jnp.asarray(value, complex))
    return loads


@jit
def _balance(system, omega, loads, laws, numbers, samples, guess, labels, names):
    made = system if not callable(system) else None
    fixed = None if made is None else _matrices(made)

    def linear_part(w, load, numbers):
        """Displacements (H, n) of the forces alone, and by unit forces of the laws (H, n, p)."""
        M, C, K = fixed or _matrices(system(w))
        both = []
        for j, k in enumerate(numbers):
            Z = lax.complex(K - (k * w) ** 2 * M, k * w * C)
            both.append(square.solve(Z, jnp.concatenate([load[j][:, None], laws.directions.astype(Z.dtype)], axis=1)))
        both = jnp.stack(both)
        return both[..., 0], both[..., 1:]

    free, by_forces = lax.map(lambda x: linear_part(*x, numbers), (omega, loads))
    seen = laws.directions.astype(free.dtype)
    local = jnp.einsum("np,shn->sph", seen, free)
    H = jnp.einsum("np,shnq->shpq", seen, by_forces)
    basis = _Basis.of(numbers, samples)

    def one(x, given):
        w, x0, receptance = given
        rows = lambda x, given: _rows(x, *given, laws, basis)
        return _solved(rows, x, (w, x0, receptance))

    last = _as_reals(guess)
    given = omega, local, H
    _, (x, residual, ok) = lax.scan(lambda x, g: _next_start(one(x, g), x), last, given)
    history = jax.vmap(lambda x, w: _law_histories(x, w, laws, basis))(x, omega)
    forces = history.astype(basis.back.dtype) @ basis.back.T
    amplitudes = free + jnp.einsum("shnp,sph->shn", by_forces, forces)
    others = _others(numbers, samples)
    none = jnp.zeros((omega.shape[0], len(others), loads.shape[2]), loads.dtype)
    beside = lax.map(lambda x: linear_part(*x, others)[1], stop_gradients((omega, none)))
    neglected = _neglected(*stop_gradients((history, x, jnp.einsum("np,shnq->shpq", seen, beside))), others)
    shown = lambda values: jax.vmap(nan_where)(~ok, values)
    forces = jnp.swapaxes(forces, 1, 2)
    return HarmonicCycles(
        omega, shown(amplitudes), shown(forces), residual, ok, shown(neglected), numbers, labels, names
    )


def _others(numbers, samples):
    """Harmonics that are left out, up to two above the highest one that is not."""
    return tuple(k for k in range(min(max(numbers) + 2, (samples - 1) // 2) + 1) if k not in numbers)


def _neglected(history, x, receptance, others):
    """Displacements (S,) by the forces (S, p, N) of the laws at other harmonics, over those x (S, 2 p H)."""
    back = _Basis.of(others, history.shape[2]).back
    forces = history.astype(back.dtype) @ back.T
    forces = jnp.where(jnp.abs(forces) > _ROUNDING * jnp.max(jnp.abs(history), initial=0.0), forces, 0.0)
    moved = jnp.where(forces[:, None] == 0.0, 0.0, jnp.einsum("shpq,sqh->spqh", receptance, forces)).sum(axis=2)
    size = jnp.sqrt(jnp.sum(x**2, axis=1))
    return jnp.sqrt(jnp.sum(jnp.abs(moved) ** 2, axis=(1, 2))) / jnp.where(size > 0.0, size, 1.0)


def _next_start(found, before):
    """The next start, that of the frequency before where none was found, and the results."""
    x, residual, ok = found
    return lax.stop_gradient(jnp.where(ok, x, before)), found


def _matrices(system):
    M, K = to_dense(system.mass), to_dense(system.stiffness)
    return M, jnp.zeros_like(M) if system.damping is None else to_dense(system.damping), K


class _Basis(NamedTuple):
    """Values (N, H) of `exp(i k tau)` at the instants, their rates over omega, and the way back (H, N)."""

    values: Array
    rates: Array
    back: Array

    @classmethod
    def of(cls, numbers: tuple[int, ...], samples: int) -> "_Basis":
        k, tau = np.asarray(numbers), 2.0 * np.pi * np.arange(samples) / samples
        wave = np.exp(1j * np.outer(tau, k))
        back = np.where(k[:, None] == 0, 1.0, 2.0) * wave.conj().T / samples
        return cls(*map(jnp.asarray, (wave, 1j * k * wave, back)))


def _as_reals(x):
    """Complex (p, H) as reals (2 p H,)."""
    return jnp.stack([x.real, x.imag]).reshape(-1)


def _as_complex(x, p):
    return lax.complex(*x.reshape(2, p, -1))


def _law_forces(x, w, laws, basis):
    """Harmonics (p, H) of the forces of the laws at local displacements x (2 p H,)."""
    return _law_histories(x, w, laws, basis).astype(basis.back.dtype) @ basis.back.T


def _law_histories(x, w, laws, basis):
    """Forces (p, N) of the laws over the period at local displacements x (2 p H,)."""
    z = _as_complex(x, laws.directions.shape[1])
    place, rate = (z @ basis.values.T).real, w * (z @ basis.rates.T).real
    found = jnp.zeros(place.shape, place.dtype)
    for function, own in zip(laws.functions, laws.columns, strict=True):
        at = np.asarray(own)
        own_place, own_rate = (v[at[0]] if len(own) == 1 else v[at].T for v in (place, rate))
        values = jax.vmap(function)(own_place, own_rate)
        found = found.at[at].set(values.reshape(place.shape[1], len(own)).T)
    return found


def _rows(x, w, x0, receptance, laws, basis):
    """Differences (2 p H,) of local displacements from those under the forces and the laws."""
    forces = _law_forces(x, w, laws, basis)
    return x - _as_reals(x0 + jnp.einsum("hpq,qh->ph", receptance, forces))


def _solved(rows, x, given):
    """Newton's method with a line search from x; two last steps with one slope, which carry derivatives."""
    fixed = stop_gradients(given)
    square_of = lambda r: jnp.sum(r**2)

    def once(s):
        x, r, _, count = s
        step = square.solve(jax.jacfwd(rows)(x, fixed), -r)

        def shorter(t):
            length, _ = t
            new = rows(x + 0.5 * length * step, fixed)
            return 0.5 * length, new

        def too_long(t):
            length, new = t
            return ~(square_of(new) <= (1.0 - 0.1 * length) * square_of(r)) & (length > _LEAST_LENGTH)

        length, new = lax.while_loop(too_long, shorter, (jnp.ones_like(x[0]), rows(x + step, fixed)))
        size = jnp.sqrt(square_of(step)) / (jnp.sqrt(square_of(x + step)) + 1e-300)
        return x + length * step, new, jnp.where(length <= _LEAST_LENGTH, 0.0, size), count + 1

    start = (lax.stop_gradient(x), rows(x, fixed), jnp.ones_like(x[0]), jnp.zeros((), jnp.int32))
    x = lax.stop_gradient(lax.while_loop(lambda s: (s[2] > 1e-10) & (s[3] < _MOST_STEPS), once, start)[0])
    slope = lax.stop_gradient(jax.jacfwd(rows)(x, fixed))
    for _ in range(2):
        x = x - square.solve(slope, rows(x, given))
    missed = lax.stop_gradient(jnp.sqrt(square_of(rows(x, fixed)) / (square_of(x) + 1e-300)))
    return x, missed, missed <= _CLOSED
