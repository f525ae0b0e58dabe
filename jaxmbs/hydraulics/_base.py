"""Interfaces of hydraulic elements: nodes with a pressure, and elements with ports between nodes.

They are blocks: a node turns the sum of the flows into it to the rate of its pressure, an element turns the pressures
at its ports to flows.  Pressures are states, so that a circuit has no algebraic loop.  Pressures are relative to the
atmosphere [Pa], flows are of volume [m^3/s].
"""

import abc
from collections.abc import Callable
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..blocks import AbstractBlock
from ..forces._element_bonds import ElementBonds, fluid
from ..forces._fields import number
from ..forces._hydraulic_cylinder import ATMOSPHERE, EMPTY
from ..forces._internal_state import InternalState, States
from ..forces._validity import Margin
from ..typing import Scalar, ScalarLike


class AbstractNode(AbstractBlock):
    """A place of one pressure where ports are joined: its output is that pressure [Pa]."""

    @property
    def is_feedthrough(self) -> bool:
        """False: the pressure is a state, or a constant."""
        return False

    @abc.abstractmethod
    def bonds(self, flow: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """Bonds of its graph, "0:pressure" being its junction, with the flow that enters it [m^3/s]."""

    def stored_energy(self, s: States) -> Scalar:
        """Energy stored at its states [J]."""
        return jnp.zeros(())


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

    def validity(self, s: States, t: ScalarLike) -> dict[str, Margin]:
        """Absolute pressure [Pa]: oil that is pulled apart fills with vapour, which is not in the model."""
        return {"pressure": Margin(s["p"] + ATMOSPHERE, "Pa", EMPTY)}

    def stored(self, p: ScalarLike) -> Scalar:
        """Energy [J] at pressure p, the integral of `p capacity(p)` from none."""
        p = number(p)
        return integral(lambda q: q * self.capacity(q), jnp.zeros_like(p), p)

    def stored_energy(self, s: States) -> Scalar:
        """Energy [J] at its pressure."""
        return self.stored(s["p"])

    def bonds(self, flow: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """The oil is a store: its flow is capacity times rate of the pressure."""
        p = s["p"]
        taken = self.capacity(p) * self.rate(flow, s, t)["p"]
        return {"port:circuit -> 0:pressure": fluid(p, flow), "0:pressure -> C:oil": fluid(p, taken)}


class AbstractHydraulicElement(AbstractBlock):
    """An element between nodes: flows from the pressures at its `ports`, and a signal where it takes one.

    `signal`: "none", "optional" or "needed".  `port_flows` are, of each port, the entry of the output and the sign
    with which it flows out of the element into the port's node. `outputs` is the number of its outputs where some
    are no flows.
    """

    ports: ClassVar[tuple[str, ...]]
    port_flows: ClassVar[tuple[tuple[int, int], ...]]
    signal: ClassVar[str] = "none"
    outputs: ClassVar[int] = 0

    @property
    def num_outputs(self) -> int:
        """Number of the entries of its output."""
        return max(self.outputs, 1 + max(entry for entry, _ in self.port_flows))

    def split(self, u: Any) -> tuple[Float[Array, " ports"], Any]:
        """Pressures at the ports, and the signal or None, from the input of the block.

        Raises: ValueError for a signal of several numbers.
        """
        given, n = jnp.atleast_1d(u), len(self.ports)
        if given.shape[0] > n + 1:
            raise ValueError(f"its signal is one number, got {given.shape[0] - n}")
        return given[:n], given[n] if given.shape[0] > n else None

    def bonds(self, u: Any, s: States, t: ScalarLike) -> ElementBonds:
        """Bonds of the graph inside the element by name; "port:a" is its port a.

        An element that does not say is a resistor with all its ports.
        """
        (pressures, _), flows = self.split(u), jnp.atleast_1d(self.output(u, s, t))
        return {
            f"port:{port} -> R:resistance": fluid(p, -sign * flows[entry])
            for port, p, (entry, sign) in zip(self.ports, pressures, self.port_flows, strict=True)
        }

    def stored_energy(self, s: States) -> Scalar:
        """Energy stored at its states [J]."""
        return jnp.zeros(())


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

    def bonds(self, u: Any, s: States, t: ScalarLike) -> ElementBonds:
        """One flow through both ports, and the power that the pressure difference loses."""
        (a, b), _ = self.split(u)
        flow = self.output(u, s, t)
        return through(a, b, flow) | {"1:flow -> R:resistance": fluid(a - b, flow)}


def through(a: Scalar, b: Scalar, flow: Scalar) -> ElementBonds:
    """Bonds of the ports of an element through which one flow passes."""
    return {"port:a -> 1:flow": fluid(a, flow), "1:flow -> port:b": fluid(b, flow)}


def integral(f: Callable, low: Scalar, high: Scalar) -> Scalar:
    """Integral of a smooth function of one number by 16 points of Gauss and Legendre."""
    points, weights = np.polynomial.legendre.leggauss(16)
    half = (high - low) / 2.0
    at = low + half * jnp.asarray(points + 1.0, half.dtype)
    return half * jnp.dot(jnp.asarray(weights, half.dtype), jax.vmap(f)(at))
