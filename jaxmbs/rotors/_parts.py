"""Disks and bearings of a rotor at its stations."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..checks import any_concrete, faults_if
from ..errors import ModelError
from ..math._interpolation import hermite, spline_slopes
from ..runtime import as_array
from ..typing import ArrayLike, Convertible

MOST = 10_000  # stations of a shaft, and elements between two: matrices of more are not made


class Disk(eqx.Module):
    """A rigid disk at a station of the shaft.

    Attributes:
        station: its number, from 0 (static).
        mass [kg]; diametral, polar: moments of inertia about a diameter and about the axis [kg m^2].
    """

    station: int = eqx.field(static=True)
    mass: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    diametral: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    polar: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)

    def __check_init__(self) -> None:
        _check("the disk", self.station, mass=self.mass, diametral=self.diametral, polar=self.polar)


class Bearing(eqx.Module):
    """A bearing at a station, of constant stiffness and damping.

    Attributes:
        station: its number, from 0 (static).
        stiffness, damping: (2, 2) of x and y, forces on the housing by motions of the shaft [N/m, N s/m]; one number
            for the same in all directions.
    """

    station: int = eqx.field(static=True)
    stiffness: Convertible[Float[Array, "2 2"]]
    damping: Convertible[Float[Array, "2 2"]]

    def __init__(self, station: int, stiffness: ArrayLike, damping: ArrayLike = 0.0) -> None:
        self.station = station
        self.stiffness, self.damping = (_in_plane(n, x) for n, x in (("stiffness", stiffness), ("damping", damping)))
        _check("the bearing", station)

    def coefficients(self, speed: Array) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) at a speed () [rad/s]."""
        return self.stiffness, self.damping


class BearingTable(eqx.Module):
    """A bearing at a station, its coefficients given by speed: cubic splines between, constant beyond.

    Attributes:
        station: its number, from 0 (static).
        speeds: (k,) [rad/s], rising, at least two.
        stiffness, damping: (k, 2, 2), cross-coupled ones off the diagonal [N/m, N s/m].
    """

    station: int = eqx.field(static=True)
    speeds: Convertible[Float[Array, " k"]] = eqx.field(converter=as_array)
    stiffness: Convertible[Float[Array, "k 2 2"]] = eqx.field(converter=as_array)
    damping: Convertible[Float[Array, "k 2 2"]] = eqx.field(converter=as_array)

    def __check_init__(self) -> None:
        _check("the bearing", self.station)
        k = self.speeds.size
        faults = faults_if(
            (self.speeds.ndim != 1 or k < 2, "speeds must be a row of at least two"),
            (any_concrete(lambda x: ~(np.diff(x) > 0), self.speeds), "speeds must rise"),
            *(
                (x.shape != (k, 2, 2), f"{name} must have shape ({k}, 2, 2), got {x.shape}")
                for name, x in (("stiffness", self.stiffness), ("damping", self.damping))
            ),
        )
        if faults:
            raise ModelError(faults, "the bearing")

    def coefficients(self, speed: Array) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) at a speed () [rad/s]."""
        rows = jnp.concatenate([self.stiffness.reshape(-1, 4), self.damping.reshape(-1, 4)], axis=1)
        held = jnp.clip(speed, self.speeds[0], self.speeds[-1])
        found = hermite(self.speeds, rows, spline_slopes(self.speeds, rows), held)
        return found[:4].reshape(2, 2), found[4:].reshape(2, 2)


def _in_plane(name, x):
    x = as_array(x)
    if x.shape not in ((), (2, 2)):
        raise ModelError([f"{name} must be one number or (2, 2), got shape {x.shape}"], "the bearing")
    return x * jnp.eye(2, dtype=x.dtype) if x.ndim == 0 else x


def _check(what, station, **positive):
    """Raises: ModelError for a station that is no number of one, numbers that are negative."""
    faults = faults_if(
        (
            isinstance(station, bool) or not isinstance(station, int | np.integer) or not 0 <= station < MOST,
            f"station must be the number of one, from 0 on and below {MOST}",
        ),
        *(
            (x.ndim > 0 or any_concrete(lambda v: ~(v >= 0), x), f"{name} must be one number, not negative")
            for name, x in positive.items()
        ),
    )
    if faults:
        raise ModelError(faults, what)
