"""A tank, or any supply of constant pressure."""

from typing import Any

import equinox as eqx
from jaxtyping import Array

from ..forces._element_bonds import ElementBonds, fluid
from ..forces._fields import number
from ..forces._internal_state import States
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractNode


class Tank(AbstractNode):
    """Node of constant pressure: a tank, or a supply that no flow changes.

    Attributes:
        pressure: [Pa].
    """

    pressure: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """The pressure [Pa]."""
        return self.pressure

    def bonds(self, flow: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """A source of pressure, which supplies the flow that leaves it."""
        return {
            "port:circuit -> 0:pressure": fluid(self.pressure, flow),
            "0:pressure -> Se:tank": fluid(self.pressure, flow),
        }
