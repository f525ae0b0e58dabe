"""Friction of Brown and McPhee."""

import equinox as eqx
import jax.numpy as jnp

from ..runtime import as_array
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractFriction, optional
from ._curves import tanh_over


class BrownMcPhee(AbstractFriction):
    """Friction of Brown and McPhee, whose greatest value is at the transition speed.

    The coefficient is `dynamic tanh(4 w) + (static - dynamic) w / (w^2/4 + 3/4)^2`, w = s / transition_speed, at a
    slip s.

    Attributes:
        dynamic: coefficient of sliding friction >= 0.
        static: coefficient at breakaway >= dynamic; None for the same.
        transition_speed: slip of the greatest friction, > 0 [m/s].

    Source: Brown and McPhee 2016.
    """

    dynamic: Convertible[Scalar] = eqx.field(converter=as_array)
    static: Convertible[Scalar | None] = eqx.field(converter=optional, default=None)
    transition_speed: Convertible[Scalar] = eqx.field(converter=as_array, default=1e-3)

    def coefficient(self, speed: ScalarLike) -> Scalar:
        """Friction over load at a speed of slip [m/s]."""
        w = speed / self.transition_speed
        return self.dynamic * jnp.tanh(4.0 * w) + w * self._rise(w**2)

    def resistance(self, square: ScalarLike) -> Scalar:
        """Friction over load and speed [s/m], from the square of the speed."""
        scaled = square / self.transition_speed**2
        slides = 4.0 * self.dynamic * tanh_over(16.0 * scaled)
        return (slides + self._rise(scaled)) / self.transition_speed

    def _rise(self, scaled):
        """Static friction over the scaled speed."""
        return 0.0 if self.static is None else (self.static - self.dynamic) / (scaled / 4.0 + 0.75) ** 2
