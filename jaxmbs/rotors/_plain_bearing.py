"""Short plain journal bearings: Ocvirk's film, its forces in closed form and their slopes."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax
from jaxtyping import Float

from ..runtime import as_array
from ..typing import Convertible
from ._parts import _check

_ROUNDS = 60  # of bisection: the eccentricity is then known to rounding


class PlainBearing(eqx.Module):
    """A plain journal bearing, short against its diameter, under a steady load along -y.

    Pressure falls along the bearing alone, the film breaks where it is negative (half Sommerfeld).  The journal rests
    at the eccentricity at which the film carries the load; stiffness and damping are the slopes of its forces there.
    Source: Ocvirk, Short-bearing approximation for full journal bearings, NACA TN 2808 (1952); Friswell and others,
    Dynamics of rotating machines (2010), 5.5.

    Attributes:
        station: its number, from 0 (static).
        diameter, length, clearance: radial clearance [m].
        viscosity: dynamic [Pa s]; load: [N].
    """

    station: int = eqx.field(static=True)
    diameter: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    length: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    clearance: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    viscosity: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    load: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)

    def __check_init__(self) -> None:
        parts = ("diameter", "length", "clearance", "viscosity", "load")
        _check("the bearing", self.station, **{name: getattr(self, name) for name in parts})

    def film_force(self, place: Array, velocity: Array, speed: Array) -> Array:
        """Force (2,) [N] of the film on the journal, at its place (2,) [m] from the centre and velocity [m/s].

        NaN where the journal is on the wall or beyond.
        """
        c, size = self.clearance, jnp.sqrt(jnp.sum(place**2))
        radial = place / size
        around = jnp.stack([-radial[1], radial[0]])
        e, e_rate, turn = size / c, radial @ velocity / c, around @ velocity / size
        factor = self.viscosity * 0.5 * self.diameter * self.length**3 / c**2
        left = 1.0 - e**2
        slip = speed - 2.0 * turn
        inward = slip * e**2 / left**2 + jnp.pi * e_rate * (1.0 + 2.0 * e**2) / (2.0 * left**2.5)
        along = slip * jnp.pi * e / (4.0 * left**1.5) + 2.0 * e * e_rate / left**2
        return factor * (along * around - inward * radial)

    def eccentricity(self, speed: Array) -> Array:
        """Distance () of the journal from the centre over the clearance, at a speed () [rad/s]."""
        unit = self.viscosity * speed * 0.5 * self.diameter * self.length**3 / (4.0 * self.clearance**2)
        share = self.load / unit

        def carried(e):
            return jnp.sqrt(16.0 * e**2 + jnp.pi**2 * (1.0 - e**2)) * e / (1.0 - e**2) ** 2 - share

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

    def place(self, speed: Array) -> Array:
        """Place (2,) [m] of the journal at rest."""
        e = self.eccentricity(speed)
        attitude = jnp.arctan2(jnp.pi * jnp.sqrt(1.0 - e**2), 4.0 * e)  # from the load, in the sense of rotation
        return self.clearance * e * jnp.stack([jnp.sin(attitude), -jnp.cos(attitude)])

    def coefficients(self, speed: Array) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) at a speed () [rad/s]."""
        at, rest = self.place(speed), jnp.zeros(2, self.clearance.dtype)
        by_place, by_velocity = jax.jacfwd(self.film_force, (0, 1))(at, rest, speed)
        return -by_place, -by_velocity
