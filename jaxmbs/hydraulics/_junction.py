"""Junctions: the sum of the flows of a circuit into each node, and into the chambers of a cylinder."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..blocks import AbstractBlock
from ..forces._element_bonds import Bonds
from ..forces._law_at import States
from ..forces._state_laws import InternalState
from ..forces._validity import Margin
from ..typing import Scalar, ScalarLike
from ._base import AbstractNode, AbstractStorage

#: Signs of the flows that enter one node, one for each entry of what the junction reads.
Weights = tuple[int, ...]


class Junction(AbstractNode):
    """A node with the signs by which the flows that it reads enter it."""

    node: AbstractStorage
    weights: Weights = eqx.field(static=True)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return self.node.internal_states

    def start(self, u: Any, t: ScalarLike) -> States:
        """As the node."""
        return self.node.start(0.0, t)

    def rate(self, u: Any, s: States, t: ScalarLike) -> States:
        """Rate of the pressure [Pa/s]."""
        return self.node.rate(_sums(u, (self.weights,))[0], s, t)

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """The pressure [Pa]."""
        return self.node.output(0.0, s, t)

    def validity(self, s: States, t: ScalarLike) -> dict[str, Margin]:
        """As the node."""
        return self.node.validity(s, t)

    @property
    def has_ends(self) -> bool:
        """As the node."""
        return self.node.has_ends

    def bonds(self, flow: ScalarLike, s: States, t: ScalarLike) -> Bonds:
        """As the node."""
        return self.node.bonds(flow, s, t)

    def stored_energy(self, s: States) -> Scalar:
        """As the node [J]."""
        return self.node.stored_energy(s)


class Inflow(AbstractBlock):
    """Flows into the chambers of a cylinder (chambers,) [m^3/s]."""

    weights: tuple[Weights, ...] = eqx.field(static=True)

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """Flows (chambers,)."""
        return _sums(u, self.weights)


def _sums(u, weights):
    """Sums (n,) of flows with the signs (n, flows)."""
    flows = jnp.atleast_1d(u)
    return jnp.asarray(np.array(weights, float), flows.dtype) @ flows
