"""A whole car: a chassis on two axles of independent suspensions, with wheels, tyres, a rack, a held speed."""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..builder import SystemBuilder
from ..checks import faults_if, negative
from ..errors import ModelError
from ..forces._base import AbstractBodyLaw
from ..forces._fields import number
from ..forces._signals import as_signal
from ..joints import Free, Prismatic
from ..typing import ArrayLike, Convertible, Matrix3, Scalar, ScalarLike, Vector3, WordedError
from ._driveline import mount_steering
from ._mount_axle import mount_anti_roll_bar
from ._mount_suspension import mount_suspension, mount_wheel
from ._parts import SIDES, MountedParts, check_parts, side_of
from ._suspension import Suspension


class CruiseControl(AbstractBodyLaw):
    """A force along x of a body, `gain (speed - forward speed)`, that holds a car's speed.

    Attributes:
        speed: a function of time or a number; a block may drive it [m/s].
        gain: [N s/m].
    """

    speed: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal)
    gain: Convertible[Scalar] = eqx.field(converter=number, default=2e4)
    is_source: ClassVar[bool] = True
    inputs: ClassVar[tuple[str, ...]] = ("speed",)

    def wrench(
        self, rotation: Matrix3, position: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """The force, no moment."""
        forward = rotation[:, 0]
        force = self.gain * (number(self.speed(t)) - jnp.dot(velocity, forward)) * forward
        return force, jnp.zeros_like(force)

    def faults(self) -> list[str]:
        """Those of the speed; a gain that is not negative."""
        return super().faults() + faults_if(
            (negative(self.gain), "gain must not be negative"), (self.gain.shape != (), "gain must be one number")
        )


class CarAxle(NamedTuple):
    """An axle of a car; the right side is the mirror image of the left one.

    Attributes:
        suspension: of the left wheel.
        at: origin of its hardpoints (3,) [m].
        tyres: laws of the left and the right wheel.
        spring: law over the length of the strut.
        upright, wheel: masses [kg].
        inertias: of upright and wheel, (3,) each, the wheel's second about its axle [kg m^2].
        brakes: laws on the spins, left and right, or None.
        anti_roll: hardpoints of an anti-roll bar, see `mount_anti_roll_bar`, and its stiffness; None for none.
    """

    suspension: Suspension
    at: Any
    tyres: tuple[Any, Any]
    spring: Any
    upright: Any = 20.0
    wheel: Any = 20.0
    inertias: tuple[Any, Any] = ((0.3, 0.3, 0.3), (0.6, 1.0, 0.6))
    brakes: tuple[Any, Any] | None = None
    anti_roll: tuple[Any, Any] | None = None


def car(
    front: WordedError[CarAxle],
    rear: WordedError[CarAxle],
    mass: ScalarLike,
    com: ArrayLike,
    inertia: ArrayLike,
    rack: Callable | ScalarLike | None = 0.0,
    cruise: Callable | ScalarLike | None = None,
    gravity: ScalarLike = 9.81,
    posts: Callable[[str], Any] | None = None,
) -> tuple[SystemBuilder, dict[str, MountedParts]]:
    """A car in a builder, to change and to build: body "chassis" on a free joint of its name, two axles, a rack.

    Corners are "front left", "front right", "rear left", "rear right"; rods, springs, wheels and tyres have these
    before their names, "front left tyre".

    Args:
        front, rear: the axles.
        mass: of the chassis [kg].
        com, inertia: its centre of mass (3,) [m], and inertia about it [kg m^2].
        rack: travel of the front rack, a function of time or a number; None leaves it free [m].
        cruise: speed that a force at the centre of mass holds, a function of time or a number; None for none [m/s].
        gravity: downwards [m/s^2].
        posts: heights [m] of the road under each wheel, a function of time for each name of a corner: wheels stand on
            four posts in place of the ground.

    Returns: the builder, and its parts by corner, "front steering", "front bar", "rear bar".
    Raises: ModelError for what is no axle.
    """
    faults = [f"{name} must be a CarAxle" for name, x in (("front", front), ("rear", rear)) if not _is_axle(x)]
    if faults:
        raise ModelError(faults, "the car")
    check_parts({"mass": mass, "gravity": gravity}, {"com": com, "inertia": inertia})
    b = SystemBuilder(gravity=-number(gravity) * jnp.asarray(np.array([0.0, 0.0, 1.0])))
    b.body("chassis", mass, com=com, inertia=inertia)
    b.joint("chassis", Free(), "ground", "chassis")
    if cruise is not None:
        b.force("cruise", CruiseControl(cruise), on=("chassis", com))
    own = front.suspension
    middle = side_of("left", front.at).point(own.hardpoints[own.rack[0]] if own.rack else np.zeros(3))
    middle = middle * jnp.asarray(np.array([1.0, 0.0, 1.0]))
    parts = {"front steering": mount_steering(b, "front", "chassis", middle, angle=None, travel=rack)}
    for name, axle in (("front", front), ("rear", rear)):
        steered = parts["front steering"].bodies["rack"] if name == "front" else None
        for k, side in enumerate(SIDES):
            parts[f"{name} {side}"] = _corner(b, axle, name, side, k, steered, posts)
        if axle.anti_roll is not None:
            ends = (f"{name} left upright", f"{name} right upright")
            points, stiffness = axle.anti_roll
            parts[f"{name} bar"] = mount_anti_roll_bar(b, points, stiffness, f"{name} bar", "chassis", *ends, axle.at)
    return b, parts


def _is_axle(value):
    return isinstance(value, CarAxle) and isinstance(value.suspension, Suspension)


def _corner(b, axle, name, side, k, rack, posts):
    """Suspension and wheel of a corner, joined."""
    corner, own, place = f"{name} {side}", axle.suspension, side_of(side, axle.at)
    options = {"mass": axle.upright, "inertia": axle.inertias[0], "spring": axle.spring, "rack": rack}
    held = mount_suspension(b, own, corner, "chassis", side, axle.at, **options)
    centre, inner = (place.point(own.hardpoints[point]) for point in (own.axle[1], own.axle[0]))
    road = "ground" if posts is None else _post(b, corner, posts(corner), centre)
    brake = None if axle.brakes is None else axle.brakes[k]
    left = place.sign * (centre - inner)
    upright = held.bodies["upright"]
    turning = mount_wheel(
        b, corner, upright, centre, axle.wheel, axle.inertias[1], axle.tyres[k], left, road=road, brake=brake
    )
    merged = (one | other for one, other in zip(held[:-1], turning[:-1], strict=True))
    return MountedParts(*merged, held.cut)


def _post(b, corner, height, centre):
    """A plate below the wheel, led to a height."""
    name = f"{corner} post"
    b.body(name, 1.0, com=centre, inertia=1.0)
    b.joint(name, Prismatic("z"), "ground", name, drive=as_signal(height))
    return name
