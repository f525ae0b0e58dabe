"""Interfaces of hydraulic elements: nodes with a pressure, and elements with ports between nodes.

They are blocks: a node turns the sum of the flows into it to the rate of its pressure, an element turns the pressures
at its ports to flows.  Pressures are states, so that a circuit has no algebraic loop.  Pressures are relative to the
atmosphere [Pa], flows are of volume [m^3/s].
"""

import abc
from typing import Any, ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..blocks import AbstractBlock
from ..forces._law_at import States
from ..forces._state_laws import InternalState
from ..typing import Scalar, ScalarLike


class AbstractNode(AbstractBlock):
    """A place of one pressure where ports are joined: its output is that pressure [Pa]."""

    @property
    def is_feedthrough(self) -> bool:
        """False: the pressure is a state, or a constant."""
        return False


class AbstractStorage(AbstractNode):
    """A node that takes up oil: `capacity(p) dp/dt` is the sum of the flows into it, its internal state is "p"."""

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {"p": InternalState(unit="Pa", scale=1e6)}

    @property
    @abc.abstractmethod
    def start_pressure(self) -> Scalar:
        """Pressure at the start [Pa]."""

    @abc.abstractmethod
    def capacity(self, p: ScalarLike) -> Scalar:
        """Volume of oil that a rise of the pressure takes up, at pressure p [m^3/Pa]."""

    def start(self, u: Any, t: ScalarLike) -> States:
        """The pressure at the start."""
        return {"p": self.start_pressure}

    def rate(self, u: Any, s: States, t: ScalarLike) -> States:
        """Rate of the pressure [Pa/s] from the flow u into the node [m^3/s]."""
        return {"p": u / self.capacity(s["p"])}

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """The pressure [Pa]."""
        return s["p"]


class AbstractHydraulicElement(AbstractBlock):
    """An element between nodes: flows from the pressures at its `ports`, and a signal where it takes one.

    `signal`: "none", "optional" or "needed".  `port_flows` are, of each port, the entry of the output and the sign
    with which it flows out of the element into the port's node.
    """

    ports: ClassVar[tuple[str, ...]]
    port_flows: ClassVar[tuple[tuple[int, int], ...]]
    signal: ClassVar[str] = "none"

    def split(self, u: Any) -> tuple[Float[Array, " ports"], Any]:
        """Pressures at the ports, and the signal or None, from the input of the block.

        Raises: ValueError for a signal of several numbers.
        """
        given, n = jnp.atleast_1d(u), len(self.ports)
        if given.shape[0] > n + 1:
            raise ValueError(f"its signal is one number, got {given.shape[0] - n}")
        return given[:n], given[n] if given.shape[0] > n else None


class AbstractTwoPort(AbstractHydraulicElement):
    """An element from port a to port b: its output is the flow from a to b [m^3/s]."""

    ports: ClassVar[tuple[str, ...]] = ("a", "b")
    port_flows: ClassVar[tuple[tuple[int, int], ...]] = ((0, -1), (0, 1))

    @abc.abstractmethod
    def flow(self, drop: ScalarLike, signal: Any = None) -> Scalar:
        """Flow from a to b [m^3/s] at the pressure difference `drop = p_a - p_b` [Pa]."""

    def output(self, u: Any, s: States, t: ScalarLike) -> Array:
        """Flow from a to b [m^3/s]."""
        (a, b), signal = self.split(u)
        return self.flow(a - b, signal)
