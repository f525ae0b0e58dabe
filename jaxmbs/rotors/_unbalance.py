"""Response of a rotor to unbalance over the speed, its orbits and the loads of its bearings."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Complex, Float

from ..checks import any_concrete
from ..errors import ModelError
from ..math import _square as square
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, failures
from ..runtime import jit
from ..typing import ArrayLike
from ._rotor import Rotor
from ._validity import BearingValidity, bearing_validity, fault_of, tell
from ._whirl import complex_of, row_of_speeds


class Orbit(Reported, eqx.Module):
    """Ellipses of a station over the speed.

    Attributes:
        speeds: (S,) [rad/s].
        major: (S,) larger half axis [m]; minor: smaller one, negative where the orbit runs backward.
        angle: of the larger axis from x towards y [rad].
    """

    speeds: Float[Array, " S"]
    major: Float[Array, " S"]
    minor: Float[Array, " S"]
    angle: Float[Array, " S"]

    def report(self) -> Report:
        speed = (Axis("speed", np.asarray(self.speeds), "rad/s"),)
        return Report(
            [
                Quantity("major half axis", self.major, "m", speed),
                Quantity("minor half axis", self.minor, "m", speed),
                Quantity("angle", self.angle, "rad", speed),
            ]
        )

    @property
    def sense(self) -> Float[Array, " S"]:
        """1 forward, -1 backward, 0 a straight line."""
        return jnp.sign(self.minor)


class UnbalanceResponse(Reported, eqx.Module):
    """Complex amplitudes: motions are their real parts times `exp(i W t)`.

    Attributes:
        speeds: (S,) [rad/s].
        deflections: (S, N, 2) [m] of all stations along x and y.
        forces: (S, b, 2) [N] of the shaft on each bearing.
        validity: of the bearings' models.
    """

    speeds: Float[Array, " S"]
    deflections: Complex[Array, "S N 2"]
    forces: Complex[Array, "S b 2"]
    validity: BearingValidity | None = None

    def report(self) -> Report:
        speed, plane = Axis("speed", np.asarray(self.speeds), "rad/s"), Axis("axis", ("x", "y"))
        station, bearing = (Axis(n, tuple(map(str, range(k)))) for n, k in self._sizes)
        return Report(
            [
                Quantity("deflection", self.deflections, "m", (speed, station, plane)),
                Quantity("bearing force", self.forces, "N", (speed, bearing, plane)),
            ],
            fault=failures(jnp.all(jnp.isfinite(self.deflections), axis=(-2, -1)), "speeds without an answer")
            or fault_of(self.validity),
        )

    @property
    def _sizes(self):
        return ("station", self.deflections.shape[-2]), ("bearing", self.forces.shape[-2])

    def orbit(self, station: int) -> Orbit:
        """Ellipses of a station.  Raises: ModelError."""
        return orbit_of(self.speeds, self.deflections[:, self._place("station", station)])

    def bearing_orbit(self, bearing: int) -> Orbit:
        """Ellipses [N] of the force on a bearing, by its number among them.  Raises: ModelError."""
        return orbit_of(self.speeds, self.forces[:, self._place("bearing", bearing)])

    def _place(self, what, number):
        count = dict(self._sizes)[what]
        if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < count:
            raise ModelError([f"no {what} {number!r}: they are 0 to {count - 1}"], "the response")
        return int(number)


def orbit_of(speeds: Array, amplitudes: Array) -> Orbit:
    """The ellipses of complex amplitudes (S, 2) along x and y.

    `x + i y = F exp(i W t) + B exp(-i W t)`: the half axes are `|F| + |B|` and `|F| - |B|`.
    """
    x, y = amplitudes[..., 0], amplitudes[..., 1]
    forward, backward = (x + 1j * y) / 2.0, jnp.conj(x - 1j * y) / 2.0
    a, b = _size(forward), _size(backward)
    return Orbit(speeds, a + b, a - b, 0.5 * (jnp.angle(forward) + jnp.angle(backward)))


def _size(z):
    """Size of complex numbers, its slope at zero zero."""
    square = z.real**2 + z.imag**2
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)


def unbalance_response(
    rotor: Rotor, speeds: ArrayLike, unbalance: Mapping[int, ArrayLike | complex]
) -> UnbalanceResponse:
    """Steady whirl of a rotor under unbalance, over speeds (S,) [rad/s].

    Args: unbalance: station -> mass times eccentricity [kg m], complex for a phase: on the axis that is x at t = 0.

    Warns of bearings beyond the ends of their models.
    Raises: ModelError for unknown stations, none, or numbers that are not finite; ValueError for speeds.
    Source: Nelson and McVaugh (1976).
    """
    speeds = row_of_speeds(speeds)
    found = _response(rotor, speeds, *unbalance_places(rotor, unbalance))
    tell("unbalance_response", found.validity)
    return found


def unbalance_places(rotor: Rotor, unbalance: Mapping[int, ArrayLike | complex]) -> tuple[tuple[int, ...], Array]:
    """Stations (p,) and complex values (p,) of unbalance.  Raises: ModelError."""
    faults = [] if unbalance else ["unbalance= names no station"]
    last = rotor.shaft.stations.size - 1
    for station, value in unbalance.items():
        if isinstance(station, bool) or not isinstance(station, int | np.integer) or not 0 <= station <= last:
            faults.append(f"unbalance: no station {station!r}, they are 0 to {last}")
        if np.ndim(value) or isinstance(value, str) or any_concrete(lambda x: ~np.isfinite(x), value):
            faults.append(f"unbalance: at station {station!r} it must be one finite number [kg m]")
    if faults:
        raise ModelError(faults, "the response")
    places = tuple(int(k) for k in unbalance)
    values = jnp.stack([jnp.asarray(x, complex) for x in unbalance.values()])
    return places, values


@jit
def _response(rotor, speeds, places, values):
    matrices = rotor.inertias()
    q = lax.map(lambda speed: whirl_at(rotor, matrices, speed, places, values), speeds)
    forces = jax.vmap(lambda speed, q: _bearing_forces(rotor, speed, q))(speeds, q)
    stations = np.arange(rotor.shaft.stations.size)
    columns = np.array([[rotor.column(int(k), axis) for axis in "xy"] for k in stations])
    return UnbalanceResponse(speeds, q[:, columns], forces, bearing_validity(rotor.bearings, speeds))


def whirl_at(
    rotor: Rotor, matrices: tuple[Array, Array, Array], speed: Array, places: tuple[int, ...], values: Array
):
    """Complex amplitudes (n,) of all coordinates at a speed (), of unbalance values at stations."""
    M, G, K = matrices
    stiffness, damping = rotor.supports(speed)
    Z = lax.complex(K + stiffness - speed**2 * M, speed * (damping + speed * G))
    f = jnp.zeros(M.shape[0], Z.dtype)
    for station, value in zip(places, values, strict=True):
        x, y = (rotor.column(station, axis) for axis in "xy")
        force = value * complex_of(speed**2)
        f = f.at[x].add(force).at[y].add(-1j * force)
    return square.solve(Z, f)


def _bearing_forces(rotor, speed, q):
    forces = jnp.zeros((len(rotor.bearings), 2), q.dtype)
    for numbers, places, (stiffness, damping) in rotor.coefficients(speed):
        Z = lax.complex(stiffness, speed * damping)
        forces = forces.at[np.array(numbers)].set(jnp.einsum("bij,bj->bi", Z, q[places]))
    return forces
