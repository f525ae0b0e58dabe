"""Interface of tyre models: forces of the contact from slip, and what the wheel needs beside them."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from ..forces._fields import value_faults
from ..forces._validity import Margin
from ..tables import fields_repr
from ..typing import Scalar


class Slip(NamedTuple):
    """State of the contact of a tyre, in ISO axes: x along the wheel, y to the left, z off the road.

    Attributes:
        load: on the road [N].
        kappa: longitudinal slip, positive driving, -1 of a locked wheel.
        tangent: of the slip angle: side speed over the forward speed's size; its force is negative.
        camber: sine of the inclination angle, positive where the top leans to the right.
        speed: of the contact along x [m/s].
        pressure: of inflation [Pa]; None for the nominal one.
        direction: from -1 to 1, of rolling; between where the wheel nearly stands.
    """

    load: Any
    kappa: Any = 0.0
    tangent: Any = 0.0
    camber: Any = 0.0
    speed: Any = 0.0
    pressure: Any = None
    direction: Any = 1.0


class ContactForces(NamedTuple):
    """Forces [N] and moments [N m] of the road on a tyre at its contact, in ISO axes.

    Attributes: fx: along the wheel; fy: to the left; mx: overturning; my: of rolling resistance; mz: aligning.
    """

    fx: Array
    fy: Array
    mx: Array
    my: Array
    mz: Array


class SlipSlopes(NamedTuple):
    """Slip stiffnesses and friction of a tyre.

    Attributes: along: slope of fx by the slip [N]; across: of -fy by the tangent of the slip angle [N], at small
    slips; grip_along, grip_across: largest forces over the load.
    """

    along: Any
    across: Any
    grip_along: Any
    grip_across: Any


class Compression(NamedTuple):
    """Deflection of a tyre, and the other numbers that its load depends on.

    Attributes:
        deflection: free radius less loaded radius, in the plane of the wheel [m]; rate [m/s].
        spin: of the wheel [rad/s].
        camber: sine of the inclination angle.
        pressure: of inflation [Pa]; None for the nominal one.
        fx, fy: forces at the contact [N].
    """

    deflection: Any
    rate: Any = 0.0
    spin: Any = 0.0
    camber: Any = 0.0
    pressure: Any = None
    fx: Any = 0.0
    fy: Any = 0.0


class AbstractTyreModel(eqx.Module):
    """A tyre model over slip and deflection; methods treat one tyre, at loads above zero."""

    __repr__ = fields_repr

    @abc.abstractmethod
    def forces(self, slip: Slip) -> ContactForces:
        """Forces at the contact in steady rolling."""

    @abc.abstractmethod
    def slopes(self, slip: Slip) -> SlipSlopes:
        """Slip stiffnesses and friction."""

    @abc.abstractmethod
    def relaxation_lengths(self, slip: Slip) -> tuple[Any, Any]:
        """Lengths [m] over which the forces along and across build up."""

    @abc.abstractmethod
    def load(self, at: Compression) -> Scalar:
        """Load [N] of a deflection, without damping; zero where there is none."""

    @abc.abstractmethod
    def damping(self, at: Compression) -> Scalar:
        """Damping of the deflection [N s/m]."""

    @abc.abstractmethod
    def free_radius(self, spin: Any) -> Scalar:
        """Radius [m] of the tyre without load."""

    @abc.abstractmethod
    def rolling_radius(self, load: Any, spin: Any, pressure: Any = None) -> Scalar:
        """Effective rolling radius [m]: forward speed over spin of a wheel that rolls freely."""

    @property
    def load_follows_forces(self) -> bool:
        """True if `load` depends on fx and fy."""
        return False

    @property
    @abc.abstractmethod
    def usual_load(self) -> Any:
        """A load in use [N]."""

    @property
    def standstill_speed(self) -> Any:
        """Speed [m/s] below which the tyre is taken to start or stop."""
        return 1.0

    def validity(self, slip: Slip) -> dict[str, Margin]:
        """Margins to the ends of what was measured; none by default."""
        return {}

    def faults(self) -> list[str]:
        """Faults of the values, one message each; traced values are not checked."""
        return value_faults(self)


def pressed(at: Compression) -> Any:
    """The deflection [m], zero where the tyre is off the road."""
    return jnp.maximum(at.deflection, 0.0)
