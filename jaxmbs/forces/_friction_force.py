"""Friction of a given load, as a force law of its own."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp

from ..checks import faults_if, negative, not_positive
from ..drawings import Drawing, Symbol
from ..friction._places import as_friction, place_faults
from ..typing import Convertible, Scalar, ScalarLike, WordedError
from ._base import AbstractScalarLaw
from ._element_bonds import ElementBond, ElementBonds
from ._fields import number
from ._internal_state import InternalState, States


class FrictionForce(AbstractScalarLaw):
    """Friction under a load that is given: `effort = -radius (load mu(s) + drag(s))` at the slip s = radius v.

    On a sliding joint v is the rate of its coordinate; on a hinge give the radius at which it rubs.  Between two
    points it is the rate of their distance, as of the seals of a strut, and the effort lies along their line.  With a
    load of one, the default, the coefficient of the model is the force.

    A smooth model creeps at rest.  One with bristles, `friction.LuGre`, sticks, breaks away and slides; their bend is
    the internal state "bristle" [m].  It is stiff: take an implicit solver, or loose tolerances.

    Attributes:
        friction: a model of `jaxmbs.friction`, or the coefficient of its `SmoothCoulomb`.
        load: that presses the surfaces >= 0 [N].
        radius: of the slip > 0 [m]; one for a slide.
    """

    friction: WordedError[Any] = eqx.field(converter=as_friction)
    load: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    radius: Convertible[Scalar] = eqx.field(converter=number, default=1.0)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """The bend of bristles, where the model has them."""
        model = self.friction
        return {"bristle": InternalState((), "m", model.bend_scale, model.largest_bend)} if self.stores else {}

    @property
    def holds(self) -> tuple[str, ...]:
        """Its bristles."""
        return ("bristle",) if self.stores else ()

    @property
    def stores(self) -> bool:
        """True for bristles, which bend."""
        return self.friction.has_bristles

    @property
    def has_bonds(self) -> bool:
        """True for bristles; a smooth model is a resistor."""
        return self.friction.has_bristles

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rate of the bend [m/s]."""
        return {"bristle": self._bristles(v, s)[2][0]} if self.stores else {}

    def effort(self, x: ScalarLike, v: ScalarLike, *s_and_t: Any) -> Scalar:
        """Friction against the flow [N or N m], of (x, v, t), with bristles of (x, v, s, t)."""
        if self.stores:
            slip, bend, rate = self._bristles(v, s_and_t[0])
            return -self.radius * self.load * self.friction.traction(bend, rate, slip)[0]
        slip = self.radius * v
        resistance, drag = self.load * self.friction.resistance(slip * slip), self.friction.drag(slip * slip)
        resistance = resistance if drag is None else resistance + drag
        return -self.radius * resistance * slip

    def potential(self, x: ScalarLike, *s_and_t: Any) -> Scalar:
        """Energy of bent bristles [J]."""
        if not self.stores:
            return jnp.zeros((), jnp.result_type(x, float))
        return self.load * self.friction.energy(jnp.asarray(s_and_t[0]["bristle"])[None])

    def bonds(self, x: ScalarLike, v: ScalarLike, *s_and_t: Any) -> ElementBonds:
        """Bristles that bend and slip at the force that they share, and the viscous part beside them; a smooth model
        has none."""
        if not self.stores:
            return {}
        (slip, bend, rate), at_radius = self._bristles(v, s_and_t[0]), self.radius * self.load
        both = at_radius * self.friction.bristle_force(bend, rate)[0]
        spring = at_radius * jax.grad(self.friction.energy)(bend)[0]
        bending = rate[0] / self.radius
        return {
            "1:port -> R:viscous": ElementBond(at_radius * self.friction.viscous_force(slip)[0], v),
            "1:port -> 0:contact": ElementBond(both, v),
            "0:contact -> R:slip": ElementBond(both, v - bending),
            "0:contact -> 1:bending": ElementBond(both, bending),
            "1:bending -> C:bristles": ElementBond(spring, bending),
            "1:bending -> R:bristles": ElementBond(both - spring, bending),
        }

    def _bristles(self, v, s):
        """Slip, bend and its rate, (1,) each."""
        slip, bend = (jnp.asarray(x)[None] for x in (self.radius * v, s["bristle"]))
        return slip, bend, self.friction.rate(bend, slip)

    def drawing(self) -> Drawing:
        """A damper."""
        return (Symbol("damper"),)

    def faults(self) -> list[str]:
        """Those of the model; the load presses."""
        return [
            *place_faults(self.friction, "a force law"),
            *super().faults(),
            *faults_if(
                (negative(self.load), "load must not be negative"),
                (not_positive(self.radius), "radius must be positive"),
            ),
        ]
