"""A proportional or servo valve with four ways."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, not_positive
from ..forces._element_bonds import ElementBonds, fluid
from ..forces._fields import number
from ..forces._internal_state import States
from ..math._signed_root import signed_root, smooth_ramp
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractHydraulicElement

#: Ports of each edge, in the order of the openings.
EDGES = (("p", "a"), ("b", "t"), ("p", "b"), ("a", "t"))


class Valve(AbstractHydraulicElement):
    """Four-way proportional valve: ports p (supply), t (tank), a, b; its signal is the place of the spool, -1 to 1.

    A positive spool opens the edges from p to a and from b to t, a negative one those from p to b and from a to t. An
    edge passes `rated_flow opening sqrt(drop / rated_drop)`, laminar at small drops, with
    `opening = (|spool| - overlap) / (1 - overlap)`, 0 in the deadband and about 1 beyond the stroke. Its output is
    the flow out of it through (p, t, a, b).

    Attributes:
        rated_flow: of one edge at full stroke > 0 [m^3/s]; one number or four, of p-a, b-t, p-b, a-t.
        rated_drop: pressure difference across one edge at the rated flow > 0 [Pa].
        overlap: half of the deadband over the stroke, between -1 and 1; negative for a valve that is open in the
            middle.
        laminar: pressure difference below which the flow is laminar, > 0 [Pa].
        rounding: share of the stroke in which an edge begins to open, > 0: the opening has a continuous slope.
    """

    rated_flow: Convertible[Float[Array, "..."]] = eqx.field(converter=number)
    rated_drop: Convertible[Scalar] = eqx.field(converter=number)
    overlap: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    laminar: Convertible[Scalar] = eqx.field(converter=number, default=1e4)
    rounding: Convertible[Scalar] = eqx.field(converter=number, default=0.01)
    ports: ClassVar[tuple[str, ...]] = ("p", "t", "a", "b")
    port_flows: ClassVar[tuple[tuple[int, int], ...]] = ((0, 1), (1, 1), (2, 1), (3, 1))
    signal: ClassVar[str] = "needed"

    def openings(self, spool: ScalarLike) -> Float[Array, "4"]:
        """Openings of the edges p-a, b-t, p-b, a-t, 1 at full stroke."""
        travel = (jnp.stack([spool, spool, -spool, -spool]) - self.overlap) / (1.0 - self.overlap)
        return smooth_ramp(travel, self.rounding) - smooth_ramp(travel - 1.0 - self.rounding, self.rounding)

    def edge_flows(self, pressures: Float[Array, "4"], spool: ScalarLike) -> Float[Array, "4"]:
        """Flows of the edges p-a, b-t, p-b, a-t [m^3/s] at the pressures at p, t, a, b [Pa]."""
        p, t, a, b = pressures
        drops = jnp.stack([p - a, b - t, p - b, a - t])
        full = self.rated_flow * signed_root(drops, self.laminar) / signed_root(self.rated_drop, self.laminar)
        return self.openings(jnp.asarray(spool)) * full

    def flows(self, pressures: Float[Array, "4"], spool: ScalarLike) -> Float[Array, "4"]:
        """Flows out of the valve through p, t, a, b [m^3/s] at their pressures [Pa]."""
        p_a, b_t, p_b, a_t = self.edge_flows(pressures, spool)
        return jnp.stack([-p_a - p_b, b_t + a_t, p_a - a_t, p_b - b_t])

    def output(self, u: Any, s: States, t: ScalarLike) -> Float[Array, "4"]:
        """Flows out of the valve through p, t, a, b [m^3/s]."""
        pressures, spool = self.split(u)
        return self.flows(pressures, spool)

    def bonds(self, u: Any, s: States, t: ScalarLike) -> ElementBonds:
        """A resistor in each edge, between the junctions of the ports."""
        pressures, spool = self.split(u)
        at = dict(zip(self.ports, pressures, strict=True))
        out = dict(zip(self.ports, self.flows(pressures, spool), strict=True))
        bonds = {f"0:{port} -> port:{port}": fluid(at[port], out[port]) for port in self.ports}
        for (inlet, outlet), flow in zip(EDGES, self.edge_flows(pressures, spool), strict=True):
            edge = f"1:{inlet}-{outlet}"
            bonds[f"0:{inlet} -> {edge}"] = fluid(at[inlet], flow)
            bonds[f"{edge} -> R:{inlet}-{outlet}"] = fluid(at[inlet] - at[outlet], flow)
            bonds[f"{edge} -> 0:{outlet}"] = fluid(at[outlet], flow)
        return bonds

    def faults(self) -> list[str]:
        """Signs and ranges of its numbers."""
        return super().faults() + faults_if(
            (
                self.rated_flow.shape not in ((), (4,)),
                f"rated_flow is one number or four, got {self.rated_flow.shape}",
            ),
            (not_positive(self.rated_flow), "rated_flow must be positive"),
            (not_positive(self.rated_drop), "rated_drop must be positive"),
            (any_concrete(lambda x: abs(x) >= 1, self.overlap), "overlap must lie between -1 and 1"),
            (not_positive(self.laminar), "laminar must be positive"),
            (not_positive(self.rounding), "rounding must be positive"),
        )
