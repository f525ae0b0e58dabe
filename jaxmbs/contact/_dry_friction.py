"""Dry friction in the tangent plane of a contact."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, negative, not_positive
from ..forces._fields import number, value_faults
from ..forces._friction_laws import brown_mcphee_over_speed, coulomb_over_speed
from ..typing import ArrayLike, Scalar


class DryFriction(eqx.Module):
    """Friction against the sliding velocity v, regularised: below `transition_speed` s the contact creeps.

    - "coulomb": coefficient `mu (1 + (static_ratio - 1) exp(-(v / 10 s)^2)) tanh(v / s)`.
    - "brown-mcphee": `mu (tanh(4 w) + (static_ratio - 1) w / (w^2/4 + 3/4)^2)`, w = v / s: its top is at s.

    Both are smooth in the velocity vector, at rest too, and always dissipate.

    Attributes:
        mu: coefficient of sliding friction >= 0.
        static_ratio: breakaway over sliding friction, >= 1.
        transition_speed: s > 0 [m/s].
        model: "coulomb" or "brown-mcphee" (static).

    Source: Brown and McPhee 2016.
    """

    mu: Scalar
    static_ratio: Scalar
    transition_speed: Scalar
    model: str = eqx.field(static=True)

    def __init__(
        self,
        mu: ArrayLike,
        static_ratio: ArrayLike = 1.0,
        transition_speed: ArrayLike = 1e-3,
        model: str = "coulomb",
    ) -> None:
        if model not in ("coulomb", "brown-mcphee"):
            raise ValueError(f"model must be 'coulomb' or 'brown-mcphee', not {model!r}")
        self.mu, self.static_ratio, self.model = number(mu), number(static_ratio), model
        self.transition_speed = number(transition_speed)

    def resistance(self, velocity: Float[Array, " 3"]) -> Scalar:
        """Friction over normal force and speed [s/m], at a sliding velocity (3,) [m/s]."""
        s, rise = self.transition_speed, self.static_ratio - 1.0
        square = jnp.sum(velocity * velocity) / s**2
        if self.model == "coulomb":
            return self.mu / s * coulomb_over_speed(square, rise)
        return self.mu / s * brown_mcphee_over_speed(square, rise)

    def faults(self) -> list[str]:
        """It dissipates."""
        return value_faults(self) + faults_if(
            (negative(self.mu), "mu must not be negative"),
            (any_concrete(lambda r: r < 1, self.static_ratio), "static_ratio must be at least 1"),
            (not_positive(self.transition_speed), "transition_speed must be positive"),
        )
