"""Normal force of a contact: a power of the depth (Hertz) with the damping of Hunt and Crossley."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, faults_if, negative
from ..forces._fields import number, value_faults
from ..forces._one_sided import one_sided, one_sided_slope
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike

_SOFT = 0.05  # damping factor below which it bends smoothly to zero, where bodies would be drawn together
_ROUNDS = 8  # of Newton's method for the restitution, which converges from above at every speed of approach


class HuntCrossley(eqx.Module):
    """Normal force `k d^n (1 + a rate of d)` of the depth d, never a pull.

    For n = 1.5 and `hertz_stiffness` it is the contact of Hertz.  The force has no jump, and its derivative has none
    for n > 1.  With a `transition` it starts by a smooth depth with three derivatives: 0 at the touch, the depth less
    half the transition beyond it.  Use it where n = 1, or where second derivatives are wanted.

    The damping leaves from an impact at speed v the share `restitution(v)` of it, about `1 - 2 a v / 3`.

    Attributes:
        stiffness: k >= 0 [N/m^n].
        exponent: n >= 1.
        damping: a >= 0 [s/m].
        transition: depth over which the force sets in, >= 0 [m].

    Source: Hunt and Crossley 1975.
    """

    stiffness: Convertible[Scalar] = eqx.field(converter=number)
    exponent: Convertible[Scalar] = eqx.field(converter=number, default=1.5)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    transition: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    __repr__ = fields_repr

    def energy(self, depth: ScalarLike) -> Scalar:
        """Stored energy [J] at a depth [m]."""
        n = self.exponent + 1.0
        return self.stiffness / n * _power(self._smooth_depth(depth)[0], n)

    def force(self, depth: ScalarLike, rate: ScalarLike) -> Scalar:
        """Force [N] that presses the bodies apart, at a depth [m] and its rate [m/s]."""
        smooth, slope = self._smooth_depth(depth)
        return self.stiffness * _power(smooth, self.exponent) * slope * one_sided(1.0 + self.damping * rate, _SOFT)

    def restitution(self, speed: ArrayLike) -> jax.Array:
        """Coefficient of restitution (...) of a free impact at a speed of approach (...) >= 0 [m/s].

        It follows from the damping alone: `v/a - ln(1 + a v)/a^2` is the same before and after, for every exponent.
        """
        x = self.damping * number(speed)
        small = x < 1e-4
        x_safe = jnp.where(small, 1.0, x)
        wanted = x_safe - jnp.log1p(x_safe)
        y = jnp.minimum(x_safe, -jnp.expm1(-1.0 - wanted))  # both are above the root
        for _ in range(_ROUNDS):
            y = y - (-y - jnp.log1p(-y) - wanted) * (1.0 - y) / y
        return jnp.where(small, 1.0 - x * (2.0 / 3.0 - x * (4.0 / 9.0)), y / x_safe)

    @property
    def stores(self) -> bool:
        """True if it may be stiff."""
        return not any_concrete(lambda k: k == 0, self.stiffness)

    def faults(self) -> list[str]:
        """A passive force."""
        return value_faults(self) + faults_if(
            (negative(self.stiffness), "stiffness must not be negative"),
            (negative(self.damping), "damping must not be negative"),
            (negative(self.transition), "transition must not be negative"),
            (any_concrete(lambda n: n < 1, self.exponent), "exponent must be at least 1"),
        )

    def _smooth_depth(self, depth):
        """The smooth depth and its derivative by the depth."""
        half = self.transition / 2
        is_smooth = half > 0
        safe = jnp.where(is_smooth, half, 1.0)
        beyond, sharp = depth - half, depth > 0
        smooth = jnp.where(is_smooth, one_sided(beyond, safe), jnp.where(sharp, beyond, 0.0))
        return smooth, jnp.where(is_smooth, one_sided_slope(beyond, safe), jnp.where(sharp, 1.0, 0.0))


def hertz_stiffness(
    radii: Sequence[ScalarLike],
    moduli: Sequence[ScalarLike],
    poisson: Sequence[ScalarLike],
) -> Scalar:
    """Stiffness [N/m^1.5] of two elastic bodies with spherical surfaces, `4/3 E sqrt(r)`.

    Args:
        radii: of both [m]; `inf` of a plane, negative of a hollow: `1/r = 1/r1 + 1/r2` must be positive.
        moduli: Young's moduli [Pa], `inf` of a rigid body: `1/E = (1 - nu1^2)/E1 + (1 - nu2^2)/E2`.
        poisson: Poisson's ratios.

    Raises: ValueError where the surfaces do not touch in a point, and for moduli or ratios that no material has.
    Source: Hertz 1881.
    """
    r1, r2 = map(number, radii)
    curvature = 1.0 / r1 + 1.0 / r2
    softness = sum((1.0 - number(nu) ** 2) / number(E) for E, nu in zip(moduli, poisson, strict=True))
    wrong = faults_if(
        (any_concrete(lambda c: ~(c > 0) | ~np.isfinite(c), curvature), "1/r1 + 1/r2 of radii must be positive"),
        (any(any_concrete(lambda x: ~(x > 0), E) for E in moduli), "moduli must be positive"),
        (any(any_concrete(lambda x: ~((x > -1) & (x <= 0.5)), nu) for nu in poisson), "poisson: from -1 to 0.5"),
    )
    if wrong:
        raise ValueError("; ".join(wrong))
    return 4.0 / 3.0 / softness / jnp.sqrt(curvature)


def _power(depth, exponent):
    """`max(depth, 0) ** exponent` with finite derivatives in both, also apart."""
    touching = depth > 0
    return jnp.where(touching, jnp.where(touching, depth, 1.0) ** exponent, 0.0)
