"""A spring that yields."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import any_concrete, faults_if, not_positive
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._element_bonds import ElementBond, ElementBonds
from ._fields import number
from ._internal_state import InternalState, States


class ElastoPlastic(AbstractScalarLaw):
    """Spring that yields at a force and hardens linearly, smooth (Bouc and Wen's model without decay).

    `effort = -k (r (x - x0) + (1 - r) z)` with `dz/dt = v - (|v| z + v |z|) |z / z_y|^(n - 1) / (2 z_y)`, where
    `z_y = yield_force / k`: elastic below, plastic with stiffness r k beyond. The elastic part z of the stretch is
    its internal state "elastic". Source: Bouc (1967), Wen (1976).

    Attributes:
        stiffness: k > 0 [N/m or N m/rad].
        yield_force: > 0 [N or N m].
        hardening: stiffness beyond yield over k, r between 0 and 1.
        sharpness: n >= 2 of the knee.
        free_length: x0 [m or rad].
    """

    stiffness: Convertible[Scalar] = eqx.field(converter=number)
    yield_force: Convertible[Scalar] = eqx.field(converter=number)
    hardening: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    sharpness: Convertible[Scalar] = eqx.field(converter=number, default=4.0)
    free_length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        limit = self.yield_force / self.stiffness
        return {"elastic": InternalState((), "m or rad", limit, limit)}

    @property
    def holds(self) -> tuple[str, ...]:
        """Its elastic stretch, which plastic stretch leaves at any value."""
        return ("elastic",)

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """The elastic share of the velocity [m/s or rad/s]."""
        z, limit = s["elastic"], self.yield_force / self.stiffness
        size = jnp.abs(z) / limit
        # x^p has no derivative by p at zero
        knee = jnp.where(size > 0.0, jnp.where(size > 0.0, size, 1.0) ** (self.sharpness - 1.0), 0.0)
        return {"elastic": v - 0.5 * (jnp.abs(v) * z + v * jnp.abs(z)) * knee / limit}

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`-k (r (x - x0) + (1 - r) z)` [N or N m]."""
        r = self.hardening
        return -self.stiffness * (r * (x - self.free_length) + (1.0 - r) * s["elastic"])

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """`k/2 (r (x - x0)^2 + (1 - r) z^2)` [J]."""
        r = self.hardening
        return self.stiffness / 2.0 * (r * jnp.square(x - self.free_length) + (1.0 - r) * jnp.square(s["elastic"]))

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """The hardening spring, beside an elastic spring and what yields at the force that they share."""
        r, elastic = self.hardening, self.rate(x, v, s, t)["elastic"]
        force = self.stiffness * (1.0 - r) * s["elastic"]
        return {
            "1:port -> C:hardening": ElementBond(self.stiffness * r * (x - self.free_length), v),
            "1:port -> 0:force": ElementBond(force, v),
            "0:force -> C:spring": ElementBond(force, elastic),
            "0:force -> R:yield": ElementBond(force, v - elastic),
        }

    def faults(self) -> list[str]:
        """Signs and ranges of its numbers."""
        outside = any_concrete(lambda r: (r < 0) | (r > 1), self.hardening)
        return super().faults() + faults_if(
            (not_positive(self.stiffness), "stiffness must be positive"),
            (not_positive(self.yield_force), "yield_force must be positive"),
            (outside, "hardening must lie between 0 and 1"),
            (any_concrete(lambda n: n < 2, self.sharpness), "sharpness must be at least 2"),
        )
