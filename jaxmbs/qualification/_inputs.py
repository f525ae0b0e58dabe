"""Inputs of vibration tests: accelerations of a base, patterns of forces, and their coherence."""

from collections.abc import Iterable, Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..checks import is_concrete, no_such
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..fatigue._psd import PsdTable
from ..linear._rigid_motions import rigid_rows
from ..linear._system import LinearSystem
from ..typing import ArrayLike, CoordinateLike
from ._white_noise import WhiteNoise

Spectrum = PsdTable | WhiteNoise


class BaseAcceleration(eqx.Module):
    """Acceleration of the base of a structure.

    Args:
        spectrum: of the acceleration, or None where only the direction is needed.
        direction: "x", "y", "z", "rx", "ry" or "rz": the base moves as a rigid body, rotations about the mean of the
            nodes.  Or factors by name of coordinate: `{"foot z": 1.0}`.
        at: names of the coordinates or nodes that are moved, `"interface"` for those of the interface.  None: the
            ground that holds the structure.

    Several inputs of a system have the same `at`.

    Raises: ModelError for a spectrum of forces, and an unknown direction.
    """

    spectrum: Spectrum | None
    direction: str | dict
    at: tuple | None = eqx.field(static=True)

    def __init__(
        self,
        spectrum: Spectrum | None = None,
        direction: str | Mapping = "z",
        at: CoordinateLike | Iterable[CoordinateLike] | None = None,
    ) -> None:
        _check_quantity(spectrum, "acceleration")
        self.spectrum = spectrum
        if isinstance(direction, str) and direction not in DIRECTIONS:
            raise ModelError([no_such("direction", direction, DIRECTIONS)], "the input")
        self.direction = direction if isinstance(direction, str) else dict(direction)
        self.at = None if at is None else (at,) if isinstance(at, str | int | np.integer) else tuple(at)

    def pattern(self, system: LinearSystem) -> Array:
        """Rigid or given motion (n,) of all coordinates for a unit of the input."""
        if isinstance(self.direction, str):
            return rigid_rows(system)[:, DIRECTIONS.index(self.direction)]
        return system.load(self.direction)


class RandomForce(eqx.Module):
    """Force, moment or pressure with a spectrum on a fixed pattern.

    Args:
        spectrum: of the factor of the pattern, or None where only the pattern is needed.
        pattern: as `LinearSystem.load` takes forces: `{"tip z": 1.0}`, an array (n,), areas times shape functions for
            a pressure.

    Raises: ModelError for a spectrum of accelerations.
    """

    spectrum: Spectrum | None
    pattern: dict | Array

    def __init__(self, spectrum: Spectrum | None = None, pattern: Mapping | ArrayLike = ()) -> None:
        _check_quantity(spectrum, "force")
        self.spectrum = spectrum
        self.pattern = dict(pattern) if isinstance(pattern, Mapping) else jnp.asarray(pattern)


def _check_quantity(spectrum, quantity):
    if spectrum is None or isinstance(spectrum, PsdTable | WhiteNoise) and spectrum.quantity == quantity:
        return
    own = getattr(spectrum, "quantity", type(spectrum).__name__)
    raise ModelError(
        [f"the spectrum must be of {quantity}, it is of {own}: see the unit of `psd_table`"], "the input"
    )


def coherence_matrix(names: tuple[str, ...], coherence: Mapping | None) -> Array:
    """Complex coherence (inputs, inputs), `S_ab = coherence_ab sqrt(S_a S_b)`; its squared size is the ordinary
    coherence.

    Args: coherence: by pair of names `("a", "b")`, complex numbers of size up to 1; the others are uncorrelated.

    Raises: ModelError for unknown names, pairs given twice with values that are not conjugates, and a matrix that is
    not positive semidefinite.
    """
    faults, C = [], jnp.eye(len(names), dtype=jnp.asarray(1j).dtype)
    given = dict(coherence or {})
    for pair, value in given.items():
        if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
            faults.append(f"coherence: {pair!r} must be a pair of two inputs")
            continue
        unknown = [name for name in pair if name not in names]
        faults += [no_such("input", name, names) for name in unknown]
        other = given.get(pair[::-1])
        if other is not None and is_concrete(value, other) and not np.isclose(np.conj(other), value):
            faults.append(f"coherence of {pair[0]!r} and {pair[1]!r} is given twice: the two must be conjugates")
        if not unknown:
            a, b = (names.index(name) for name in pair)
            value = jnp.asarray(value, C.dtype)
            C = C.at[a, b].set(value).at[b, a].set(jnp.conj(value))
    if not faults and is_concrete(C):
        least = float(np.min(np.linalg.eigvalsh(np.asarray(C)), initial=0.0))
        if not least >= -64 * np.finfo(C.real.dtype).eps * len(names):
            faults.append(
                "the coherence is not positive semidefinite: no signals are correlated like this (its least "
                f"eigenvalue is {least:.3g})"
            )
    if faults:
        raise ModelError(faults, "the inputs")
    return C


def spectral_matrix(inputs: Mapping, coherence: Array, frequencies: ArrayLike) -> Array:
    """Cross-spectral matrix (frequencies, inputs, inputs) [SI^2/Hz] of all inputs."""
    levels = [level_at(given.spectrum, frequencies) for given in inputs.values()]
    levels = jnp.stack(levels, axis=-1)
    root = jnp.where(levels > 0, jnp.sqrt(jnp.where(levels > 0, levels, 1.0)), 0.0)
    root = lax.complex(root, jnp.zeros_like(root))
    return root[:, :, None] * coherence.astype(root.dtype)[None] * root[:, None, :]


def level_at(spectrum: Spectrum, frequencies: ArrayLike) -> Array:
    """Levels (frequencies,) of a table or of white noise."""
    if isinstance(spectrum, WhiteNoise):
        return jnp.broadcast_to(spectrum.level, jnp.asarray(frequencies).shape)
    return spectrum.at(frequencies)
