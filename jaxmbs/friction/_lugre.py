"""Friction with bristles, LuGre."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import faults_if, not_positive
from ..runtime import as_array
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractBristles, optional


class LuGre(AbstractBristles):
    """LuGre friction: bristles that bend by z, stick, break away and slide; presliding, stick-slip, Stribeck curve.

    `dz/dt = v - |v| z sigma0 / g(v)`, `g = dynamic + (static - dynamic) exp(-(v / stribeck_speed)^2)`, and friction
    over load is `sigma0 z + sigma1 dz/dt + sigma2 v` at a slip v; in steady slip `g + sigma2 |v|`.  Unlike the
    smooth models it holds at rest, after a presliding of about `static / sigma0`.  Apart, bristles straighten within
    the time that the Stribeck speed takes for that way.  Stiff: take an implicit solver, or short steps.

    Attributes:
        dynamic: coefficient of sliding friction > 0.
        sigma0: stiffness of the bristles over the load > 0 [1/m].
        sigma1: their damping over the load >= 0 [s/m].
        sigma2: viscous friction over the load >= 0 [s/m].
        static: coefficient at breakaway >= dynamic; None for the same.
        stribeck_speed: slip over which static friction fades, > 0 [m/s].

    Source: Canudas de Wit, Olsson, Astrom and Lischinsky (1995).
    """

    dynamic: Convertible[Scalar] = eqx.field(converter=as_array)
    sigma0: Convertible[Scalar] = eqx.field(converter=as_array)
    sigma1: Convertible[Scalar] = eqx.field(converter=as_array, default=0.0)
    sigma2: Convertible[Scalar] = eqx.field(converter=as_array, default=0.0)
    static: Convertible[Scalar | None] = eqx.field(converter=optional, default=None)
    stribeck_speed: Convertible[Scalar] = eqx.field(converter=as_array, default=1e-3)

    def coefficient(self, speed: ScalarLike) -> Scalar:
        """Friction over load in steady slip at a speed [m/s]."""
        return self._sliding(speed**2) + self.sigma2 * speed

    @property
    def bend_scale(self) -> Scalar:
        """Bend of steady sliding [m]."""
        return self.dynamic / self.sigma0

    @property
    def largest_bend(self) -> Scalar:
        """Bend at breakaway [m]."""
        return self._sliding(jnp.zeros(())) / self.sigma0

    def rate(self, bend: Float[Array, " k"], slip: Float[Array, " k"]) -> Float[Array, " k"]:
        """Rate of the bend [m/s] at a slip [m/s]."""
        square = jnp.sum(slip * slip)
        moves = square > 0.0
        speed = jnp.where(moves, jnp.sqrt(jnp.where(moves, square, 1.0)), 0.0)
        return slip - speed * bend * self.sigma0 / self._sliding(square)

    def rate_apart(self, bend: Float[Array, " k"]) -> Float[Array, " k"]:
        """Rate of the bend [m/s] of surfaces that are apart."""
        return -bend * self.stribeck_speed * self.sigma0 / self.dynamic

    def bristle_force(self, bend: Float[Array, " k"], rate: Float[Array, " k"]) -> Float[Array, " k"]:
        """Stiffness and damping of the bristles, over the load."""
        return self.sigma0 * bend + self.sigma1 * rate

    def viscous_force(self, slip: Float[Array, " k"]) -> Float[Array, " k"]:
        """Viscous friction over the load."""
        return self.sigma2 * slip

    def energy(self, bend: Float[Array, " k"]) -> Scalar:
        """Energy of the bent bristles over the load [m]."""
        return self.sigma0 / 2.0 * jnp.sum(bend * bend)

    def faults(self) -> list[str]:
        """Bristles need a steady bend."""
        found = super().faults()
        return found or faults_if((not_positive(self.dynamic), "dynamic must be positive"))

    def _sliding(self, square):
        """Coefficient in steady slip, without the viscous part."""
        if self.static is None:
            return self.dynamic
        return self.dynamic + (self.static - self.dynamic) * jnp.exp(-square / self.stribeck_speed**2)
