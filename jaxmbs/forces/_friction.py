"""Dry friction."""

import jax.numpy as jnp

from ..checks import any_concrete, faults_if, negative, not_positive
from ..typing import ArrayLike, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._fields import number


class CoulombFriction(AbstractScalarLaw):
    """Coulomb friction with a smooth start, Stribeck bump and viscous part.

    `effort = -limit (1 + (static_ratio - 1) exp(-(v / stribeck_speed)^2)) tanh(v / slip_speed) - viscous v`.
    It always dissipates and its slope at rest is finite: below `slip_speed` it creeps instead of sticking. On a
    joint v is the rate of its coordinate [m/s or rad/s]; between two points it is the rate of their distance
    [m/s], as of the seals of a strut, and the effort lies along their line [N].

    Attributes:
        effort_limit: sliding effort >= 0, normal force times coefficient [N or N m].
        static_ratio: breakaway over sliding effort, >= 1.
        slip_speed: rate at which friction is near its limit, > 0 [m/s or rad/s].
        viscous: part proportional to the rate, >= 0 [N s/m or N m s/rad].
        stribeck_speed: rate over which the bump fades, > 0 [m/s or rad/s]; default ten times `slip_speed`.
    """

    effort_limit: Scalar
    static_ratio: Scalar
    slip_speed: Scalar
    viscous: Scalar
    stribeck_speed: Scalar

    def __init__(
        self,
        effort_limit: ArrayLike,
        static_ratio: ArrayLike = 1.0,
        slip_speed: ArrayLike = 1e-3,
        viscous: ArrayLike = 0.0,
        stribeck_speed: ArrayLike | None = None,
    ) -> None:
        self.effort_limit = number(effort_limit)
        self.static_ratio = number(static_ratio)
        self.slip_speed = number(slip_speed)
        self.viscous = number(viscous)
        self.stribeck_speed = 10 * self.slip_speed if stribeck_speed is None else number(stribeck_speed)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Friction against the flow, a resistor of the bond graph."""
        bump = 1.0 + (self.static_ratio - 1.0) * jnp.exp(-((v / self.stribeck_speed) ** 2))
        return -self.effort_limit * bump * jnp.tanh(v / self.slip_speed) - self.viscous * v

    def faults(self) -> list[str]:
        """Every part dissipates."""
        return super().faults() + faults_if(
            (negative(self.effort_limit), "effort_limit must not be negative"),
            (any_concrete(lambda r: r < 1, self.static_ratio), "static_ratio must be at least 1"),
            (not_positive(self.slip_speed), "slip_speed must be positive"),
            (negative(self.viscous), "viscous must not be negative"),
            (not_positive(self.stribeck_speed), "stribeck_speed must be positive"),
        )
