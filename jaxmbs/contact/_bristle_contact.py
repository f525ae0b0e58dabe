"""Contact whose friction has bristles, as a law with internal states between two frames."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..forces._base import AbstractPoseLaw
from ..forces._internal_state import InternalState, States
from ..friction import AbstractBristles
from ..math._linalg import skew
from ..typing import Matrix3, Scalar, ScalarLike, Vector3
from ._contact import AbstractContact, PointForces, wrench_of


class BristleContact(AbstractContact, AbstractPoseLaw):
    """A `Contact` whose friction has bristles, and sticks: `b.contact(..., friction=LuGre(...))` declares it.

    The bend of the bristles at its k points is the internal state "bristle" (k, 3) [m], in the axes of the surface's
    frame; it stays in the tangent plane and turns with it, as where a ball rolls through a bowl.  Energy of bristles
    follows the normal force and is no potential: released ones give some back.

    Attributes:
        pair, force, max_depth, wear: as of `Contact`.
        friction: a model with bristles.
    """

    def __check_init__(self):
        if not isinstance(self.friction, AbstractBristles):
            raise TypeError(f"friction must be a model with bristles, got {type(self.friction).__name__}")

    @property
    def internal_states(self) -> dict[str, InternalState]:
        R, x = np.eye(3), np.array((0.0, 0.0, 1.0))
        points = jax.eval_shape(self.pair.touch, R, x).depth.shape
        return {"bristle": InternalState((*points, 3), "m", self.friction.bend_scale)}

    def rate(
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> States:
        """Rates of the bends: by sliding, and by the turning of the tangent plane."""
        motion = (rotation, displacement, angular_velocity, velocity)
        found, bend, slip = self._bristles(motion, s)
        moving = (skew(angular_velocity) @ rotation, velocity)
        turning = jax.jvp(lambda R, x: self.pair.touch(R, x).normal, (rotation, displacement), moving)[1]
        return {"bristle": slip - jnp.sum(turning * bend, axis=1, keepdims=True) * found.touch.normal}

    def wrench(  # type: ignore[override]
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> tuple[Vector3, Vector3]:
        """Forces of all points of contact on B, and their moment about its origin."""
        found = self.point_forces(rotation, displacement, angular_velocity, velocity, s)
        return wrench_of(found, displacement)

    def potential(self, rotation: Matrix3, displacement: Vector3, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """Stored energy of the overlap [J], without that of the bristles."""
        return self._stored(rotation, displacement)

    def point_forces(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, s: States
    ) -> PointForces:
        """Forces at the points of contact; arguments as of `wrench`."""
        found, bend, slip = self._bristles((rotation, displacement, angular_velocity, velocity), s)
        against = found.normal[:, None] * jax.vmap(self.friction.traction)(bend, slip, found.sliding)
        return found._replace(friction=-against)

    def storage_beside(  # type: ignore[override]
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> Scalar:
        """Power [W] that bends the bristles; what friction takes beside it is heat."""
        found, bend, slip = self._bristles((rotation, displacement, angular_velocity, velocity), s)
        power = jax.vmap(lambda z, rate: jax.jvp(self.friction.energy, (z,), (rate,))[1])(bend, slip)
        return jnp.sum(found.normal * power)

    @property
    def holds(self) -> tuple[str, ...]:
        """Its bristles."""
        return ("bristle",)

    def _bristles(self, motion, s) -> tuple[PointForces, Array, Array]:
        """The contact without friction, the bends (k, 3) in the tangent planes, and their rates in these."""
        found = self.normal_forces(*motion)
        bend = s["bristle"]
        bend = bend - jnp.sum(bend * found.touch.normal, axis=1, keepdims=True) * found.touch.normal
        touches = (found.normal > 0.0)[:, None]
        pressed, apart = jax.vmap(self.friction.rate)(bend, found.sliding), jax.vmap(self.friction.rate_apart)(bend)
        slip = jnp.where(touches, pressed, apart)
        return found, bend, slip
