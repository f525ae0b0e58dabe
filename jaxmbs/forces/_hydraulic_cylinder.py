"""A double-acting hydraulic cylinder on a servo valve."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, negative, not_positive
from ..typing import Convertible, Scalar, ScalarLike
from ._fields import as_law_function, number
from ._signals import AbstractSignal, as_signal
from ._state_laws import AbstractScalarStateLaw, InternalState, States


def _opening(value):
    """A signal of time from a signal or number; any other function is one of (x, v, t)."""
    return as_signal(value) if isinstance(value, AbstractSignal) or not callable(value) else as_law_function(value)


class HydraulicCylinder(AbstractScalarStateLaw):
    """Double-acting cylinder between two points, or along a joint, with its four-way valve.

    The chambers' pressures are its internal states "p0", which drives x up, and "p1":
    `V0 dp0/dt = E (Q0 - A0 v - leakage (p0 - p1))`, `V1 dp1/dt = E (Q1 + A1 v + leakage (p0 - p1))`, and
    `effort = A0 p0 - A1 p1 - damping v`. A positive opening a lets oil flow from the supply to chamber 0,
    `Q0 = a flow_gain sqrt(supply - p0)`, and from chamber 1 to the tank; a negative one the other way. At small
    pressure differences the flow is laminar, so that it is smooth. The oil's power counts as input.

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
        varying: True where the chambers grow and shrink with x (static); by default their volumes are constant.
    """

    areas: Convertible[Float[Array, "2"]] = eqx.field(converter=number)
    volumes: Convertible[Float[Array, "2"]] = eqx.field(converter=number)
    bulk_modulus: Convertible[Scalar] = eqx.field(converter=number)
    valve: Convertible[Callable[..., Any]] = eqx.field(converter=_opening)
    flow_gain: Convertible[Scalar] = eqx.field(converter=number)
    supply: Convertible[Scalar] = eqx.field(converter=number)
    tank: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    leakage: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    laminar: Convertible[Scalar] = eqx.field(converter=number, default=1e4)
    length: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    varying: bool = eqx.field(static=True, default=False)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("valve",)

    @property
    def internal_states(self) -> dict[str, InternalState]:
        return {name: InternalState(unit="Pa", scale=1e6) for name in ("p0", "p1")}

    def start(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> States:
        """Pressures of the tank."""
        return {"p0": self.tank, "p1": self.tank}

    def chambers(self, x: ScalarLike) -> Float[Array, "2"]:
        """Volumes of the chambers [m^3]."""
        if not self.varying:
            return self.volumes
        return self.volumes + (x - self.length) * self.areas * jnp.array([1.0, -1.0])

    def flows(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Float[Array, "2"]:
        """Flows of the valve into the chambers [m^3/s]."""
        given = (t,) if isinstance(self.valve, AbstractSignal) else (x, v, t)
        a, p = number(self.valve(*given)), jnp.stack([s["p0"], s["p1"]])
        openings = jnp.stack([a, -a])
        drop = jnp.where(openings > 0.0, self.supply - p, p - self.tank)
        return openings * self.flow_gain * _signed_root(drop, self.laminar)

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rates of the pressures [Pa/s]."""
        past = self.leakage * (s["p0"] - s["p1"])
        inflow = self.flows(x, v, s, t) - (self.areas * v + past) * jnp.array([1.0, -1.0])
        rates = self.bulk_modulus * inflow / self.chambers(x)
        return {"p0": rates[0], "p1": rates[1]}

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Force that drives x up [N]."""
        return self.areas[0] * s["p0"] - self.areas[1] * s["p1"] - self.damping * v

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Energy of the compressed oil `sum V p^2 / (2 E)` [J]."""
        p = jnp.stack([s["p0"], s["p1"]])
        return jnp.sum(self.chambers(x) * jnp.square(p)) / (2.0 * self.bulk_modulus)

    def faults(self) -> list[str]:
        """Two chambers, and the signs of what they are made of."""
        if self.areas.shape != (2,) or self.volumes.shape != (2,):
            return [f"areas and volumes are those of two chambers, got {self.areas.shape} and {self.volumes.shape}"]
        return super().faults() + faults_if(
            (self.length.shape != (), "length must be one number"),
            (not_positive(self.areas), "areas must be positive"),
            (not_positive(self.volumes), "volumes must be positive"),
            (not_positive(self.bulk_modulus), "bulk_modulus must be positive"),
            (negative(self.flow_gain), "flow_gain must not be negative"),
            (negative(self.leakage), "leakage must not be negative"),
            (negative(self.damping), "damping must not be negative"),
            (not_positive(self.laminar), "laminar must be positive"),
            (any_concrete(lambda p, q: p < q, self.supply, self.tank), "supply must not be below tank"),
        )


def _signed_root(drop, laminar):
    """Signed root of a pressure difference, linear below `laminar`: `d / (d^2 + laminar^2)^(1/4)`."""
    return drop * (drop**2 + laminar**2) ** -0.25
