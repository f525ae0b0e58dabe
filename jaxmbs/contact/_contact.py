"""Contact of a pair of surfaces as a law between two frames."""

from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import may_be_nonzero, negative, not_positive
from ..drawings import Drawing, Marks
from ..forces._base import AbstractPoseLaw
from ..forces._fields import number, optional_number
from ..forces._internal_state import InternalState, States
from ..forces._readings import PointLoads
from ..forces._validity import Margin
from ..friction._places import as_optional_friction, place_faults
from ..math._extremes import largest
from ..math._linalg import skew
from ..typing import Convertible, Matrix3, Scalar, ScalarLike, Vector3, WordedError
from ._hunt_crossley import HuntCrossley
from ._pair import AbstractPair, Touch


class PointForces(NamedTuple):
    """Forces at the points of contact (k,), on B in the axes of A: the normal force (k,) [N] and friction (k, 3) [N];
    rate of the depth (k,) and sliding velocity (k, 3) [m/s]."""

    touch: Touch
    rate: Float[Array, " k"]
    sliding: Float[Array, "k 3"]
    normal: Float[Array, " k"]
    friction: Float[Array, "k 3"]


class Bristles(NamedTuple):
    """Bends (k, 3) in the tangent planes, and their rates in these."""

    bend: Float[Array, "k 3"]
    rate: Float[Array, "k 3"]


