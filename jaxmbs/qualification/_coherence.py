"""Coherence of inputs: complex numbers, tables and functions of frequency by pair of names."""

from collections.abc import Callable, Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float

from ..checks import any_concrete, is_concrete, no_such, not_increasing
from ..errors import ModelError
from ..forces._fields import as_function
from ..typing import ArrayLike

#: Frequencies of the band at which the coherence of a function is checked.
_CHECKED = 33


class CoherenceTable(eqx.Module):
    """Complex coherence over frequency, straight between points, that of the ends outside.

    Attributes:
        frequencies: (points,) [Hz], rising.
        values: (points,) complex.
    """

    frequencies: Float[Array, " points"]
    values: Complex[Array, " points"]

    def __call__(self, f: Array) -> Complex[Array, " frequencies"]:
        """Values (frequencies,)."""
        points = self.frequencies.astype(f.dtype)
        real, imaginary = (
            jnp.interp(f, points, part.astype(f.dtype)) for part in (self.values.real, self.values.imag)
        )
        return lax.complex(real, imaginary)


class Coherence(eqx.Module):
    """Complex coherence of inputs, `S_ab = coherence_ab sqrt(S_a S_b)`; its squared size is the ordinary coherence.

    Attributes:
        constant: (inputs, inputs), what does not depend on frequency.
        curves: functions of frequencies (n,) to complex numbers (n,).
        places: row and column of each curve (static).
    """

    constant: Complex[Array, "inputs inputs"]
    curves: tuple[Callable, ...] = ()
    places: tuple[tuple[int, int], ...] = eqx.field(static=True, default=())

    def at(self, frequencies: ArrayLike) -> Complex[Array, "frequencies inputs inputs"]:
        """Matrices (frequencies, inputs, inputs), or (1, inputs, inputs) where none depends on frequency."""
        C = self.constant[None]
        if not self.curves:
            return C
        f = jnp.asarray(frequencies)
        C = jnp.broadcast_to(C, (len(f), *self.constant.shape))
        for (a, b), curve in zip(self.places, self.curves, strict=True):
            value = jnp.broadcast_to(jnp.asarray(curve(f)).astype(C.dtype), f.shape)
            C = C.at[:, a, b].set(value).at[:, b, a].set(jnp.conj(value))
        return C

    @property
    def breaks(self) -> list[Array]:
        """Frequencies [Hz] of the points of all tables, where the coherence has kinks."""
        return [curve.frequencies for curve in self.curves if isinstance(curve, CoherenceTable)]


def coherence_of(names: tuple[str, ...], coherence: Mapping | None, band: tuple = ()) -> Coherence:
    """Coherence of inputs by pair of names `("a", "b")`; the others are uncorrelated.

    Args:
        coherence: complex numbers of size up to 1; pairs `(frequencies, values)` of such a table; or functions of
            frequencies [Hz] (n,) to values (n,).
        band: frequencies (k,) [Hz] of the inputs, between which functions are checked.

    Raises: ModelError for unknown names, pairs given twice with values that are not conjugates, tables that are none,
    and matrices that are not positive semidefinite.
    """
    if coherence is not None and not isinstance(coherence, Mapping):
        what = f"coherence: give it by pairs of names, {{('a', 'b'): 0.5}}, not {coherence!r}"
        raise ModelError([what], "the inputs")
    faults, C = [], jnp.eye(len(names), dtype=jnp.asarray(1j).dtype)
    given, curves = dict(coherence or {}), {}
    for pair, value in given.items():
        if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
            faults.append(f"coherence: {pair!r} must be a pair of two inputs")
            continue
        unknown = [name for name in pair if name not in names]
        faults += [no_such("input", name, names) for name in unknown]
        value = _parsed(pair, value, faults)
        if unknown or value is None:
            continue
        a, b = (names.index(name) for name in pair)
        if pair[::-1] in given and not _is_conjugate(value, given[pair[::-1]]):
            faults.append(f"coherence of {pair[0]!r} and {pair[1]!r} is given twice: the two must be conjugates")
        if callable(value):
            curves[a, b] = value
        else:
            C = C.at[a, b].set(value).at[b, a].set(jnp.conj(value))
    found = Coherence(C, tuple(curves.values()), tuple(curves))
    faults = faults or _definiteness_faults(found, band)
    if faults:
        raise ModelError(faults, "the inputs")
    return found


def _parsed(pair, value, faults):
    """A number, or a function of frequency; None with a fault for what is neither."""
    where = f"coherence of {pair[0]!r} and {pair[1]!r}"
    if callable(value):
        return as_function(value)
    if isinstance(value, tuple | list) and len(value) == 2 and all(np.ndim(part) == 1 for part in value):
        f, values = jnp.asarray(value[0], float), jnp.asarray(value[1]).astype(jnp.asarray(1j).dtype)
        if f.shape != values.shape or len(f) < 2:
            faults.append(f"{where}: {len(f)} frequencies and {len(values)} values are no table")
        elif not_increasing(f) or any_concrete(lambda f: ~np.isfinite(f) | (f < 0), f):
            faults.append(f"{where}: its frequencies must rise, from zero on")
        else:
            return CoherenceTable(f, values)
        return None
    if np.shape(value) or isinstance(value, str | None):
        faults.append(f"{where} must be a number, (frequencies, values) or a function of frequency, not {value!r}")
        return None
    return jnp.asarray(value, jnp.asarray(1j).dtype)


def _is_conjugate(value, other):
    """True for numbers that are conjugates, or traced ones; curves are given once."""
    if callable(value) or callable(other) or np.shape(other):
        return False
    return not is_concrete(value, other) or bool(np.isclose(np.conj(np.asarray(other)), np.asarray(value)))


def _definiteness_faults(coherence, band):
    """A sentence if concrete matrices are not positive semidefinite.

    Between the points of tables they are means of those at the points; of functions some are looked at.
    """
    f = np.zeros(1)
    if coherence.curves and is_concrete(coherence, band):
        ends = [np.asarray(part, float) for part in (*band, *coherence.breaks)]
        f = np.unique(np.concatenate(ends)) if ends else np.array([1.0])
        f = np.unique(np.concatenate([f, np.linspace(f[0], f[-1], _CHECKED)]))
    C = coherence.at(jnp.asarray(f))
    if not is_concrete(C):
        return []
    least = np.min(np.linalg.eigvalsh(np.asarray(C)), axis=-1, initial=0.0)
    if np.all(least >= -64 * np.finfo(C.real.dtype).eps * C.shape[-1]):
        return []
    at = f" at {f[np.argmin(least)]:.6g} Hz" if coherence.curves else ""
    return [
        f"the coherence is not positive semidefinite{at}: no signals are correlated like this (its least "
        f"eigenvalue is {np.min(least):.3g})"
    ]
