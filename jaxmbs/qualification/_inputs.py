"""Inputs of vibration tests: accelerations of a base, patterns of forces, and their coherence."""

from collections.abc import Iterable, Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..checks import distinct_names, no_such
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..fatigue._psd import PsdTable
from ..linear._rigid_motions import ground_loads, rigid_rows
from ..linear._system import LinearSystem
from ..tables import fields_repr
from ..typing import ArrayLike, CoordinateLike
from ._coherence import Coherence
from ._white_noise import WhiteNoise

Spectrum = PsdTable | WhiteNoise


class BaseAcceleration(eqx.Module):
    """Acceleration of the base of a structure.

    Args:
        spectrum: of the acceleration, or None where only the direction is needed.
        direction: "x", "y", "z", "rx", "ry" or "rz": the base moves as a rigid body, rotations about the mean of the
            nodes.  Or factors by name of coordinate: `{"foot z": 1.0}`, which do not tell how what is held moves.
        at: names of the coordinates or nodes that are moved, `"interface"` for those of the interface.  None: the
            ground that holds the structure.

    Several inputs of a system have the same `at`.

    Raises: ModelError for a spectrum of forces, and an unknown direction.
    """

    spectrum: Spectrum | None
    direction: str | dict
    at: tuple | None = eqx.field(static=True)

    __repr__ = fields_repr

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
        at = (at,) if isinstance(at, str | int | np.integer) else at
        self.at = None if at is None else distinct_names("at", at)

    def pattern(self, system: LinearSystem) -> Array:
        """Rigid or given motion (n,) of all coordinates for a unit of the input."""
        if isinstance(self.direction, str):
            return rigid_rows(system)[:, DIRECTIONS.index(self.direction)]
        return system.load(self.direction)

    def ground_load(self, system: LinearSystem) -> Array:
        """Forces (n,) on the coordinates by the masses that move with the ground alone, for a unit of the input."""
        if isinstance(self.direction, str):
            return ground_loads(system)[:, DIRECTIONS.index(self.direction)]
        return jnp.zeros(system.num_rows, system.dtype)

    def translation(self, dtype: Any) -> Array:
        """Motion (3,) of the ground in x, y, z for a unit of the input, of directions by name."""
        axes = [self.direction == d for d in DIRECTIONS[:3]]
        return jnp.asarray(axes, dtype)


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

    __repr__ = fields_repr

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


def spectral_matrix(inputs: Mapping, coherence: Coherence, frequencies: ArrayLike) -> Array:
    """Cross-spectral matrix (frequencies, inputs, inputs) [SI^2/Hz] of all inputs."""
    levels = [level_at(given.spectrum, frequencies) for given in inputs.values()]
    levels = jnp.stack(levels, axis=-1)
    root = jnp.where(levels > 0, jnp.sqrt(jnp.where(levels > 0, levels, 1.0)), 0.0)
    root = lax.complex(root, jnp.zeros_like(root))
    return root[:, :, None] * coherence.at(frequencies).astype(root.dtype) * root[:, None, :]


def level_at(spectrum: Spectrum, frequencies: ArrayLike) -> Array:
    """Levels (frequencies,) of a table or of white noise."""
    if isinstance(spectrum, WhiteNoise):
        return jnp.broadcast_to(spectrum.level, jnp.asarray(frequencies).shape)
    return spectrum.at(frequencies)
