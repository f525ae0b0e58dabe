"""Whirl speeds: roots of a rotor's small motions over the speed, with the sense of their orbits."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Complex, Float

from ..checks import any_concrete, check_count
from ..errors import ModelError
from ..math import _square as square
from ..math._eigen import eig
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, Reported, failures
from ..runtime import as_array, jit
from ..typing import ArrayLike
from ._rotor import Rotor
from ._validity import BearingValidity, bearing_validity, fault_of, tell

_MORE = 4  # roots beside those asked for: bearings that stiffen with the frequency move some in
_ROUNDS = 32  # of bisection of the frequency at which bearings are taken; a Newton step follows


class WhirlSpeeds(Reported, eqx.Module):
    """The lowest roots at each speed, ordered by whirl speed.

    Attributes:
        speeds: (S,) [rad/s].
        roots: (S, m) [rad/s], of each conjugate pair the one with positive imaginary part.
        sense: (S, m) of the orbit where it is largest: 1 a circle forward, -1 one backward, 0 a straight line.
        validity: of the bearings' models, at the frequency of each root.
    """

    speeds: Float[Array, " S"]
    roots: Complex[Array, "S m"]
    sense: Float[Array, "S m"]
    validity: BearingValidity | None = None

    def report(self) -> Report:
        axes = Axis("speed", np.asarray(self.speeds), "rad/s"), numbered("mode", self.roots.shape[-1])
        return Report(
            [
                Quantity("whirl speed", self.whirl, "rad/s", axes),
                Quantity("damping ratio", self.damping_ratios, "", axes),
                Quantity("sense", self.sense, "", axes),
            ],
            fault=failures(jnp.all(jnp.isfinite(self.roots), axis=-1), "speeds without roots")
            or fault_of(self.validity),
        )

    @property
    def whirl(self) -> Float[Array, "S m"]:
        """Whirl speeds [rad/s]."""
        return self.roots.imag

    @property
    def damping_ratios(self) -> Float[Array, "S m"]:
        """Negative real part over the size of each root; negative where the whirl grows."""
        return -self.roots.real / jnp.abs(self.roots)

    @property
    def log_decrements(self) -> Float[Array, "S m"]:
        """Logarithmic decrement of each root: `-2 pi Re / Im`."""
        return -2.0 * jnp.pi * self.roots.real / self.roots.imag


def whirl_speeds(rotor: Rotor, speeds: ArrayLike, count: int = 6) -> WhirlSpeeds:
    """The lowest whirl speeds of a rotor at speeds (S,) [rad/s].

    With gyroscopic terms, and with bearings as they are at each speed, and at the frequency of each root where they
    depend on it.  Roots without oscillation are left out.  A
    rotor that nothing holds has roots zero, which are not found: give it bearings.

    Args: count: number of roots.

    Warns of bearings beyond the ends of their models.
    Raises: ModelError, ValueError for speeds that are no row, a count that is none.
    Source: Nelson and McVaugh, The dynamics of rotor-bearing systems using finite elements (1976).
    """
    speeds = row_of_speeds(speeds)
    check_number_of_roots(rotor, count)
    found = WhirlSpeeds(speeds, *_whirl(rotor, speeds, count))
    tell("whirl_speeds", found.validity)
    return found


def check_number_of_roots(rotor: Rotor, count: int) -> None:
    """Raises: ModelError for a number of roots that is none, or above that of the coordinates."""
    check_count("count", count, 1)
    if count > rotor.num_coordinates:
        fault = f"count must be at most that of the coordinates, {rotor.num_coordinates}"
        raise ModelError([fault], "the question")


def row_of_speeds(speeds: ArrayLike) -> Array:
    """Speeds as an array (S,).  Raises: ValueError."""
    speeds = as_array(speeds)
    if speeds.ndim != 1 or not speeds.size or any_concrete(lambda x: ~np.isfinite(x), speeds):
        raise ValueError(f"speeds must be a row of finite numbers [rad/s], got shape {speeds.shape}")
    return speeds


@jit
def _whirl(rotor, speeds, count):
    M, G, K = rotor.inertias()

    def roots_at(speed, frequency, count):
        stiffness, damping = rotor.supports(speed, frequency)
        return lowest_roots(M, damping + speed * G, K + stiffness, count)

    def at(speed):
        roots, sense, _ = roots_at(speed, None, count)
        if not rotor.depends_on_frequency:
            return roots, sense
        more = min(count + _MORE, rotor.num_coordinates)
        own = lambda k: _at_own_frequency(lambda w: roots_at(speed, w, more), k, 2.0 * jnp.max(jnp.abs(roots)))
        return jax.vmap(own)(jnp.arange(count))

    roots, sense = lax.map(at, speeds)
    return roots, sense, bearing_validity(rotor.bearings, speeds, roots.imag)


def _at_own_frequency(roots_at, k, high):
    """The root () number k by whirl speed, of bearings as they are at its own frequency, and its sense.

    Args: roots_at: function of a frequency () [rad/s] that gives what `lowest_roots` does; high: a frequency above.
    """

    def root_at(w):
        """Root and sense; those that grow without oscillation count as the slowest."""
        roots, senses, slower = roots_at(w)
        place = jnp.maximum(k - slower, 0)
        return jnp.where(k >= slower, roots[place], 0.0), senses[place]

    def halve(ends, _):
        low, high, is_below = ends
        middle = jnp.where(is_below, 0.5 * (low + high), 2.0 * high)
        above = lax.stop_gradient(root_at(middle)[0].imag > middle)
        return (jnp.where(above, middle, low), jnp.where(above, high, middle), is_below | ~above), None

    high = lax.stop_gradient(high)
    is_below = lax.stop_gradient(root_at(high)[0].imag <= high)
    low, high, _ = lax.scan(halve, (jnp.zeros_like(high), high, is_below), None, length=_ROUNDS)[0]
    w = 0.5 * (low + high)
    root, sense = root_at(w)
    by_frequency = lax.stop_gradient(jax.jvp(lambda w: root_at(w)[0], (w,), (jnp.ones_like(w),))[1])
    late = (root.imag - w) / (1.0 - by_frequency.imag)  # a Newton step, which carries the derivatives
    return root + by_frequency * complex_of(late), sense


def lowest_roots(M: Array, C: Array, K: Array, count: int) -> tuple[Array, Array, Array]:
    """The lowest roots (count,) of `M q'' + C q' + K q = 0` with positive imaginary part, the sense of their orbits,
    and the number () of roots that grow without oscillation.

    Their inverses are what is computed, so that small elements cost no digits.
    """
    n = M.shape[0]
    both = square.solve(K, jnp.concatenate([M, C], axis=1))
    upper = jnp.concatenate([jnp.zeros_like(M), jnp.eye(n, dtype=M.dtype)], axis=1)
    inverses, shapes, _ = eig(jnp.concatenate([upper, -both]))
    swings = jnp.abs(inverses.imag) > 1e-9 * jnp.abs(inverses)
    chosen = jnp.where(swings & (inverses.imag < 0.0), jnp.abs(inverses), -1.0)  # 1 / root: signs change
    order = jnp.argsort(-lax.stop_gradient(chosen))[:count]
    roots = jnp.where(chosen[order] > 0.0, 1.0 / inverses[order], complex(np.nan, np.nan))
    rising = jnp.argsort(lax.stop_gradient(roots.imag), stable=True)
    diverging = jnp.sum(~swings & (inverses.real > 0.0))
    return roots[rising], sense_of(shapes[:n, order][:, rising]), diverging


def sense_of(shapes: Array) -> Array:
    """Sense (m,) of orbits (n, m) at the station where they are largest: 1 forward, -1 backward, 0 a line."""
    half = shapes.shape[0] // 2
    x, y = shapes[:half:2], shapes[half::2]
    size = jnp.abs(x) ** 2 + jnp.abs(y) ** 2
    area = 2.0 * (x * y.conj()).imag
    k = jnp.argmax(size, axis=0)[None]
    found, largest = (jnp.take_along_axis(v, k, axis=0)[0] for v in (area, size))
    return found / largest


def complex_of(x: Array) -> Array:
    """A real array as a complex one."""
    return jax.lax.complex(x, jnp.zeros_like(x))
