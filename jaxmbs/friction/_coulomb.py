"""Smooth Coulomb friction, with a bump of static friction."""

import equinox as eqx
import jax.numpy as jnp

from ..runtime import as_array
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractFriction, optional
from ._curves import tanh_over


class SmoothCoulomb(AbstractFriction):
    """Smooth Coulomb friction: below the transition speed the surfaces creep in place of sticking.

    The coefficient is `(dynamic + (static - dynamic) exp(-(s / stribeck_speed)^2)) tanh(s / transition_speed)` at a
    slip s.  It is smooth in the velocity vector, at rest too, and always dissipates.

    Attributes:
        dynamic: coefficient of sliding friction >= 0.
        static: coefficient at breakaway >= dynamic; None for the same.
        transition_speed: slip near which friction reaches its limit, > 0 [m/s].
        stribeck_speed: slip over which static friction fades, > 0 [m/s]; None for ten times `transition_speed`.
    """

    dynamic: Convertible[Scalar] = eqx.field(converter=as_array)
    static: Convertible[Scalar | None] = eqx.field(converter=optional, default=None)
    transition_speed: Convertible[Scalar] = eqx.field(converter=as_array, default=1e-3)
    stribeck_speed: Convertible[Scalar | None] = eqx.field(converter=optional, default=None)

    def coefficient(self, speed: ScalarLike) -> Scalar:
        """Friction over load at a speed of slip [m/s]."""
        return self._sliding(speed**2) * jnp.tanh(speed / self.transition_speed)

    def resistance(self, square: ScalarLike) -> Scalar:
        """Friction over load and speed [s/m], from the square of the speed."""
        scaled = square / self.transition_speed**2
        return self._sliding(square) / self.transition_speed * tanh_over(scaled)

    def _sliding(self, square):
        """Coefficient beyond the transition."""
        if self.static is None:
            return self.dynamic
        fades = 10.0 * self.transition_speed if self.stribeck_speed is None else self.stribeck_speed
        return self.dynamic + (self.static - self.dynamic) * jnp.exp(-square / fades**2)
