"""Interfaces of force laws, which turn motion into effort: on one coordinate, two frames, one frame, several
frames, or the system.

A law is a frozen pytree whose numbers are array leaves. The engine stacks the leaves of laws with the same
structure and calls the methods under `jax.vmap`, so methods never branch on values and treat one law at a
time. Time is always the last argument, and wrenches are pairs (force, moment). The part of the effort that derives
from `potential` is stored energy; the rest is dissipation, or input when `is_source`. Effort times flow is the power
fed into the system.

A law may have internal states: a pressure, a current, the force of a spring behind a damper.  It declares them by
`internal_states`, and each of its methods takes them, arrays by name, as `s` before the time.  They have a rate,
`ds/dt = rate(x, v, s, t)`, and are integrated with the motion.  What such a law feeds in beside the energy that it
stores is, as for all laws, `effort . flow + d(stored energy)/dt`.
Source: S2 (76); (27)-(28), (56)-(67) of elements with states of their own.
"""

import abc
from typing import Any, ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..drawings import Drawing, Symbol
from ..math._linalg import direction, safe_norm, skew
from ..math._spatial import cross
from ..tables import fields_repr
from ..typing import ArrayLike, Matrix3, Scalar, ScalarLike, Vector3
from ._element_bonds import ElementBonds, bond_sums
from ._fields import value_faults
from ._internal_state import InternalState, States
from ._readings import Arrows, PointLoads, Reading, is_own
from ._validity import Margin


class AbstractLaw(eqx.Module):
    """Common to all laws.

    A law speaks for itself: `drawing`, `report`, `validity`, `bonds`, `arrows` and `point_loads` are what pictures,
    tables, statuses and bond graphs ask it for; each has a default.  All but the drawing take the arguments of its
    effort.

    `unbounded` names the fields that may be infinite, `inputs` those that are functions of time and may be driven by
    a block; the potential must not depend on these.
    """

    is_source: ClassVar[bool] = False
    # far stiffer along some directions than along others: such a law has `stress` of its displacement and `under` a
    # stress, by which a search for equilibria keeps the stresses as unknowns of their own
    is_steep: ClassVar[bool] = False
    inputs: ClassVar[tuple[str, ...]] = ()
    unbounded: ClassVar[tuple[str, ...]] = ()
    __repr__ = fields_repr

    @property
    def stores(self) -> bool:
        """True if part of the effort derives from a potential; laws return False for parameters known to be zero."""
        own = [getattr(type(self), name, None) for name in ("potential", "line_potential")]
        return any(method is not None and method.__module__ != __name__ for method in own)

    @property
    def dissipates(self) -> bool:
        """True if there is effort beside that of the potential: resistance, or input where `is_source`."""
        return True

    @property
    def largest_damping(self) -> ArrayLike:
        """Largest slope of the effort by the velocity [N s/m or N m s/rad], by which `simulate` sees dampers that are
        stiff; zero, as by default, where there is none or it is not known."""
        return 0.0

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """Declaration of its internal states by name, none by default; of a law whose parameters are arrays the
        shapes may follow from theirs."""
        return {}

    @property
    def holds(self) -> tuple[str, ...]:
        """Names of the internal states that may rest at any value of a band, such as bends of bristles: at rest their
        rates say nothing.  By default none."""
        return ()

    def start(self, *args: Any) -> States:
        """Initial values of the internal states by name, of (x, v, t); those that are left out are zero."""
        return {}

    def rate(self, *args: Any) -> States:
        """Rates `ds/dt` of the internal states by name, of (x, v, s, t)."""
        return {}

    def dissipated(self, *args: Any) -> Scalar | None:
        """Power [W] that the law turns into heat, of the arguments of its effort: by default that of the resistors
        among its `bonds`, None where it declares none."""
        bonds = self.bonds(*args)
        return bond_sums(bonds).dissipated if bonds else None

    def bonds(self, *args: Any) -> ElementBonds:
        """Bonds of the graph inside the element by name, "Se:voltage -> 1:current", of the arguments of its effort;
        none where the law does not say.  "1:port" is the junction of its own flow."""
        return {}

    def validity(self, *args: Any) -> dict[str, Margin]:
        """Margins to the ends of the model by name, of the arguments of its effort: where one is negative the law
        does not hold, and motions, equilibria and reactions say so.  By default there are none."""
        return {}

    @property
    def has_ends(self) -> bool:
        """True if `validity` has margins."""
        return is_own(self, "validity", AbstractLaw)

    @property
    def has_bonds(self) -> bool:
        """True if the law declares `bonds`."""
        return is_own(self, "bonds", AbstractLaw)

    def drawing(self) -> Drawing:
        """Shapes (`jaxmbs.drawings`) in the frames that the law acts on; by default none.  Its numbers are known."""
        return ()

    def report(self, *args: Any) -> dict[str, Reading]:
        """Results by name for `dynamics.element_reports`; by default those at points of contact."""
        found = self.point_loads(*args)
        return {} if found is None else found.readings

    def arrows(self, *args: Any) -> Arrows | None:
        """Forces that pictures show as arrows, by default those at points of contact; in the axes of the arguments,
        from their origin."""
        found = self.point_loads(*args)
        return None if found is None else found.arrows

    def point_loads(self, *args: Any) -> PointLoads | None:
        """Loads at points of contact between two frames, for `dynamics.contact_load`; none where nothing touches."""
        return None

    @property
    def has_points(self) -> bool:
        """True if `point_loads` has some."""
        return is_own(self, "point_loads", AbstractLaw)

    @property
    def has_arrows(self) -> bool:
        """True if `arrows` has some."""
        return self.has_points or is_own(self, "arrows", AbstractLaw)

    @property
    def has_report(self) -> bool:
        """True if `report` has results."""
        return self.has_points or is_own(self, "report", AbstractLaw)

    @property
    def has_storage_beside(self) -> bool:
        """True if `storage_beside` has some."""
        return is_own(self, "storage_beside", AbstractLaw)

    def storage_beside(self, *args: Any) -> Scalar | None:
        """Power [W] that the law stores beside its potential, as in bristles whose energy follows a normal force;
        None where it stores all in the potential."""
        return None

    @property
    def has_corners(self) -> bool:
        """True if the slope of its effort jumps along motions, at places that shall not be stepped over."""
        return False

    def faults(self) -> list[str]:
        """Faults of the values, one message each; traced values are not checked."""
        return value_faults(self)


