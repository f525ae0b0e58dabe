"""Stops at the ends of a stroke."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jax import lax

from ..checks import any_concrete, faults_if, may_be_nonzero, negative
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._fields import number


class BumpStop(AbstractScalarLaw):
    """Nothing inside the gap `lower <= x <= upper`; beyond it `k d^n (1 + c max(rate of d, 0))`, d the depth.

    The damping factor (Hunt and Crossley) acts in compression only and grows from zero with the depth, so the
    stop never pulls and the effort has no jump; it has a corner where the rate of d changes its sign, so that
    derivatives of motions through a damped stop need tight tolerances, or a `transition` over which damping sets in
    smoothly: with it the rate v counts as `v^2 / sqrt(v^2 + transition^2)`. For n > 1 the effort is C1 at the
    edge, for n > 2 C2. Give one bound for a one-sided stop.

    On a joint x is its coordinate [m or rad]; between two points it is their distance [m], so a strut's stop in
    compression is `lower`, its shortest free length, and that in rebound `upper`.

    Attributes:
        stiffness: k >= 0 [N/m^n or N m/rad^n].
        lower: lower edge of the gap [m or rad], default none.
        upper: upper edge of the gap [m or rad], default none.
        exponent: n >= 1.
        damping: c >= 0 [s/m or s/rad].
        transition: rate up to which damping sets in [m/s or rad/s], 0 for the corner.
    """

    unbounded: ClassVar[tuple[str, ...]] = ("lower", "upper")

    stiffness: Convertible[Scalar] = eqx.field(converter=number)
    lower: Convertible[Scalar] = eqx.field(converter=number, default=-jnp.inf)
    upper: Convertible[Scalar] = eqx.field(converter=number, default=jnp.inf)
    exponent: Convertible[Scalar] = eqx.field(converter=number, default=2.0)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    transition: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Push of the lower stop minus push of the upper one."""
        return self._push(self.lower - x, -v) - self._push(x - self.upper, v)

    def potential(self, x: ScalarLike, t: ScalarLike) -> Scalar:
        """`k d^(n+1) / (n+1)` of the stop that is touched [J]."""
        n = self.exponent + 1.0
        return self.stiffness / n * (_power(self.lower - x, n) + _power(x - self.upper, n))

    @property
    def stores(self) -> bool:
        return may_be_nonzero(self.stiffness)

    @property
    def dissipates(self) -> bool:
        return may_be_nonzero(self.damping)

    def faults(self) -> list[str]:
        """A passive stop with a gap between its edges."""
        return super().faults() + faults_if(
            (negative(self.stiffness), "stiffness must not be negative"),
            (negative(self.damping), "damping must not be negative"),
            (negative(self.transition), "transition must not be negative"),
            (any_concrete(lambda n: n < 1, self.exponent), "exponent must be at least 1"),
            (any_concrete(lambda low, high: low > high, self.lower, self.upper), "lower must not exceed upper"),
        )

    def length_faults(self) -> list[str]:
        """An edge at a negative distance is never reached, or never left."""
        return faults_if(
            (
                any_concrete(_is_negative_edge, self.lower),
                "lower is a distance between points and must not be negative",
            ),
            (negative(self.upper), "upper is a distance between points and must not be negative"),
        )

    def _push(self, depth, rate):
        return self.stiffness * _power(depth, self.exponent) * (1.0 + self.damping * self._onset(rate))

    def _onset(self, rate):
        """Rate of compression, `max(rate, 0)`, with its corner rounded over the transition."""
        presses = (rate > 0) & (rate * rate > 0)  # of a square that underflows there is no root
        v = jnp.where(presses, rate, 1.0)
        return jnp.where(presses, v * v * lax.rsqrt(v * v + self.transition**2), 0.0)


def _is_negative_edge(edge):
    return (edge < 0) & (edge > -jnp.inf)


def _power(depth, exponent):
    """`max(depth, 0) ** exponent` with finite derivatives in both, also where the stop is free."""
    touching = depth > 0
    return jnp.where(touching, jnp.where(touching, depth, 1.0) ** exponent, 0.0)