class Contact(AbstractPoseLaw):
    """Two surfaces that touch: a normal force by their overlap, and dry friction between them.

    `b.contact("tappet", RollerOnCurve(...), "follower", "cam", force=HuntCrossley(...))` declares it; the same is
    `b.force("tappet", Contact(...), between=("cam", "follower"))`.  The spring part of the normal force is stored
    energy, damping and friction dissipate.  Apart, all of it is exactly zero, with all derivatives.

    A friction with bristles sticks.  Their bend at the k points is the internal state "bristle" (k, 3) [m], in axes
    of the surface's frame; it stays in the tangent plane and turns with it, as where a ball rolls through a bowl.
    Energy of bristles follows the normal force and is no potential: released ones give some back.

    Attributes:
        pair: the surfaces, such as `SphereOnPlane(radius)`; the plane, tube or curve is on the first frame.
        force: normal force by the depth.
        friction: a model of `jaxmbs.friction`, or the coefficient of its `SmoothCoulomb`; None for smooth surfaces.
        max_depth: depth beyond which a motion has the status `VALIDITY` [m], > 0; None for no bound.
        wear: worn volume over force and way (Archard's coefficient over hardness), >= 0 [m^2/N].
    """

    pair: WordedError[AbstractPair]
    force: WordedError[HuntCrossley]
    friction: WordedError[Any] = eqx.field(converter=as_optional_friction, default=None)
    max_depth: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    wear: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    is_source: ClassVar[bool] = False

    def __check_init__(self):
        kinds = {"pair": AbstractPair, "force": HuntCrossley}
        for name, kind in kinds.items():
            if not isinstance(getattr(self, name), kind):
                raise TypeError(f"{name} must be of {kind.__name__}, got {type(getattr(self, name)).__name__}")

    @property
    def has_bristles(self) -> bool:
        """True where its friction has bristles."""
        return self.friction is not None and self.friction.has_bristles

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """The bends of bristles, where the friction has them."""
        if not self.has_bristles:
            return {}
        points = jax.eval_shape(lambda *x: self.pair.touch(*x), np.eye(3), np.array((0.0, 0.0, 1.0))).depth.shape
        return {"bristle": InternalState((*points, 3), "m", self.friction.bend_scale, self.friction.largest_bend)}

    @property
    def holds(self) -> tuple[str, ...]:
        """Its bristles."""
        return ("bristle",) if self.has_bristles else ()

    def rate(  # type: ignore[override]
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> States:
        """Rates of the bends: by sliding, and by the turning of the tangent plane."""
        if not self.has_bristles:
            return {}
        forces = self.normal_forces(rotation, displacement, angular_velocity, velocity)
        bend, slip = self._bristles(forces, s)
        moving = (skew(angular_velocity) @ rotation, velocity)
        turning = jax.jvp(lambda R, x: self.pair.touch(R, x).normal, (rotation, displacement), moving)[1]
        return {"bristle": slip - jnp.sum(turning * bend, axis=1, keepdims=True) * forces.touch.normal}

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, *s_and_t: Any
    ) -> tuple[Vector3, Vector3]:
        """Forces of all points of contact on B, and their moment about its origin; with bristles s is before t."""
        forces = self.point_forces(rotation, displacement, angular_velocity, velocity, *s_and_t[:-1])
        each = forces.normal[:, None] * forces.touch.normal + forces.friction
        return jnp.sum(each, axis=0), jnp.sum(jnp.cross(forces.touch.point - displacement[None], each), axis=0)

    def potential(self, rotation: Matrix3, displacement: Vector3, *_: Any) -> Scalar:
        """Stored energy of the overlap [J], without that of bristles."""
        touch = self.pair.touch(rotation, displacement)
        return jnp.sum(touch.share * jax.vmap(self.force.energy)(touch.depth))

    def storage_beside(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, *s_and_t: Any
    ) -> Scalar | None:
        """Power [W] that bends the bristles; what friction takes beside it is heat."""
        if not self.has_bristles:
            return None
        forces = self.normal_forces(rotation, displacement, angular_velocity, velocity)
        bend, slip = self._bristles(forces, s_and_t[0])
        power = jax.vmap(lambda z, rate: jax.jvp(self.friction.energy, (z,), (rate,))[1])(bend, slip)
        return jnp.sum(forces.normal * power)

    @property
    def has_storage_beside(self) -> bool:
        """True for bristles."""
        return self.has_bristles

    def normal_forces(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3
    ) -> PointForces:
        """Forces at the points of contact without friction; arguments as of `wrench`."""
        at = self.pair.touch(rotation, displacement)
        moving = velocity[None] + jnp.cross(angular_velocity[None], at.point - displacement[None])
        parting = jnp.sum(at.normal * moving, axis=1)
        sliding = moving - parting[:, None] * at.normal
        normal = at.share * jax.vmap(self.force.force)(at.depth, -parting)
        return PointForces(at, -parting, sliding, normal, jnp.zeros_like(sliding))

    def point_forces(
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States | None = None,
    ) -> PointForces:
        """Forces at the points of contact; arguments as of `wrench` before the time."""
        forces = self.normal_forces(rotation, displacement, angular_velocity, velocity)
        if self.friction is None:
            return forces
        if self.has_bristles:
            bend, slip = self._bristles(forces, s)
            against = forces.normal[:, None] * jax.vmap(self.friction.traction)(bend, slip, forces.sliding)
        else:
            grip = jax.vmap(self.friction.resistance)(jnp.sum(forces.sliding**2, axis=1))
            against = (forces.normal * grip)[:, None] * forces.sliding
        return forces._replace(friction=-against)

    def _bristles(self, forces, s) -> Bristles:
        """The bristles of a contact without friction; those that are apart straighten."""
        bend = s["bristle"]
        bend = bend - jnp.sum(bend * forces.touch.normal, axis=1, keepdims=True) * forces.touch.normal
        touches = (forces.normal > 0.0)[:, None]
        pressed, apart = jax.vmap(self.friction.rate)(bend, forces.sliding), jax.vmap(self.friction.rate_apart)(bend)
        return Bristles(bend, jnp.where(touches, pressed, apart))

    def validity(self, rotation: Matrix3, displacement: Vector3, *_: Any) -> dict[str, Margin]:
        """Margins of the pair, and the depth that is left to `max_depth` [m]."""
        ends = self.pair.validity(rotation, displacement)
        if self.max_depth is None:
            return ends
        left = self.max_depth - largest(self.pair.touch(rotation, displacement).depth)
        return ends | {"depth": Margin(left, "m", "is pressed deeper than its max_depth")}

    def point_loads(self, *args: Any) -> PointLoads:
        """Loads at all points, of the arguments of `wrench`."""
        loads = self.point_forces(*args[:-1])
        area = self.pair.area(jnp.maximum(loads.touch.depth, 0.0))
        at = loads.touch
        return PointLoads(
            at.depth, loads.rate, at.point, at.normal, loads.normal, loads.friction, loads.sliding, area, self.wear
        )

    def drawing(self) -> Drawing:
        """The surfaces, and the points where they touch."""
        return *self.pair.drawing(), Marks(self.pair.touch_points)

    @property
    def has_ends(self) -> bool:
        """True for a bound on the depth, or margins of the pair."""
        return self.max_depth is not None or self.pair.has_ends

    @property
    def stores(self) -> bool:
        return may_be_nonzero(self.force.stiffness)

    @property
    def dissipates(self) -> bool:
        return self.friction is not None or may_be_nonzero(self.force.damping)

    def faults(self) -> list[str]:
        """Those of its parts too."""
        faults = super().faults()
        if self.max_depth is not None and not_positive(self.max_depth):
            faults.append("max_depth must be positive")
        for name in ("max_depth", "wear"):
            if np.shape(getattr(self, name) if getattr(self, name) is not None else 0.0):
                faults.append(f"{name} must be one number")
        if self.friction is not None:
            faults += place_faults(self.friction, "a contact", drag=False)
        return faults + (["wear must not be negative"] if negative(self.wear) else [])
