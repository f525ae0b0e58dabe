"""Rack with column, differential and brakes on a chassis of a builder."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..builder import SystemBuilder
from ..checks import faults_if, not_positive
from ..forces import AbstractScalarLaw, SpringDamper
from ..forces._fields import number
from ..forces._signals import as_signal
from ..joints import Coupler, Prismatic, Revolute
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike, WordedError
from ._parts import Adder, MountedParts, check_parts

_SMALL = 0.01  # inertia of turning parts of the steering about any axis [kg m^2]


class BrakeTorque(AbstractScalarLaw):
    """Brake on the spin of a wheel: `-torque tanh(v / slow)`, which creeps where the wheel stands.

    Attributes:
        torque: >= 0, a function of time or a number; a block may drive it [N m].
        slow: spin at which three quarters of the torque act > 0 [rad/s].
    """

    torque: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    slow: Convertible[Scalar] = eqx.field(converter=number, default=0.5)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("torque",)

    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Torque on the wheel [N m]."""
        return -number(self.torque(t)) * jnp.tanh(v / self.slow)

    def faults(self) -> list[str]:
        """Those of the torque; a positive spin."""
        return super().faults() + faults_if(
            (not_positive(self.slow), "slow must be positive"), (self.slow.shape != (), "slow must be one number")
        )


def mount_steering(
    b: WordedError[SystemBuilder],
    name: str,
    chassis: str,
    position: ArrayLike,
    mass: ScalarLike = 4.0,
    pinion_radius: ScalarLike = 0.008,
    stiffness: ScalarLike | None = None,
    damping: ScalarLike = 0.0,
    angle: Callable | ScalarLike | None = 0.0,
    travel: Callable | ScalarLike | None = None,
) -> MountedParts:
    """Add a rack to a builder, "NAME rack" on joint "NAME rack" along y, and the column that moves it.

    Args:
        b: the builder, which has the chassis.
        name: of the steering.
        chassis: body that carries it.
        position: of the rack's middle (3,) [m].
        mass: of the rack [kg].
        pinion_radius: travel of the rack over the turn of the pinion [m/rad].
        stiffness: of the torsion bar between steering wheel and pinion [N m/rad]; None: rigid.
        damping: of the torsion bar [N m s/rad].
        angle: of the steering wheel, a function of time or a number [rad]; None leaves it free.
        travel: of the rack [m], a function of time or a number, in place of the column.
    """
    numbers = {"mass": mass, "pinion_radius": pinion_radius, "damping": damping}
    numbers |= {} if stiffness is None else {"stiffness": stiffness}
    check_parts(numbers, {"position": position}, None, {"name": name, "chassis": chassis})
    add, at = Adder(b, name), number(position)
    rack = add.body("rack", mass, com=at, inertia=_SMALL)
    drive = None if travel is None else as_signal(travel)
    add.joint("rack", Prismatic("y"), chassis, rack, at=at, drive=drive, point="rack")
    if travel is not None:
        return add.parts()
    wheel = add.body("steering wheel", 1.0, com=at, inertia=_SMALL)
    turned = None if angle is None else as_signal(angle)
    add.joint("steering wheel", Revolute("x"), chassis, wheel, at=at, drive=turned)
    ratios: dict[str, Any] = {add.joints["rack"]: 1.0, add.joints["steering wheel"]: -number(pinion_radius)}
    if stiffness is not None:
        pinion = add.body("pinion", 0.5, com=at, inertia=_SMALL)
        add.joint("torsion bar", Revolute("x"), wheel, pinion, at=at)
        add.force("torsion bar", SpringDamper(stiffness, damping), joint=add.joints["torsion bar"])
        ratios[add.joints["torsion bar"]] = -number(pinion_radius)
    b.constraint(add.full("pinion"), Coupler(ratios))
    return add.parts()


def mount_differential(
    b: WordedError[SystemBuilder],
    name: str,
    chassis: str,
    left: str,
    right: str,
    ratio: ScalarLike = 3.5,
    inertia: ScalarLike = 0.05,
    position: ArrayLike = (0.0, 0.0, 0.3),
) -> MountedParts:
    """Add an open differential to a builder: a shaft along x whose turn is `ratio` times the mean one of two wheels.

    A torque on joint "NAME shaft" goes to both wheels alike, `ratio / 2` times.

    Args:
        b: the builder, which has the chassis and the joints of the wheels.
        name: of the differential.
        chassis: body that carries the shaft.
        left, right: joints of the wheels' spins.
        ratio: of the final drive.
        inertia: of the shaft about its axis [kg m^2].
        position: of the shaft (3,) [m].
    """
    names = {"name": name, "chassis": chassis, "left": left, "right": right}
    check_parts({"ratio": ratio, "inertia": inertia}, {"position": position}, None, names)
    add = Adder(b, name)
    shaft = add.body("shaft", 1.0, com=position, inertia=inertia)
    add.joint("shaft", Revolute("x"), chassis, shaft, at=position)
    ratios: dict[str, Any] = {left: ratio, right: ratio, add.joints["shaft"]: -2.0}
    b.constraint(add.full("gears"), Coupler(ratios))
    return add.parts()
