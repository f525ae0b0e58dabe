"""A pipe or hose whose oil has inertia and friction."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..checks import faults_if, negative, not_positive
from ..forces._element_bonds import ElementBonds, fluid
from ..forces._fields import number
from ..forces._internal_state import InternalState, States
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractTwoPort, through

#: Reynolds number at which the laminar friction of a smooth round pipe equals Blasius' turbulent one.
CRITICAL_REYNOLDS = (64.0 / 0.3164) ** (4.0 / 3.0)


class Line(AbstractTwoPort):
    """Round pipe from a to b: its flow q is its internal state, `inertance dq/dt = p_a - p_b - friction(q)`.

    `inertance = density length / area`. The friction is that of Hagen and Poiseuille at small Reynolds numbers and of
    Blasius at large ones, with a smooth passage, and `loss density w |w| / 2` for bends and ends. The oil's
    compressibility is that of the volumes at its ends; a long line is a row of lines and volumes.

    Attributes:
        length, diameter: > 0 [m].
        density: of the oil > 0 [kg/m^3].
        viscosity: dynamic, > 0 [Pa s].
        loss: sum of the coefficients of bends and ends >= 0.
    """

    length: Convertible[Scalar] = eqx.field(converter=number)
    diameter: Convertible[Scalar] = eqx.field(converter=number)
    density: Convertible[Scalar] = eqx.field(converter=number, default=870.0)
    viscosity: Convertible[Scalar] = eqx.field(converter=number, default=0.04)
    loss: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    @property
    def is_feedthrough(self) -> bool:
        """False: the flow is a state."""
        return False

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"q": InternalState(unit="m^3/s", scale=self.area)}

    @property
    def area(self) -> Scalar:
        """Of the bore [m^2]."""
        return jnp.pi / 4.0 * jnp.square(self.diameter)

    @property
    def inertance(self) -> Scalar:
        """Pressure difference over the rate of the flow [kg/m^4]."""
        return self.density * self.length / self.area

    def friction(self, q: ScalarLike) -> Scalar:
        """Pressure difference [Pa] of a steady flow [m^3/s]."""
        w = q / self.area
        size = self.density * w * self.diameter / self.viscosity / CRITICAL_REYNOLDS
        laminar = 32.0 * self.viscosity * self.length / jnp.square(self.diameter) * w
        return laminar * (1.0 + size**6) ** 0.125 + self.loss * self.density / 2.0 * w * jnp.abs(w)

    def flow(self, drop: ScalarLike, signal: None = None) -> Scalar:
        """Not a function of the pressures.  Raises: TypeError."""
        raise TypeError("the flow of a Line is its internal state q")

    def rate(self, u: Any, s: States, t: ScalarLike) -> States:
        """Rate of the flow [m^3/s^2]."""
        (a, b), _ = self.split(u)
        return {"q": (a - b - self.friction(s["q"])) / self.inertance}

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """Flow from a to b [m^3/s]."""
        return s["q"]

    def stored_energy(self, s: States) -> Scalar:
        """Kinetic energy of the oil `inertance q^2 / 2` [J]."""
        return self.inertance * jnp.square(s["q"]) / 2.0

    def bonds(self, u: Any, s: States, t: ScalarLike) -> ElementBonds:
        """The oil is an inertia, its friction a resistor."""
        (a, b), q = self.split(u)[0], s["q"]
        return through(a, b, q) | {
            "1:flow -> I:oil": fluid(self.inertance * self.rate(u, s, t)["q"], q),
            "1:flow -> R:friction": fluid(self.friction(q), q),
        }

    def faults(self) -> list[str]:
        """Signs of its numbers."""
        return super().faults() + faults_if(
            (not_positive(self.length), "length must be positive"),
            (not_positive(self.diameter), "diameter must be positive"),
            (not_positive(self.density), "density must be positive"),
            (not_positive(self.viscosity), "viscosity must be positive"),
            (negative(self.loss), "loss must not be negative"),
        )
