"""Interfaces of force laws with internal states: a pressure, a current, the force of a spring behind a damper.

They are those of `_base` with the internal states s, arrays by name, before the time; the states of an element have a
rate, `ds/dt = rate(x, v, s, t)`, and are integrated with the motion.  A law `at` its states is a law without states.
What the law feeds in beside the energy that it stores is, as for all laws, `effort . flow + d(stored energy)/dt`.

C and I elements with states of their own, Source: S2 (27)-(28), (56)-(67).
"""

import abc
from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..drawings import Drawing, Symbol
from ..typing import ArrayLike, Matrix3, Scalar, ScalarLike, Vector3
from ._base import AbstractLaw, drawing_of_scalar
from ._element_bonds import bond_sums
from ._law_at import BodyLawAt, LawAt, PoseLawAt, ScalarLawAt, States, SystemLawAt


class InternalState(NamedTuple):
    """Declaration of an internal state of a law.

    Attributes:
        shape: of its array, () for one number.
        unit: of its numbers, such as "Pa"; empty for none.
        scale: size of its numbers in use: the tolerances of a motion apply to the state divided by it.
    """

    shape: tuple[int, ...] = ()
    unit: str = ""
    scale: ScalarLike = 1.0


class AbstractStateLaw(AbstractLaw):
    """Common to all laws with internal states: x and v stand for the arguments of their kind."""

    @property
    def stores(self) -> bool:
        """True if the law has a potential of its own, or its states store energy."""
        return type(self).potential.__module__ != __name__  # type: ignore[attr-defined]

    @property
    @abc.abstractmethod
    def internal_states(self) -> dict[str, InternalState]:
        """Declaration by name; of a law whose parameters are arrays the shapes may follow from theirs."""

    @abc.abstractmethod
    def rate(self, *args: Any) -> States:
        """Rates `ds/dt` by name, of (x, v, s, t)."""

    @property
    def holds(self) -> tuple[str, ...]:
        """Names of the states that may rest at any value of a band, such as bends of bristles: at rest their rates
        say nothing.  By default none."""
        return ()

    def start(self, *args: Any) -> States:
        """Initial values by name, of (x, v, t); those that are left out are zero."""
        return {}

    def dissipated(self, *args: Any) -> Scalar | None:
        """Power [W] that the law turns into heat, of (x, v, s, t): by default that of the resistors among its
        `bonds`, None where it declares none."""
        bonds = self.bonds(*args)
        return bond_sums(bonds).dissipated if bonds else None

    @abc.abstractmethod
    def at(self, s: States) -> LawAt:
        """The law of effort at internal states s."""


class AbstractScalarStateLaw(AbstractStateLaw):
    """`AbstractScalarLaw` with internal states."""

    @abc.abstractmethod
    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Effort [N or N m] exerted on the system along increasing x."""

    def potential(self, x: ScalarLike, s: States, t: ScalarLike) -> Scalar:
        """Stored energy [J], that of the internal states included."""
        return jnp.zeros((), jnp.result_type(x, float))

    def drawing(self) -> Drawing:
        """A spring, a damper or an actuator."""
        return drawing_of_scalar(self)

    def at(self, s: States) -> ScalarLawAt:
        """The law of effort at internal states s."""
        return ScalarLawAt(self, s)


class AbstractPoseStateLaw(AbstractStateLaw):
    """`AbstractPoseLaw` with internal states."""

    @abc.abstractmethod
    def wrench(
        self,
        rotation: Matrix3,
        displacement: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> tuple[Vector3, Vector3]:
        """Force [N] and moment [N m] on B, in A axes, about B's origin; A gets the opposite wrench there."""

    def potential(self, rotation: Matrix3, displacement: Vector3, s: States, t: ScalarLike) -> Scalar:
        """Stored energy [J], that of the internal states included."""
        return jnp.zeros((), displacement.dtype)

    def drawing(self) -> Drawing:
        """A bushing."""
        return (Symbol("bushing"),)

    def at(self, s: States) -> PoseLawAt:
        """The law of effort at internal states s."""
        return PoseLawAt(self, s)


class AbstractBodyStateLaw(AbstractStateLaw):
    """`AbstractBodyLaw` with internal states."""

    is_source: ClassVar[bool] = True

    @abc.abstractmethod
    def wrench(
        self,
        rotation: Matrix3,
        position: Vector3,
        angular_velocity: Vector3,
        velocity: Vector3,
        s: States,
        t: ScalarLike,
    ) -> tuple[Vector3, Vector3]:
        """Force [N] and moment [N m] on the body, in world axes, about the frame's origin."""

    def potential(self, rotation: Matrix3, position: Vector3, s: States, t: ScalarLike) -> Scalar:
        """Stored energy [J], that of the internal states included."""
        return jnp.zeros((), position.dtype)

    def at(self, s: States) -> BodyLawAt:
        """The law of effort at internal states s."""
        return BodyLawAt(self, s)


class AbstractSystemStateLaw(AbstractStateLaw):
    """`AbstractSystemLaw` with internal states."""

    is_source: ClassVar[bool] = True

    @abc.abstractmethod
    def effort(self, coordinates: ArrayLike, velocities: ArrayLike, s: States, t: ScalarLike) -> Float[Array, " nv"]:
        """Efforts (nv,) along the velocities, from coordinates (nq,), velocities (nv,), states and time [s]."""

    def potential(self, coordinates: ArrayLike, s: States, t: ScalarLike) -> Scalar:
        """Energy [J] of the internal states; that of the mechanism is no part of it."""
        return jnp.zeros((), jnp.result_type(coordinates, float))

    def at(self, s: States) -> SystemLawAt:
        """The law of effort at internal states s."""
        return SystemLawAt(self, s)


def internal_layout(law: AbstractLaw) -> tuple[tuple[str, tuple[int, ...], str], ...]:
    """(name, shape, unit) of each internal state of a law; none of a law without."""
    if not isinstance(law, AbstractStateLaw):
        return ()
    return tuple((name, tuple(one.shape), one.unit) for name, one in law.internal_states.items())
