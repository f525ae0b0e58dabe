"""Tyres of a few numbers: linear, Fiala's, and the brush model; each on a linear spring."""

import abc
import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp

from ..checks import faults_if, negative, not_positive
from ..forces._fields import number
from ..forces._validity import Margin
from ..typing import Convertible, Scalar
from ._tyre_model import AbstractTyreModel, Compression, ContactForces, Slip, SlipSlopes, pressed

_NEAR = 1e-6  # of the friction, over it: what slides along or across alone is at its end


class AbstractPlainTyre(AbstractTyreModel):
    """A tyre on a linear spring, whose slip stiffnesses are proportional to the load.

    Attributes:
        slip_slope: dfx/dkappa at the nominal load [N].
        cornering: -dfy/d(slip angle) at the nominal load [N/rad].
        nominal_load: [N].
        radius: free [m].
        stiffness: vertical [N/m].
        vertical_damping: [N s/m].
        relaxation: lengths along and across (2,) [m].
        resistance: of rolling, moment over load and radius.
    """

    slip_slope: Convertible[Scalar] = eqx.field(converter=number)
    cornering: Convertible[Scalar] = eqx.field(converter=number)
    nominal_load: Convertible[Scalar] = eqx.field(converter=number, kw_only=True)
    radius: Convertible[Scalar] = eqx.field(converter=number, kw_only=True)
    stiffness: Convertible[Scalar] = eqx.field(converter=number, kw_only=True)
    vertical_damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0, kw_only=True)
    relaxation: Any = eqx.field(converter=number, default=(0.3, 0.5), kw_only=True)
    resistance: Convertible[Scalar] = eqx.field(converter=number, default=0.0, kw_only=True)

    def slopes(self, slip: Slip) -> SlipSlopes:
        share = jnp.maximum(slip.load, 0.0) / self.nominal_load
        return SlipSlopes(self.slip_slope * share, self.cornering * share, *self._grip())

    def relaxation_lengths(self, slip: Slip) -> tuple[Any, Any]:
        return self.relaxation[0], self.relaxation[1]

    def load(self, at: Compression) -> Scalar:
        return self.stiffness * pressed(at)

    def damping(self, at: Compression) -> Scalar:
        return self.vertical_damping

    def free_radius(self, spin: Any) -> Scalar:
        return self.radius

    def rolling_radius(self, load: Any, spin: Any, pressure: Any = None) -> Scalar:
        """The free radius less a third of the deflection."""
        return self.radius - load / self.stiffness / 3.0

    @property
    def usual_load(self) -> Any:
        return self.nominal_load

    def faults(self) -> list[str]:
        """Positive numbers."""
        found = super().faults()
        for name in ("slip_slope", "cornering", "nominal_load", "radius", "stiffness"):
            found += faults_if((not_positive(getattr(self, name)), f"{name} must be positive"))
        for name in ("vertical_damping", "resistance"):
            found += faults_if((negative(getattr(self, name)), f"{name} must not be negative"))
        for name in (field.name for field in dataclasses.fields(self)):
            if name not in ("relaxation", "friction"):
                found += faults_if((getattr(self, name).shape != (), f"{name} must be one number"))
        return found + faults_if(
            (self.relaxation.shape != (2,), f"relaxation must be two lengths, got {self.relaxation.shape}"),
            (not_positive(self.relaxation), "relaxation must be positive"),
        )

    def _resisting(self, slip):
        return -slip.direction * self.resistance * self.radius * slip.load

    @abc.abstractmethod
    def _grip(self):
        """Friction along and across."""


class LinearTyre(AbstractPlainTyre):
    """A tyre whose forces are proportional to slip and load, without end.

    Attributes (besides those of all plain tyres):
        camber_stiffness: dfy/d(inclination) at the nominal load [N/rad]; negative: towards the lean.
        trail: pneumatic [m].
    """

    camber_stiffness: Convertible[Scalar] = eqx.field(converter=number, default=0.0, kw_only=True)
    trail: Convertible[Scalar] = eqx.field(converter=number, default=0.0, kw_only=True)

    def forces(self, slip: Slip) -> ContactForces:
        along, across = self.slopes(slip)[:2]
        fy = -across * slip.tangent + self.camber_stiffness * slip.camber * slip.load / self.nominal_load
        none = jnp.zeros_like(fy)
        mz = across * slip.tangent * self.trail * slip.direction
        return ContactForces(along * slip.kappa, fy, none, self._resisting(slip) + none, mz)

    def _grip(self):
        """One, without meaning but for the size of slips at standstill."""
        one = jnp.ones_like(self.slip_slope)
        return one, one


