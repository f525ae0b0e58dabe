"""The tyres of an axle of a plane car: side forces at the middle of the axle, at a known load."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..checks import faults_if, flag, not_positive
from ..drawings import Box, Drawing
from ..forces._base import AbstractPoseLaw
from ..forces._fields import number
from ..forces._internal_state import InternalState, States
from ..forces._readings import Reading
from ..forces._signals import as_signal
from ..typing import Convertible, Matrix3, Scalar, ScalarLike, Vector3, WordedError
from ._relaxation import rolling_speed
from ._tyre_model import AbstractTyreModel, Slip


class AxleTyres(AbstractPoseLaw):
    """The tyres of an axle in one, of a car that moves in the plane x y of frame A: side forces at frame B.

    Two tyres, one the mirror image of the other, roll freely at half of the load each, upright; forces of rolling and
    moments about the contacts are left out.  The axle looks along x of frame B, turned by the steer angle.

    Attributes:
        model: of one tyre.
        load: of the axle [N].
        steer: angle, positive to the left, a function of time or a number [rad].
        has_relaxation: whether the forces build up over the relaxation length (static).
    """

    model: WordedError[AbstractTyreModel]
    load: Convertible[Scalar] = eqx.field(converter=number)
    steer: Convertible[Callable[..., Any]] = eqx.field(converter=as_signal, default=0.0)
    has_relaxation: bool = eqx.field(static=True, converter=flag("has_relaxation"), default=False)
    is_source: ClassVar[bool] = False
    inputs: ClassVar[tuple[str, ...]] = ("steer",)

    def __check_init__(self):
        if not isinstance(self.model, AbstractTyreModel):
            raise TypeError(f"model must be an AbstractTyreModel, got {type(self.model).__name__}")

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """Deflection of the tread to the side [m]."""
        return {"across": InternalState((), "m", 0.01, np.inf)} if self.has_relaxation else {}

    @property
    def holds(self) -> tuple[str, ...]:
        """The deflection, at standstill."""
        return tuple(self.internal_states)

    def side_force(self, tangent: ScalarLike) -> Scalar:
        """Side force [N] of the axle at a tangent of the slip angle."""
        of_one = lambda x: self.model.forces(Slip(0.5 * self.load, 0.0, x)).fy
        return of_one(tangent) - of_one(-tangent)

    def cornering_stiffness(self) -> Scalar:
        """Minus the slope of the side force by the slip angle, at zero [N/rad]."""
        return -jax.grad(self.side_force)(jnp.zeros_like(self.load))

    def relaxation_length(self) -> Scalar:
        """Length [m] over which the side force builds up."""
        return number(self.model.relaxation_lengths(Slip(0.5 * self.load))[1])

    def rate(  # type: ignore[override]
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> States:
        """Rate of the deflection."""
        if not self.has_relaxation:
            return {}
        along, across, _ = self._speeds(rotation, velocity, t)
        return {"across": across - jnp.abs(along) / self.relaxation_length() * s["across"]}

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, *s_and_t: Any
    ) -> tuple[Vector3, Vector3]:
        """Side force across the wheels; with relaxation s is before t."""
        along, across, left = self._speeds(rotation, velocity, s_and_t[-1])
        tangent = (
            s_and_t[0]["across"] / self.relaxation_length()
            if self.has_relaxation
            else across / rolling_speed(along, 1.0)
        )
        force = self.side_force(tangent) * left
        return force, jnp.zeros_like(force)

    def _speeds(self, rotation, velocity, t):
        """Speeds along and across the wheels, and the unit vector to their left."""
        angle = number(self.steer(t))
        c, s = jnp.cos(angle), jnp.sin(angle)
        forward, left = c * rotation[:, 0] + s * rotation[:, 1], c * rotation[:, 1] - s * rotation[:, 0]
        return jnp.dot(velocity, forward), jnp.dot(velocity, left), left

    def report(self, rotation: Matrix3, *args: Any) -> dict[str, Reading]:
        """Side force and slip angle."""
        along, across, left = self._speeds(rotation, args[2], args[-1])
        force = jnp.dot(self.wrench(rotation, *args)[0], left)
        return {"side force": Reading(force, "N"), "slip angle": Reading(jnp.arctan2(across, jnp.abs(along)), "rad")}

    def drawing(self) -> Drawing:
        """The contact patch."""
        return (Box((0.3, 0.2, 0.02), 1),)

    def faults(self) -> list[str]:
        """A positive load."""
        return super().faults() + faults_if(
            (self.load.shape != (), "load must be one number"), (not_positive(self.load), "load must be positive")
        )
