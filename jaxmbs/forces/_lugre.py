"""Dry friction with bristles."""

import equinox as eqx
import jax.numpy as jnp

from ..checks import any_concrete, faults_if, negative, not_positive
from ..typing import Convertible, Scalar, ScalarLike
from ._element_bonds import Bonds, ElementBond
from ._fields import number
from ._friction_laws import bristle_rate
from ._state_laws import AbstractScalarStateLaw, InternalState, States


class LuGre(AbstractScalarStateLaw):
    """LuGre friction: bristles that bend by z, stick, break away and slide; presliding, stick-slip and Stribeck bump.

    `dz/dt = v - |v| z / g(v)` with `g = limit (1 + (static_ratio - 1) exp(-(v / stribeck_speed)^2)) / stiffness`, and
    `effort = -(stiffness z + damping dz/dt + viscous v)`. Unlike `CoulombFriction` it holds at rest. Stiff: take an
    implicit solver, or loose tolerances. Source: Canudas de Wit, Olsson, Astrom and Lischinsky (1995).

    Attributes:
        effort_limit: sliding effort > 0, normal force times coefficient [N or N m].
        static_ratio: breakaway over sliding effort, >= 1.
        bristle_stiffness: sigma_0 > 0 [N/m or N m/rad].
        bristle_damping: sigma_1 >= 0 [N s/m or N m s/rad].
        viscous: sigma_2 >= 0 [N s/m or N m s/rad].
        stribeck_speed: rate over which the bump fades, > 0 [m/s or rad/s].
    """

    effort_limit: Convertible[Scalar] = eqx.field(converter=number)
    bristle_stiffness: Convertible[Scalar] = eqx.field(converter=number)
    bristle_damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    static_ratio: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    viscous: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    stribeck_speed: Convertible[Scalar] = eqx.field(converter=number, default=1e-3)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        scale = self.effort_limit / self.bristle_stiffness
        return {"bristle": InternalState(unit="m or rad", scale=scale)}

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """`v - |v| z / g(v)` [m/s or rad/s]."""
        return {"bristle": bristle_rate(v, jnp.abs(v), s["bristle"], self._steady_bend(v))}

    def _steady_bend(self, v):
        bump = 1.0 + (self.static_ratio - 1.0) * jnp.exp(-((v / self.stribeck_speed) ** 2))
        return self.effort_limit * bump / self.bristle_stiffness

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """`-(sigma_0 z + sigma_1 dz/dt + sigma_2 v)` [N or N m]."""
        bending = self.rate(x, v, s, t)["bristle"]
        return -(self.bristle_stiffness * s["bristle"] + self.bristle_damping * bending + self.viscous * v)

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Energy of the bent bristles `sigma_0/2 z^2` [J]."""
        return self.bristle_stiffness / 2.0 * jnp.square(s["bristle"])

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Bonds:
        """Bristles that bend and slip at the force that they share, and the viscous part beside them."""
        bending = self.rate(x, v, s, t)["bristle"]
        spring, damper = self.bristle_stiffness * s["bristle"], self.bristle_damping * bending
        return {
            "1:port -> R:viscous": ElementBond(self.viscous * v, v),
            "1:port -> 0:contact": ElementBond(spring + damper, v),
            "0:contact -> R:slip": ElementBond(spring + damper, v - bending),
            "0:contact -> 1:bending": ElementBond(spring + damper, bending),
            "1:bending -> C:bristles": ElementBond(spring, bending),
            "1:bending -> R:bristles": ElementBond(damper, bending),
        }

    def faults(self) -> list[str]:
        """Every part dissipates."""
        return super().faults() + faults_if(
            (not_positive(self.effort_limit), "effort_limit must be positive"),
            (not_positive(self.bristle_stiffness), "bristle_stiffness must be positive"),
            (negative(self.bristle_damping), "bristle_damping must not be negative"),
            (any_concrete(lambda r: r < 1, self.static_ratio), "static_ratio must be at least 1"),
            (negative(self.viscous), "viscous must not be negative"),
            (not_positive(self.stribeck_speed), "stribeck_speed must be positive"),
        )
