"""Resonances of a rotor under unbalance: peak, amplification factor and separation margin as API 617 defines them."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Float

from ..checks import any_concrete
from ..errors import ModelError
from ..quantities import Quantity
from ..reports import Report, Reported
from ..runtime import as_array, jit
from ..typing import ArrayLike
from ._rotor import Rotor
from ._unbalance import orbit_of, unbalance_places, whirl_at
from ._validity import BearingValidity, bearing_validity, fault_of, tell

_GRID = 400  # speeds between which the peak is looked for
_ROUNDS = 60  # of golden section and bisection


class Resonance(Reported, eqx.Module):
    """A peak of the larger half axis of a station's orbit over the speed.

    Attributes:
        speed: () of the peak [rad/s]; amplitude: [m].
        below, above: () speeds at which the amplitude is 0.707 of it [rad/s]; NaN where it does not fall so far.
        validity: of the bearings' models, at both ends of the range.
    """

    speed: Float[Array, ""]
    amplitude: Float[Array, ""]
    below: Float[Array, ""]
    above: Float[Array, ""]
    validity: BearingValidity | None = None

    def report(self) -> Report:
        return Report(
            [
                Quantity("critical speed", self.speed, "rad/s"),
                Quantity("amplitude", self.amplitude, "m"),
                Quantity("amplification factor", self.amplification_factor, ""),
            ],
            fault=fault_of(self.validity),
        )

    @property
    def amplification_factor(self) -> Float[Array, ""]:
        """AF: the critical speed over the width of the peak at 0.707 of its height.

        Source: API 617 (2002), 1-2.6.1.5, figure 1-2.6-1; API RP 684 (2005).
        """
        return self.speed / (self.above - self.below)


def separation_margin(factor: ArrayLike, side: str) -> Float[Array, "..."]:
    """Required separation margin (...), a share of the nearest operating speed, by the amplification factor (...).

    None below a factor of 2.5.  Else `0.17 (1 - 1 / (AF - 1.5))` for a critical speed below the slowest operating
    speed, and `0.10 + 0.17 (1 - 1 / (AF - 1.5))` for one above the largest continuous speed.

    Args: side: "below" or "above" the operating speeds.

    Raises: ModelError.  Source: API 617 (2002), 1-2.6.2.10; API RP 684 (2005).
    """
    if side not in ("below", "above"):
        raise ModelError([f'side={side!r} must be "below" or "above"'], "the separation margin")
    factor = as_array(factor)
    if any_concrete(lambda x: ~(np.isfinite(x) & (x > 0)), factor):
        raise ModelError(["amplification factors must be positive and finite"], "the separation margin")
    blunt = factor < 2.5
    more = 0.17 * (1.0 - 1.0 / (jnp.where(blunt, 2.5, factor) - 1.5))
    return jnp.where(blunt, 0.0, more + (0.10 if side == "above" else 0.0))


def resonance(
    rotor: Rotor, between: tuple[ArrayLike, ArrayLike], unbalance: Mapping[int, ArrayLike | complex], station: int
) -> Resonance:
    """The largest peak of a station's orbit between two speeds [rad/s], with derivatives by every number.

    Args: unbalance: as of `unbalance_response`; station: whose orbit it is.

    NaN where the largest amplitude is at an end of the range.  Warns of bearings beyond the ends of their models.
    Raises: as `unbalance_response`.
    """
    low, high = (as_array(x) for x in between)
    if low.ndim or high.ndim or any_concrete(lambda a, b: ~((a >= 0) & (b > a) & np.isfinite(b)), low, high):
        raise ModelError(["between= takes two speeds [rad/s], the lower one first"], "the resonance")
    places, values = unbalance_places(rotor, unbalance)
    rotor.column(station)  # which judges it
    found = _resonance(rotor, low, high, places, values, int(station))
    tell("resonance", found.validity)
    return found


@jit
def _resonance(rotor, low, high, places, values, station):
    matrices = rotor.inertias()
    columns = np.array([rotor.column(station, axis) for axis in "xy"])

    def amplitude(speed, parts):
        rotor, matrices, values = parts
        return orbit_of(speed, whirl_at(rotor, matrices, speed, places, values)[columns]).major

    moving = rotor, matrices, values
    fixed, (a, b) = lax.stop_gradient(moving), lax.stop_gradient((low, high))
    share = jnp.asarray(np.linspace(0.0, 1.0, _GRID), a.dtype)
    grid = a + (b - a) * share
    heights = lax.map(lambda w: amplitude(w, fixed), grid)
    k = jnp.clip(jnp.argmax(heights), 1, _GRID - 2)
    inside = jnp.argmax(heights) == k
    slope = lambda w, parts: jax.jvp(lambda w: amplitude(w, parts), (w,), (jnp.ones_like(w),))[1]
    peak = _root(slope, grid[k - 1], grid[k + 1], moving, fixed, jnp.asarray(True))
    top = amplitude(peak, moving)
    part = lambda w, parts: amplitude(w, parts[0]) - parts[1] / jnp.sqrt(2.0).astype(w.dtype)
    both, both_fixed = (moving, top), (fixed, lax.stop_gradient(top))
    index, less = jnp.arange(_GRID), heights < lax.stop_gradient(top) / jnp.sqrt(2.0).astype(top.dtype)
    before = jnp.max(jnp.where(less & (index < k), index, -1))
    after = jnp.min(jnp.where(less & (index > k), index, _GRID))
    below = _root(part, grid[before], grid[jnp.minimum(before + 1, k)], both, both_fixed, before >= 0)
    last = jnp.minimum(after, _GRID - 1)
    above = _root(part, grid[jnp.maximum(last - 1, k)], grid[last], both, both_fixed, after < _GRID)
    none = jnp.asarray(jnp.nan, top.dtype)
    validity = bearing_validity(rotor.bearings, jnp.stack([low, high]))
    return Resonance(*(jnp.where(inside, x, none) for x in (peak, top, below, above)), validity)


def _root(function, a, b, moving, fixed, exists):
    """The zero () of `function(w, parts)` between two places by bisection, with its derivative by the parts."""

    def halve(ends, _):
        a, b, sign = ends
        middle = 0.5 * (a + b)
        same = jnp.sign(function(middle, fixed)) == sign
        return (jnp.where(same, middle, a), jnp.where(same, b, middle), sign), None

    a, b = lax.stop_gradient((a, b))
    (a, b, _), _ = lax.scan(halve, (a, b, jnp.sign(function(a, fixed))), None, length=_ROUNDS)
    w = lax.stop_gradient(0.5 * (a + b))
    value = function(w, moving)
    slope = lax.stop_gradient(jax.jvp(lambda w: function(w, fixed), (w,), (jnp.ones_like(w),))[1])
    return jnp.where(exists, w - value / jnp.where(slope == 0.0, 1.0, slope), jnp.nan)
