"""Friction with bristles in the tangent plane of a contact."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, negative, not_positive
from ..forces._fields import number, value_faults
from ..typing import Convertible, Scalar


class ContactLuGre(eqx.Module):
    """LuGre friction of a contact: bristles that bend by z in the tangent plane, pressed by the normal force N.

    `dz/dt = v - |v| z sigma0 / g(v)`, `g = mu (1 + (static_ratio - 1) exp(-(v / transition_speed)^2))`, and the
    friction is `N (sigma0 z + sigma1 dz/dt + sigma2 v)` against the sliding velocity v.  Unlike `DryFriction` it
    holds at rest, after a presliding of about `mu / sigma0`.  Apart the bristles straighten within the time that
    the transition speed takes for that way.  Stiff: take an implicit solver, or short steps.

    Attributes:
        mu: coefficient of sliding friction > 0.
        sigma0: stiffness of the bristles over the normal force > 0 [1/m].
        sigma1: their damping over the normal force >= 0 [s/m].
        sigma2: viscous friction over the normal force >= 0 [s/m].
        static_ratio: breakaway over sliding friction, >= 1.
        transition_speed: Stribeck speed, over which the bump fades, > 0 [m/s].

    Source: Canudas de Wit, Olsson, Astrom and Lischinsky (1995).
    """

    mu: Convertible[Scalar] = eqx.field(converter=number)
    sigma0: Convertible[Scalar] = eqx.field(converter=number)
    sigma1: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    sigma2: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    static_ratio: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    transition_speed: Convertible[Scalar] = eqx.field(converter=number, default=1e-3)

    def rate(self, bend: Float[Array, "k 3"], sliding: Float[Array, "k 3"]) -> Float[Array, "k 3"]:
        """Rates [m/s] of bends [m] of surfaces that touch, at sliding velocities [m/s]."""
        square = jnp.sum(sliding * sliding, axis=1, keepdims=True)
        moves = square > 0.0
        speed = jnp.where(moves, jnp.sqrt(jnp.where(moves, square, 1.0)), 0.0)
        bump = 1.0 + (self.static_ratio - 1.0) * jnp.exp(-square / self.transition_speed**2)
        return sliding - speed * bend * self.sigma0 / (self.mu * bump)

    def rate_apart(self, bend: Float[Array, "k 3"]) -> Float[Array, "k 3"]:
        """Rates [m/s] of bends [m] of surfaces that are apart."""
        return -bend * self.transition_speed * self.sigma0 / self.mu

    def coefficient(
        self, bend: Float[Array, "k 3"], rate: Float[Array, "k 3"], sliding: Float[Array, "k 3"]
    ) -> Float[Array, "k 3"]:
        """Friction over normal force, along the sliding velocities."""
        return self.sigma0 * bend + self.sigma1 * rate + self.sigma2 * sliding

    def faults(self) -> list[str]:
        """It dissipates."""
        return value_faults(self) + faults_if(
            (not_positive(self.mu), "mu must be positive"),
            (not_positive(self.sigma0), "sigma0 must be positive"),
            (negative(self.sigma1), "sigma1 must not be negative"),
            (negative(self.sigma2), "sigma2 must not be negative"),
            (any_concrete(lambda r: r < 1, self.static_ratio), "static_ratio must be at least 1"),
            (not_positive(self.transition_speed), "transition_speed must be positive"),
        )