def drawing_of_scalar(law: AbstractLaw) -> Drawing:
    """Symbols of a law on one coordinate: a spring if it stores energy, a damper if it has one; or an actuator."""
    has_damping = hasattr(law, "damping") and law.dissipates
    kinds = ["spring"] * law.stores + ["damper"] * has_damping
    return tuple(map(Symbol, kinds or ["damper" if hasattr(law, "damping") else "actuator"]))


class AbstractScalarLaw(AbstractLaw):
    """One-port law on a scalar displacement x and its rate v.

    On a joint x is the joint's coordinate [m or rad], zero where its frames coincide, and the effort drives it up.
    Between two points x is their distance, never negative, and v the rate at which they part [m, m/s]; the effort
    acts along the line from the first to the second and pushes them apart [N].  Points that coincide have no
    direction and feel nothing.
    """

    @abc.abstractmethod
    def effort(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> Scalar:
        """Effort [N or N m] exerted on the system along increasing x.

        Args:
            x: displacement [m or rad].
            v: its rate [m/s or rad/s].
            t: time [s].
        """

    def potential(self, x: ScalarLike, t: ScalarLike) -> Scalar:
        """Stored energy [J]; `effort(x, 0, t) = -d potential / dx` for laws that store all they take."""
        return jnp.zeros((), jnp.result_type(x, float))

    def line_force(self, d: Vector3, v: Vector3, t: ScalarLike) -> Vector3:
        """Force [N] on the second of two points, `effort(|d|, n.v, t) n`; the first gets the opposite.

        Args:
            d: (3,) from the first point to the second [m], n its unit vector.
            v: (3,) its rate [m/s].
            t: time [s].

        Source: S2 (57)-(58), (72).
        """
        n = direction(d)
        return self.effort(safe_norm(d), jnp.dot(n, v), t) * n

    def line_potential(self, d: Vector3, t: ScalarLike) -> Scalar:
        """Stored energy [J] of the law between two points d (3,) [m] apart."""
        return self.potential(safe_norm(d), t)

    def length_faults(self) -> list[str]:
        """Faults of the values for use between two points, whose distance is never negative."""
        return []

    def drawing(self) -> Drawing:
        """A spring, a damper or an actuator."""
        return drawing_of_scalar(self)


class AbstractPoseLaw(AbstractLaw):
    """Law between frames A and B. Zero configuration: B coincides with A."""

    @abc.abstractmethod
    def wrench(
        self, rotation: Matrix3, displacement: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """Force [N] and moment [N m] on B, in A axes, about B's origin; A gets the opposite wrench there.

        Args:
            rotation: (3, 3) `R_A^T R_B`, B axes in A axes.
            displacement: (3,) origin of B from that of A, in A axes [m].
            angular_velocity: (3,) of B relative to A, in A axes [rad/s].
            velocity: (3,) of B's origin seen in the rotating frame A, in A axes [m/s].
            t: time [s].
        """

    def potential(self, rotation: Matrix3, displacement: Vector3, t: ScalarLike) -> Scalar:
        """Stored energy [J]."""
        return jnp.zeros((), displacement.dtype)

    def drawing(self) -> Drawing:
        """A bushing."""
        return (Symbol("bushing"),)


class AbstractBodyLaw(AbstractLaw):
    """Load at the origin of a frame, all quantities in world axes."""

    is_source: ClassVar[bool] = True

    @abc.abstractmethod
    def wrench(
        self, rotation: Matrix3, position: Vector3, angular_velocity: Vector3, velocity: Vector3, t: ScalarLike
    ) -> tuple[Vector3, Vector3]:
        """Force [N] and moment [N m] on the body, in world axes, about the frame's origin.

        Args:
            rotation: (3, 3) frame axes in world axes.
            position: (3,) frame origin [m].
            angular_velocity: (3,) [rad/s].
            velocity: (3,) of the frame origin [m/s].
            t: time [s].
        """

    def potential(self, rotation: Matrix3, position: Vector3, t: ScalarLike) -> Scalar:
        """Stored energy [J]; zero for loads whose work is counted as input."""
        return jnp.zeros((), position.dtype)


class PathKinematics(NamedTuple):
    """Poses and velocities of the frames of a path, in world axes.

    Attributes:
        rotations: (n, 3, 3) axes of each frame in world axes.
        positions: (n, 3) of their origins from a common point [m].
        angular_velocities: (n, 3) [rad/s].
        velocities: (n, 3) of their origins [m/s].
    """

    rotations: Float[Array, "n 3 3"]
    positions: Float[Array, "n 3"]
    angular_velocities: Float[Array, "n 3"]
    velocities: Float[Array, "n 3"]

    @classmethod
    def of_twists(
        cls, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], twists: Float[Array, "n 6"]
    ) -> "PathKinematics":
        """Of frames whose bodies move with twists (angular velocity, velocity of the point at the origin)."""
        omega = twists[:, :3]
        return cls(rotations, positions, omega, twists[:, 3:] + cross(omega, positions))

    def power(self, forces: Float[Array, "n 3"], moments: Float[Array, "n 3"]) -> Scalar:
        """Power [W] of forces and moments on the frames, each about its frame's origin."""
        return jnp.sum(forces * self.velocities) + jnp.sum(moments * self.angular_velocities)


class AbstractPathLaw(AbstractLaw):
    """Law over several frames, such as a cable, all quantities in world axes."""

    @property
    @abc.abstractmethod
    def num_frames(self) -> int:
        """Number of frames that the law acts on."""

    def in_place(self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]) -> "AbstractPathLaw":
        """The law with what it takes from the places of its frames where all coordinates are zero; arguments as in
        `PathKinematics`.  By default the law itself."""
        return self

    @abc.abstractmethod
    def wrench(self, frames: PathKinematics, t: ScalarLike) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """Forces [N] and moments [N m] on the frames, in world axes, each about its frame's origin."""

    def potential(self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], t: ScalarLike) -> Scalar:
        """Stored energy [J]; arguments as in `PathKinematics`."""
        return jnp.zeros((), positions.dtype)

    def potential_and_validity(self, frames: PathKinematics, t: ScalarLike) -> tuple[Scalar, dict[str, Margin]]:
        """`potential` and `validity`.  Laws in which both need the same costly geometry evaluate it once here."""
        return self.potential(frames.rotations, frames.positions, t), self.validity(frames, t)

    def storage_power(self, frames: PathKinematics, t: ScalarLike) -> Scalar:
        """Power [W] into the stored energy at constant time, by differentiation.  Laws that have a quicker
        expression, linear in the velocities, give it."""
        rates = (jax.vmap(skew)(frames.angular_velocities) @ frames.rotations, frames.velocities)
        return jax.jvp(lambda R, x: self.potential(R, x, t), (frames.rotations, frames.positions), rates)[1]

    def wrench_and_storage_power(
        self, frames: PathKinematics, t: ScalarLike
    ) -> tuple[tuple[Float[Array, "n 3"], Float[Array, "n 3"]], Scalar]:
        """`wrench` and `storage_power`.  Laws in which both need the same costly geometry evaluate it once here."""
        return self.wrench(frames, t), self.storage_power(frames, t)


class AbstractSystemLaw(AbstractLaw):
    """Generalised efforts on the velocities of the whole system."""

    is_source: ClassVar[bool] = True

    @abc.abstractmethod
    def effort(self, coordinates: ArrayLike, velocities: ArrayLike, t: ScalarLike) -> Float[Array, " nv"]:
        """Efforts (nv,) along the velocities, from coordinates (nq,), velocities (nv,) and time [s]."""

    def potential(self, coordinates: ArrayLike, t: ScalarLike) -> Scalar:
        """Energy [J] of its internal states; that of the mechanism is no part of it."""
        return jnp.zeros((), jnp.result_type(coordinates, float))
