"""Disks and bearings of a rotor at its stations."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..checks import any_concrete, faults_if
from ..errors import ModelError
from ..forces._validity import Margin
from ..math._interpolation import hermite, spline_slopes
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, ScalarLike
from ._validity import distance_to

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

    __repr__ = fields_repr

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

    __repr__ = fields_repr

    def __init__(self, station: int, stiffness: ArrayLike, damping: ArrayLike = 0.0) -> None:
        self.station = station
        self.stiffness, self.damping = (_in_plane(n, x) for n, x in (("stiffness", stiffness), ("damping", damping)))
        _check("the bearing", station)

    def coefficients(self, speed: ScalarLike) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) at a speed () [rad/s]."""
        return self.stiffness, self.damping


class BearingTable(eqx.Module):
    """A bearing at a station, its coefficients given by speed, or by speed and frequency of the whirl: cubic splines
    between, constant beyond, of which results warn (`validity`).

    Attributes:
        station: its number, from 0 (static).
        speeds: (k,) [rad/s], rising, at least two, or one where omegas are given.
        stiffness, damping: (k, 2, 2), or (k, f, 2, 2) by frequency; cross-coupled ones off the diagonal
            [N/m, N s/m].
        omegas: (f,) of the whirl [rad/s], rising, at least two; None for coefficients that depend on the speed
            alone.
    """

    station: int = eqx.field(static=True)
    speeds: Convertible[Float[Array, " k"]] = eqx.field(converter=as_array)
    stiffness: Convertible[Float[Array, "k *f 2 2"]] = eqx.field(converter=as_array)
    damping: Convertible[Float[Array, "k *f 2 2"]] = eqx.field(converter=as_array)
    omegas: Convertible[Float[Array, " f"] | None] = eqx.field(
        converter=lambda x: None if x is None else as_array(x), default=None
    )

    __repr__ = fields_repr

    def __check_init__(self) -> None:
        _check("the bearing", self.station)
        shape, least = (self.speeds.size,), 2 if self.omegas is None else 1
        faults = _row_faults("speeds", self.speeds, least)
        if self.omegas is not None:
            shape = (*shape, self.omegas.size)
            faults += _row_faults("omegas", self.omegas, 2)
        faults += faults_if(
            *(
                (x.shape != (*shape, 2, 2), f"{name} must have shape {(*shape, 2, 2)}, got {x.shape}")
                for name, x in (("stiffness", self.stiffness), ("damping", self.damping))
            ),
        )
        if faults:
            raise ModelError(faults, "the bearing")

    @property
    def depends_on_frequency(self) -> bool:
        """True where the coefficients depend on the frequency of the whirl too."""
        return self.omegas is not None

    def coefficients(self, speed: ScalarLike, omega: ScalarLike | None = None) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) at a speed () [rad/s] and an omega () of the whirl [rad/s], that of the
        speed where none is given, as under unbalance."""
        rows = jnp.stack([self.stiffness, self.damping], axis=1)
        if self.omegas is not None:
            by_frequency = jnp.moveaxis(rows, 2, 0).reshape(self.omegas.size, -1)
            rows = _between(self.omegas, by_frequency, speed if omega is None else omega)
        rows = rows.reshape(-1, 8)
        found = rows[0] if self.speeds.size == 1 else _between(self.speeds, rows, speed)
        return found[:4].reshape(2, 2), found[4:].reshape(2, 2)

    def validity(self, speed: ScalarLike, omega: ScalarLike | None = None) -> dict[str, Margin]:
        """Margins to the ends of the table, by speed and by frequency [rad/s]."""
        whirl = speed if omega is None else omega
        rows = [("turns", "speed", self.speeds, speed)] if self.speeds.size > 1 else []
        rows += [] if self.omegas is None else [("whirls", "frequency", self.omegas, whirl)]
        found = {}
        for does, what, points, x in rows:
            first, last = points[0], points[-1]
            least, most = distance_to(x, first, last), -distance_to(x, last, last)
            found[f"least {what}"] = Margin(least, "rad/s", f"{does} slower than the first {what} of its table")
            found[f"largest {what}"] = Margin(most, "rad/s", f"{does} faster than the last {what} of its table")
        return found


def _row_faults(name, row, least):
    """Faults of points of a table."""
    number = {1: "one", 2: "two"}[least]
    return faults_if(
        (row.ndim != 1 or row.size < least, f"{name} must be a row of at least {number}"),
        (any_concrete(lambda x: ~(np.diff(x) > 0), row), f"{name} must rise"),
    )


def _between(points, rows, x):
    """The cubic spline (m,) of rows (k, m) at x (), constant beyond the points."""
    return hermite(points, rows, spline_slopes(points, rows), jnp.clip(x, points[0], points[-1]))


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
