"""A double-acting hydraulic cylinder, on a servo valve of its own or in a circuit."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, flag, may_be_nonzero, negative, not_positive
from ..drawings import Drawing, Symbol
from ..math._signed_root import signed_root
from ..typing import Convertible, Scalar, ScalarLike
from ._base import AbstractScalarLaw
from ._element_bonds import ElementBond, ElementBonds, fluid
from ._fields import as_law_function, number
from ._internal_state import InternalState, States
from ._signals import AbstractSignal, Constant, as_signal
from ._validity import Margin

#: Pressure of the atmosphere [Pa], from which pressures of oil count: below minus this the oil has turned to vapour.
ATMOSPHERE = 101325.0
EMPTY = "is below the pressure of vapour: its oil cavitates"


def _opening(value):
    """A signal of time from a signal or number; any other function is one of (x, v, t)."""
    return as_signal(value) if isinstance(value, AbstractSignal) or not callable(value) else as_law_function(value)


def _optional_signal(value):
    """A signal of time, or None where there is none."""
    return None if value is None else as_signal(value)


class HydraulicCylinder(AbstractScalarLaw):
    """Double-acting cylinder between two points, or along a joint, with its four-way valve.

    The chambers' pressures are its internal states "p0", which drives x up, and "p1":
    `V0 dp0/dt = E (Q0 - A0 v - leakage (p0 - p1))`, `V1 dp1/dt = E (Q1 + A1 v + leakage (p0 - p1))`, and
    `effort = A0 p0 - A1 p1 - damping v`. A positive opening a lets oil flow from the supply to chamber 0,
    `Q0 = a flow_gain sqrt(supply - p0)`, and from chamber 1 to the tank; a negative one the other way. At small
    pressure differences the flow is laminar, so that it is smooth. The oil's power counts as input.

    In a circuit it has no valve of its own: `b.hydraulic(..., ports={"a": "boom.p0", "b": "boom.p1"})` joins its
    chambers to other elements, whose flows are its `inflow`.

    Attributes:
        areas: (A0, A1) of the piston's faces > 0 [m^2].
        volumes: (V0, V1) of the chambers and lines > 0 [m^3], at x = `length` where `varying`.
        bulk_modulus: E > 0 of the oil [Pa].
        valve: opening as a number, a signal such as `Step`, or `function(x, v, t)`; 1 full open.
        flow_gain: flow of the open valve over the root of the pressure difference, >= 0 [m^3/s/Pa^0.5].
        supply, tank: pressures [Pa].
        leakage: past the piston, >= 0 [m^3/s/Pa]; damping: of the seals, >= 0 [N s/m].
        laminar: pressure difference below which the flow is laminar, > 0 [Pa].
        length: x at which the chambers have their `volumes` [m].
        varying: True where the chambers grow and shrink with x (static); by default their volumes are constant. Where
            one vanishes the rates are NaN, which ends a motion with a status.
        end_cushion: law of the stops at the ends of the stroke, such as a `BumpStop`, beside the oil; default none.
        inflow: flows (Q0, Q1) in place of a valve as a function of time [m^3/s]; a circuit drives it.
    """

    areas: Convertible[Float[Array, "2"]] = eqx.field(converter=number)
    volumes: Convertible[Float[Array, "2"]] = eqx.field(converter=number)
    bulk_modulus: Convertible[Scalar] = eqx.field(converter=number)
    valve: Convertible[Callable[..., Any]] = eqx.field(converter=_opening, default=0.0)
    flow_gain: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    supply: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    tank: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    leakage: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    laminar: Convertible[Scalar] = eqx.field(converter=number, default=1e4)
    length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    varying: bool = eqx.field(static=True, converter=flag("varying"), default=False)
    inflow: Convertible[Callable[..., Any] | None] = eqx.field(converter=_optional_signal, default=None)
    end_cushion: AbstractScalarLaw | None = None
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("valve", "inflow")

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {name: InternalState(unit="Pa", scale=1e6) for name in ("p0", "p1")}

    @property
    def holds(self) -> tuple[str, ...]:
        """Both pressures, of chambers that are known to be shut."""
        opening = self.valve.value if isinstance(self.valve, Constant) else 1.0
        is_shut = self.inflow is None and not (may_be_nonzero(opening) and may_be_nonzero(self.flow_gain))
        return ("p0", "p1") if is_shut else ()

    def drawing(self) -> Drawing:
        """A cylinder."""
        return (Symbol("cylinder"),)

    def start(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> States:
        """Pressures of the tank."""
        return {"p0": self.tank, "p1": self.tank}

    def chambers(self, x: ScalarLike) -> Float[Array, "2"]:
        """Volumes of the chambers [m^3]."""
        if not self.varying:
            return self.volumes
        volumes = self._volumes(x)
        return jnp.where(volumes > 0.0, volumes, jnp.nan)

    def _volumes(self, x):
        """Volumes that vary (2,), negative beyond the end of the stroke [m^3]."""
        return self.volumes + (x - self.length) * self.areas * jnp.array([1.0, -1.0])

    def flows(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Float[Array, "2"]:
        """Flows of the valve, or of a circuit, into the chambers [m^3/s]."""
        if self.inflow is not None:
            return number(self.inflow(t))
        p, openings = jnp.stack([s["p0"], s["p1"]]), self._openings(x, v, t)
        drop = jnp.where(openings > 0.0, self.supply - p, p - self.tank)
        return openings * self.flow_gain * signed_root(drop, self.laminar)

    def _openings(self, x, v, t):
        """Openings (2,) of the chambers: positive to the supply, negative to the tank."""
        given = (t,) if isinstance(self.valve, AbstractSignal) else (x, v, t)
        a = number(self.valve(*given))
        return jnp.stack([a, -a])

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rates of the pressures [Pa/s]."""
        past = self.leakage * (s["p0"] - s["p1"])
        inflow = self.flows(x, v, s, t) - (self.areas * v + past) * jnp.array([1.0, -1.0])
        rates = self.bulk_modulus * inflow / self.chambers(x)
        return {"p0": rates[0], "p1": rates[1]}

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """Force that drives x up [N]."""
        force = self.areas[0] * s["p0"] - self.areas[1] * s["p1"] - self.damping * v
        return force if self.end_cushion is None else force + self.end_cushion.effort(x, v, t)

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """Energy of the compressed oil `sum V p^2 / (2 E)`, and of the cushion [J]."""
        p = jnp.stack([s["p0"], s["p1"]])
        oil = jnp.sum(self.chambers(x) * jnp.square(p)) / (2.0 * self.bulk_modulus)
        return oil if self.end_cushion is None else oil + self.end_cushion.potential(x, t)

    def validity(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> dict[str, Margin]:
        """Absolute pressures [Pa], and volumes of the chambers where they vary [m^3]."""
        ends = {name: Margin(s[name] + ATMOSPHERE, "Pa", EMPTY) for name in ("p0", "p1")}
        if self.varying:
            left = self._volumes(x)
            ends["volume"] = Margin(left, "m^3", "has no volume left in its chamber", ("0", "1"))
        return ends

    def bonds(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> ElementBonds:
        """The valve's four edges, both chambers, the leakage between them and their pistons.

        Chambers that vary take in, with the oil that fills them, its energy of compression: that is exchanged.
        """
        leak = self.leakage * (s["p0"] - s["p1"])
        leakage = {
            "0:chamber0 -> 1:leakage": fluid(s["p0"], leak),
            "1:leakage -> R:leakage": fluid(s["p0"] - s["p1"], leak),
            "1:leakage -> 0:chamber1": fluid(s["p1"], leak),
            "1:port -> R:seals": ElementBond(self.damping * v, v),
        }
        return self._chamber_bonds(x, v, s, t) | leakage | self._cushion_bonds(x, v, t)

    def _chamber_bonds(self, x, v, s, t):
        bonds, flows, rates, volumes = {}, self.flows(x, v, s, t), self.rate(x, v, s, t), self.chambers(x)
        for k, side in enumerate((1.0, -1.0)):
            p, flow, filling = s[f"p{k}"], flows[k], side * self.areas[k] * v
            bonds |= self._inflow_bonds(k, p, flow, x, v, t)
            bonds[f"0:chamber{k} -> C:chamber{k}"] = fluid(p, volumes[k] / self.bulk_modulus * rates[f"p{k}"])
            bonds[f"0:chamber{k} -> TF:piston{k}"] = fluid(p, filling)
            bonds[f"TF:piston{k} -> 1:port"] = ElementBond(side * self.areas[k] * p, v)
            if self.varying:
                carried = jnp.square(p) / (2.0 * self.bulk_modulus)
                bonds[f"port:oil{k} -> C:chamber{k}"] = fluid(carried, filling)
        return bonds

    def _inflow_bonds(self, k, p, flow, x, v, t):
        """The oil that a circuit brings, or the edges of the valve."""
        if self.inflow is not None:
            return {f"port:circuit{k} -> 0:chamber{k}": fluid(p, flow)}
        from_supply = self._openings(x, v, t)[k] > 0.0
        return _edge("supply", k, self.supply, p, jnp.where(from_supply, flow, 0.0)) | _edge(
            "tank", k, self.tank, p, jnp.where(from_supply, 0.0, flow)
        )

    def _cushion_bonds(self, x, v, t):
        if self.end_cushion is None:
            return {}
        spring = jax.grad(self.end_cushion.potential)(number(x), t)
        rest = -self.end_cushion.effort(x, v, t) - spring
        kind = "Se" if self.end_cushion.is_source else "R"
        return {"1:port -> C:cushion": ElementBond(spring, v), f"1:port -> {kind}:cushion": ElementBond(rest, v)}

    def faults(self) -> list[str]:
        """Two chambers, and the signs of what they are made of."""
        if self.areas.shape != (2,) or self.volumes.shape != (2,):
            return [f"areas and volumes are those of two chambers, got {self.areas.shape} and {self.volumes.shape}"]
        has_valve = any_concrete(lambda gain: gain > 0, self.flow_gain)
        below = has_valve and any_concrete(lambda p, q: p < q, self.supply, self.tank)
        cushion = self.end_cushion
        if cushion is not None and (not isinstance(cushion, AbstractScalarLaw) or cushion.internal_states):
            return [f"end_cushion must be a law of one displacement without states, as BumpStop, not {cushion!r}"]
        return super().faults() + faults_if(
            (self.length.shape != (), "length must be one number"),
            (not_positive(self.areas), "areas must be positive"),
            (not_positive(self.volumes), "volumes must be positive"),
            (not_positive(self.bulk_modulus), "bulk_modulus must be positive"),
            (negative(self.flow_gain), "flow_gain must not be negative"),
            (negative(self.leakage), "leakage must not be negative"),
            (negative(self.damping), "damping must not be negative"),
            (not_positive(self.laminar), "laminar must be positive"),
            (below, "supply must not be below tank"),
            (has_valve and self.inflow is not None, "a cylinder with an inflow has no valve of its own: flow_gain=0"),
        )


def _edge(name, k, source, p, flow):
    """Bonds of an edge of the valve between a source of pressure and a chamber, which the flow enters."""
    junction = f"1:{name}{k}"
    return {
        f"Se:{name}{k} -> {junction}": fluid(source, flow),
        f"{junction} -> R:{name}{k}": fluid(source - p, flow),
        f"{junction} -> 0:chamber{k}": fluid(p, flow),
    }
