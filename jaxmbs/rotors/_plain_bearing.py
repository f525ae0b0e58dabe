"""Plain journal bearings, short or long: the forces of their films in closed form and their slopes."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax
from jaxtyping import Float

from ..errors import ModelError
from ..forces._validity import Margin
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import Convertible, ScalarLike
from ._parts import _check
from ._validity import distance_to

_ROUNDS = 60  # of bisection: the eccentricity is then known to rounding


class PlainBearing(eqx.Module):
    """A plain journal bearing, short or long against its diameter, under a steady load along -y.

    Pressure falls along the bearing alone (short: length below half of the diameter) or around it alone (long: length
    above twice the diameter); between these both carry more than the bearing does, of which results warn.  The film
    is where the gap narrows, half of the circle.  The journal rests at the eccentricity at which the film carries the
    load; stiffness and damping are the slopes of its forces there.
    Source: Ocvirk, Short-bearing approximation for full journal bearings, NACA TN 2808 (1952); Friswell and others,
    Dynamics of rotating machines (2010), 5.5; Sommerfeld (1904), half of its film, with squeeze.

    Attributes:
        station: its number, from 0 (static).
        diameter, length, clearance: radial clearance [m].
        viscosity: dynamic [Pa s]; load: [N].
        film: "short" or "long" (static).
    """

    station: int = eqx.field(static=True)
    diameter: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    length: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    clearance: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    viscosity: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    load: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)

    film: str = eqx.field(static=True, default="short")

    __repr__ = fields_repr

    def __check_init__(self) -> None:
        if self.film not in ("short", "long"):
            raise ModelError([f'film={self.film!r} must be "short" or "long"'], "the bearing")
        parts = ("diameter", "length", "clearance", "viscosity", "load")
        _check("the bearing", self.station, **{name: getattr(self, name) for name in parts})

    def film_force(self, place: Array, velocity: Array, speed: ScalarLike) -> Array:
        """Force (2,) [N] of the film on the journal, at its place (2,) [m] from the centre and velocity [m/s].

        NaN where the journal is on the wall or beyond.
        """
        c, size = self.clearance, jnp.sqrt(jnp.sum(place**2))
        radial = place / size
        around = jnp.stack([-radial[1], radial[0]])
        e, e_rate, turn = size / c, radial @ velocity / c, around @ velocity / size
        inward, along = self._film(e, e_rate, speed - 2.0 * turn)
        return self._unit * (along * around - inward * radial)

    @property
    def _unit(self):
        """Force over its part that depends on the eccentricity alone, and over the speed."""
        size = self.viscosity * 0.5 * self.diameter * self.length / self.clearance**2
        return size * (self.length**2 if self.film == "short" else 0.25 * self.diameter**2)

    def _film(self, e, e_rate, slip):
        """Forces against the eccentricity and across it, at its rate and at the speed less twice that of whirl."""
        left = 1.0 - e**2
        if self.film == "short":
            inward = slip * e**2 / left**2 + jnp.pi * e_rate * (1.0 + 2.0 * e**2) / (2.0 * left**2.5)
            return inward, slip * jnp.pi * e / (4.0 * left**1.5) + 2.0 * e * e_rate / left**2
        more = 2.0 + e**2
        squeezed = e_rate * (0.5 * jnp.pi - 8.0 / (jnp.pi * more)) / left**1.5
        inward = 12.0 * (slip * e**2 / (more * left) + squeezed)
        return inward, 6.0 * jnp.pi * slip * e / (more * jnp.sqrt(left)) + 24.0 * e * e_rate / (more * left)

    def eccentricity(self, speed: ScalarLike) -> Array:
        """Distance () of the journal from the centre over the clearance, at a speed () [rad/s]."""
        share = self.load / (self._unit * speed)

        def carried(e):
            inward, along = self._film(e, jnp.zeros_like(e), jnp.ones_like(e))
            return jnp.sqrt(inward**2 + along**2) - share

        def halve(ends, _):
            low, high = ends
            middle = 0.5 * (low + high)
            above = carried(middle) > 0.0
            return (jnp.where(above, low, middle), jnp.where(above, middle, high)), None

        start = jnp.zeros_like(share), jnp.ones_like(share)
        low, high = lax.stop_gradient(lax.scan(halve, start, None, length=_ROUNDS)[0])
        e = 0.5 * (low + high)
        value, slope = jax.jvp(carried, (e,), (jnp.ones_like(e),))
        return e - value / lax.stop_gradient(slope)

    def place(self, speed: ScalarLike) -> Array:
        """Place (2,) [m] of the journal at rest."""
        e = self.eccentricity(speed)
        inward, along = self._film(e, jnp.zeros_like(e), jnp.ones_like(e))
        attitude = jnp.arctan2(along, inward)  # from the load, in the sense of rotation
        return self.clearance * e * jnp.stack([jnp.sin(attitude), -jnp.cos(attitude)])

    def coefficients(self, speed: ScalarLike) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) at a speed () [rad/s]."""
        at, rest = self.place(speed), jnp.zeros(2, self.clearance.dtype)
        by_place, by_velocity = jax.jacfwd(self.film_force, (0, 1))(at, rest, speed)
        return -by_place, -by_velocity

    def validity(self, speed: ScalarLike) -> dict[str, Margin]:
        """Margin of the length to those that the film is for [m]."""
        if self.film == "short":
            most = 0.5 * self.diameter
            end = "is longer than half of its diameter, and its short film carries more than it does"
            return {"length": Margin(-distance_to(self.length, most, most), "m", end)}
        least = 2.0 * self.diameter
        end = "is shorter than twice its diameter, and its long film carries more than it does"
        return {"length": Margin(distance_to(self.length, least, least), "m", end)}
