"""The single-track car: understeer, gains and poles in closed form, and the same car as a mechanism."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..blocks import StateSpace
from ..builder import SystemBuilder
from ..checks import faults_if, not_positive
from ..errors import ModelError
from ..forces._fields import number, value_faults
from ..joints import Planar, VelocityRows
from ..math import _square as square
from ..quantities import Quantity
from ..reports import Report, Reported
from ..typing import Convertible, Scalar, ScalarLike, WordedError
from ._axle_tyres import AxleTyres
from ._steady_turn import SteadyTurn, steady_turn
from ._tyre_model import AbstractTyreModel


class SingleTrack(Reported, eqx.Module):
    """A car in the plane on a front and a rear axle of two equal tyres each, at a held forward speed.

    Attributes:
        mass: [kg].
        yaw_inertia: about the vertical axis through the centre of mass [kg m^2].
        a, b: distances of front and rear axle from the centre of mass [m].
        front, rear: model of one tyre of the axle.
        height: of the centre of mass [m], for the loads of the axles in braking and driving.
        gravity: [m/s^2].

    Source: Pacejka (2012), chapter 1.3.
    """

    mass: Convertible[Scalar] = eqx.field(converter=number)
    yaw_inertia: Convertible[Scalar] = eqx.field(converter=number)
    a: Convertible[Scalar] = eqx.field(converter=number)
    b: Convertible[Scalar] = eqx.field(converter=number)
    front: WordedError[AbstractTyreModel]
    rear: WordedError[AbstractTyreModel]
    height: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    gravity: Convertible[Scalar] = eqx.field(converter=number, default=9.81)

    def __check_init__(self):
        for name in ("front", "rear"):
            if not isinstance(getattr(self, name), AbstractTyreModel):
                kind = type(getattr(self, name)).__name__
                raise TypeError(f"{name} must be an AbstractTyreModel, got {kind}: `tyre.model` of a Tyre")
        numbers = ("mass", "yaw_inertia", "a", "b", "gravity", "height")
        faults = value_faults(self)
        for name in numbers:
            faults += faults_if((getattr(self, name).shape != (), f"{name} must be one number"))
        for name in numbers[:-1]:
            faults += faults_if((not_positive(getattr(self, name)), f"{name} must be positive"))
        if faults:
            raise ModelError(faults, "the car")

    @property
    def wheelbase(self) -> Scalar:
        """Distance of the axles [m]."""
        return self.a + self.b

    def axles(
        self, acceleration: ScalarLike = 0.0, steer: Any = 0.0, has_relaxation: bool = False
    ) -> tuple[AxleTyres, AxleTyres]:
        """Front and rear axle as laws, under their loads at a forward acceleration [m/s^2]."""
        moved = self.height * number(acceleration)
        loads = self.gravity * self.b - moved, self.gravity * self.a + moved
        front, rear = (self.mass * load / self.wheelbase for load in loads)
        return AxleTyres(self.front, front, steer, has_relaxation), AxleTyres(self.rear, rear, 0.0, has_relaxation)

    def cornering_stiffnesses(self, acceleration: ScalarLike = 0.0) -> tuple[Scalar, Scalar]:
        """Of front and rear axle [N/rad]."""
        front, rear = self.axles(acceleration)
        return front.cornering_stiffness(), rear.cornering_stiffness()

    def understeer_gradient(self, acceleration: ScalarLike = 0.0) -> Scalar:
        """Steer angle over lateral acceleration, less that of slow turns, `m/L (b/C_f - a/C_r)` [rad s^2/m]."""
        front, rear = self.cornering_stiffnesses(acceleration)
        return self.mass / self.wheelbase * (self.b / front - self.a / rear)

    def characteristic_speed(self) -> Scalar:
        """Speed of the largest yaw rate gain [m/s], `sqrt(L / K)`; NaN of an oversteering car."""
        return jnp.sqrt(self.wheelbase / self.understeer_gradient())

    def critical_speed(self) -> Scalar:
        """Speed from which the car is unstable [m/s], `sqrt(-L / K)`; NaN of an understeering car."""
        return jnp.sqrt(-self.wheelbase / self.understeer_gradient())

    def linear(self, speed: ScalarLike, has_relaxation: bool = False, acceleration: ScalarLike = 0.0) -> StateSpace:
        """Small motions from straight running at a speed [m/s].

        The input is the steer angle [rad]; states are the lateral speed at the centre of mass [m/s] and the yaw rate
        [rad/s], then with relaxation the deflections of front and rear tread [m]; outputs are the yaw rate, the slip
        angle of the centre of mass (lateral over forward speed) and the lateral acceleration [m/s^2].
        """
        v = number(speed)
        axles = self.axles(acceleration)
        C, arms = jnp.stack([axle.cornering_stiffness() for axle in axles]), jnp.stack([self.a, -self.b])
        to_slip = jnp.stack([jnp.ones_like(arms), arms], axis=1)  # side speeds of the axles
        to_rates = jnp.stack([jnp.ones_like(arms) / self.mass, arms / self.yaw_inertia])  # by side forces
        turning = jnp.zeros((2, 2)).at[0, 1].set(-v)
        steered = jnp.stack([v, jnp.zeros_like(v)])[:, None]
        if has_relaxation:
            sigma = jnp.stack([axle.relaxation_length() for axle in axles])
            forces = -jnp.diag(C / sigma)
            A = jnp.block([[turning, to_rates @ forces], [to_slip, -jnp.diag(v / sigma)]])
            B = jnp.concatenate([jnp.zeros((2, 1)), -steered])
        else:
            A = turning - to_rates @ (C[:, None] * to_slip) / v
            B = to_rates @ (C[:, None] * steered) / v
        n = len(A)
        lateral = jnp.zeros(n).at[1].set(v)
        picks = jnp.stack([jnp.zeros(n).at[1].set(1.0), jnp.zeros(n).at[0].set(1.0) / v, A[0] + lateral])
        return StateSpace(A, B, picks, jnp.concatenate([jnp.zeros((2, 1)), B[:1]]))

    def gains(self, speed: ScalarLike, acceleration: ScalarLike = 0.0) -> Float[Array, "3"]:
        """Steady yaw rate [1/s], slip of the centre of mass, lateral acceleration [m/s^2], over the steer angle."""
        A, B, C, D = self.linear(speed, acceleration=acceleration)
        return (D - C @ square.solve(A, B))[:, 0]

    def steady_turn(self, speed: ScalarLike, lateral_acceleration: ScalarLike) -> SteadyTurn:
        """The steady turn at a speed [m/s] and a lateral acceleration [m/s^2], with the tyres' whole curves.

        At a constant speed, or with `speed = sqrt(radius * lateral_acceleration)` at a constant radius (ISO 4138).
        NaN beyond the grip.
        """
        return steady_turn(self, number(speed), number(lateral_acceleration))

    def builder(
        self, speed: ScalarLike, steer: Callable | ScalarLike = 0.0, has_relaxation: bool = False
    ) -> SystemBuilder:
        """The car as a mechanism, to build, simulate and linearise: body "car" on the planar joint "car".

        Args:
            speed: forward, held by the constraint "speed" [m/s].
            steer: angle, positive to the left, a function of time or a number [rad]; as an input of `linearise` it is
                "front axle.steer".
            has_relaxation: whether side forces build up over the relaxation lengths.
        """
        b = SystemBuilder(gravity=(0.0, 0.0, -self.gravity))
        b.body("car", mass=self.mass, inertia=self.yaw_inertia)
        b.joint("car", Planar("z"), "ground", "car")
        zero = jnp.zeros_like(self.a)
        front, rear = self.axles(0.0, steer, has_relaxation)
        b.force("front axle", front, between=("ground", ("car", jnp.stack([self.a, zero, zero]))))
        b.force("rear axle", rear, between=("ground", ("car", jnp.stack([-self.b, zero, zero]))))
        b.constraint("speed", VelocityRows(ForwardSpeed(number(speed))))
        return b

    def report(self) -> Report:
        front, rear = self.cornering_stiffnesses()
        found = [
            Quantity("wheelbase", self.wheelbase, "m"),
            Quantity("cornering stiffness, front", front, "N/rad"),
            Quantity("cornering stiffness, rear", rear, "N/rad"),
            Quantity("understeer gradient", self.understeer_gradient(), "rad s^2/m"),
        ]
        return Report(found, "single-track car")


class ForwardSpeed(eqx.Module):
    """Forward speed of a plane car less a held one, of its coordinates x, y, angle."""

    speed: Float[Array, ""]

    def __call__(self, q: Array, u: Array, t: Any) -> Array:
        return jnp.cos(q[2]) * u[0] + jnp.sin(q[2]) * u[1] - self.speed