class FialaTyre(AbstractPlainTyre):
    """Fiala's tyre: friction falls with the slip, the side force is a cubic up to where all slides.

    As in Adams, the forces along and across share no friction: where both together are beyond it the tyre is beyond
    its validity; `BrushTyre` and `MagicFormula` are for combined slip.

    Attributes (besides those of all plain tyres):
        friction: (2,) without slip, and at a slip of one.
        width: of the tyre [m], for the aligning moment.

    Source: Fiala (1954), with the friction by slip of Adams; Pacejka (2012), chapter 3.
    """

    friction: Any = eqx.field(converter=number, default=(1.0, 0.9), kw_only=True)
    width: Convertible[Scalar] = eqx.field(converter=number, default=0.2, kw_only=True)

    def forces(self, slip: Slip) -> ContactForces:
        along, across = self.slopes(slip)[:2]
        limit = self._friction(slip) * jnp.maximum(slip.load, 1e-9)
        fx = _fiala_along(along, limit, slip.kappa)
        ratio = jnp.clip(1.0 - across * jnp.abs(slip.tangent) / (3.0 * limit), 0.0, 1.0)
        side = jnp.where(slip.tangent < 0.0, 1.0, -1.0)
        fy = side * limit * (1.0 - ratio**3)
        mz = -side * limit * self.width * (1.0 - ratio) * ratio**3 * slip.direction
        return ContactForces(fx, fy, jnp.zeros_like(fy), self._resisting(slip) + jnp.zeros_like(fy), mz)

    def validity(self, slip: Slip) -> dict[str, Margin]:
        """Margin of the force [N] to the bound of friction."""
        forces = self.forces(slip)
        both = jnp.sqrt(forces.fx**2 + forces.fy**2 + 1e-24)
        limit = (1.0 + _NEAR) * self._friction(slip) * jnp.maximum(slip.load, 1e-9)
        return {"friction": Margin(limit - both, "N", "pushes along and across at once by more than its friction")}

    def _grip(self):
        return self.friction[0], self.friction[0]

    def faults(self) -> list[str]:
        """Those of all plain tyres, and positive friction."""
        return super().faults() + faults_if(
            (self.friction.shape != (2,), f"friction must be two numbers, got {self.friction.shape}"),
            (not_positive(self.friction), "friction must be positive"),
            (not_positive(self.width), "width must be positive"),
        )

    def _friction(self, slip):
        size = jnp.sqrt(slip.kappa**2 + slip.tangent**2 + 1e-24)
        return self.friction[0] - (self.friction[0] - self.friction[1]) * jnp.minimum(size, 1.0)


class BrushTyre(AbstractPlainTyre):
    """The brush model: elastic bristles under a parabolic pressure, alike along and across.

    Its slip stiffness is `cornering` both ways.

    Attributes (besides those of all plain tyres):
        friction: coefficient.
        half_length: of the contact [m], for the aligning moment.

    Source: Pacejka (2012), chapter 3.2, (3.35)-(3.47).
    """

    friction: Convertible[Scalar] = eqx.field(converter=number, default=1.0, kw_only=True)
    half_length: Convertible[Scalar] = eqx.field(converter=number, default=0.06, kw_only=True)

    def slopes(self, slip: Slip) -> SlipSlopes:
        both = self.cornering * jnp.maximum(slip.load, 0.0) / self.nominal_load
        return SlipSlopes(both, both, *self._grip())

    def forces(self, slip: Slip) -> ContactForces:
        limit = self.friction * jnp.maximum(slip.load, 1e-9)
        whole = jnp.maximum(jnp.abs(1.0 + slip.kappa), 1e-6)
        x, y = slip.kappa / whole, slip.tangent / whole
        size = jnp.sqrt(x * x + y * y + 1e-24)
        adhering = jnp.maximum(1.0 - self.slopes(slip).across * size / (3.0 * limit), 0.0)
        force = limit * (1.0 - adhering**3) / size
        sliding = 1.0 - adhering
        arm = self.half_length * adhering**3 / (3.0 - 3.0 * sliding + sliding**2)
        fy = -force * y
        return ContactForces(
            force * x, fy, jnp.zeros_like(fy), self._resisting(slip) + jnp.zeros_like(fy), -arm * fy * slip.direction
        )

    def _grip(self):
        return self.friction, self.friction

    def faults(self) -> list[str]:
        """Those of all plain tyres, and positive friction."""
        return super().faults() + faults_if(
            (self.friction.shape != (), "friction must be one number"),
            (not_positive(self.friction), "friction must be positive"),
            (not_positive(self.half_length), "half_length must be positive"),
        )


def _fiala_along(stiffness, limit, kappa):
    """Force along: linear up to half of the friction, then towards all of it."""
    critical = limit / (2.0 * stiffness + 1e-12)
    beyond = jnp.abs(kappa) > critical
    size = jnp.where(beyond, jnp.abs(kappa), 1.0)
    sliding = limit - limit**2 / (4.0 * size * (stiffness + 1e-12))
    return jnp.where(beyond, jnp.where(kappa < 0.0, -sliding, sliding), stiffness * kappa)
