"""Contact of a pair of surfaces as a law between two frames."""

from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import may_be_nonzero, negative, not_positive
from ..drawings import Drawing, Marks
from ..forces._base import AbstractLaw, AbstractPoseLaw
from ..forces._fields import number, optional_number
from ..forces._readings import PointLoads
from ..forces._validity import Margin
from ..friction._places import as_optional_friction, place_faults
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


class AbstractContact(AbstractLaw):
    """Common to contacts: two surfaces, the normal force by their overlap, and the friction between them."""

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

    def validity(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, *_: Any
    ) -> dict[str, Margin]:
        """Margins of the pair, and the depth that is left to `max_depth` [m]."""
        ends = self.pair.validity(rotation, displacement)
        if self.max_depth is None:
            return ends
        left = self.max_depth - jnp.max(self.pair.touch(rotation, displacement).depth)
        return ends | {"depth": Margin(left, "m", "is pressed deeper than its max_depth")}

    def point_loads(self, *args: Any) -> PointLoads:
        """Loads at all points, of the arguments of `wrench`."""
        *motion, _ = args
        found = self.point_forces(*motion)
        area = self.pair.area(jnp.maximum(found.touch.depth, 0.0))
        at = found.touch
        return PointLoads(
            at.depth, found.rate, at.point, at.normal, found.normal, found.friction, found.sliding, area, self.wear
        )

    def point_forces(self, *motion: Any) -> PointForces:
        """Forces at the points of contact, of the arguments of `wrench` before the time."""
        raise NotImplementedError

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
        found = super().faults()
        if self.max_depth is not None and not_positive(self.max_depth):
            found.append("max_depth must be positive")
        for name in ("max_depth", "wear"):
            if np.shape(getattr(self, name) if getattr(self, name) is not None else 0.0):
                found.append(f"{name} must be one number")
        if self.friction is not None:
            found += place_faults(self.friction, "a contact", drag=False)
        return found + (["wear must not be negative"] if negative(self.wear) else [])

    def _stored(self, rotation, displacement):
        """Stored energy of the overlap [J]."""
        found = self.pair.touch(rotation, displacement)
        return jnp.sum(found.share * jax.vmap(self.force.energy)(found.depth))


def wrench_of(found: PointForces, displacement: Vector3) -> tuple[Vector3, Vector3]:
    """Forces of all points of contact on B, and their moment about its origin."""
    each = found.normal[:, None] * found.touch.normal + found.friction
    return jnp.sum(each, axis=0), jnp.sum(jnp.cross(found.touch.point - displacement[None], each), axis=0)


class Contact(AbstractContact, AbstractPoseLaw):
    """Two surfaces that touch: a normal force by their overlap, and dry friction between them.

    `b.contact("tappet", RollerOnCurve(...), "follower", "cam", force=HuntCrossley(...))` declares it; the same is
    `b.force("tappet", Contact(...), between=("cam", "follower"))`.  The spring part of the normal force is stored
    energy, damping and friction dissipate.  Apart, all of it is exactly zero, with all derivatives.

    Attributes:
        pair: the surfaces, such as `SphereOnPlane(radius)`; the plane, tube or curve is on the first frame.
        force: normal force by the depth.
        friction: a model of `jaxmbs.friction`, or the coefficient of its `SmoothCoulomb`; None for smooth surfaces.
            With bristles take a `BristleContact`.
        max_depth: depth beyond which a motion has the status `VALIDITY` [m], > 0; None for no bound.
        wear: worn volume over force and way (Archard's coefficient over hardness), >= 0 [m^2/N].
    """

    def __check_init__(self):
        if self.friction is not None and self.friction.has_bristles:
            raise TypeError(f"{type(self.friction).__name__} has bristles: take BristleContact")

    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """Forces of all points of contact on B, and their moment about its origin."""
        found = self.point_forces(rotation, displacement, angular_velocity, velocity)
        return wrench_of(found, displacement)

    def potential(self, rotation: Matrix3, displacement: Vector3, t: ScalarLike) -> Scalar:
        """Stored energy of the overlap [J]."""
        return self._stored(rotation, displacement)

    def point_forces(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3
    ) -> PointForces:
        """Forces at the points of contact; arguments as of `wrench`."""
        found = self.normal_forces(rotation, displacement, angular_velocity, velocity)
        if self.friction is None:
            return found
        grip = jax.vmap(self.friction.resistance)(jnp.sum(found.sliding**2, axis=1))
        against = (found.normal * grip)[:, None] * found.sliding
        return found._replace(friction=-against)
