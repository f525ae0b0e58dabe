"""Scalar law over the length of a path, such as the spring or the motor of a tendon."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..typing import Scalar, ScalarLike
from ._base import AbstractPathLaw, AbstractScalarLaw, PathKinematics
from ._cable_drawing import middles
from ._cable_route import CableRoute, CableState
from ._internal_state import InternalState, States
from ._readings import Arrows, Reading
from ._spring_damper import SpringDamper
from ._validity import Margin


class PathForce(CableRoute, AbstractPathLaw):
    """Any scalar law over the length of a path of points, sheaves, cylinders and spheres: `b.cable(..., law=)`.

    Its displacement x is the length of the path, v the rate; a positive effort makes the path longer, a negative one
    pulls as a cable does.  So a `SpringDamper` is a tendon that also pushes, an `Actuator` a muscle, a `BumpStop` the
    end of its stroke.  The tension is one along the whole path.

    Attributes:
        kinds, radii, axes, turns, closed: as of `Cable`.
        law: a scalar law, with internal states or without.
    """

    law: AbstractScalarLaw = eqx.field(default_factory=SpringDamper)

    @property
    def is_source(self) -> bool:  # type: ignore[override]
        """As the law."""
        return self.law.is_source

    @property
    def stores(self) -> bool:
        """As the law."""
        return self.law.stores

    @property
    def dissipates(self) -> bool:
        """As the law."""
        return self.law.dissipates

    @property
    def internal_states(self) -> dict[str, InternalState]:
        """Those of the law."""
        return self.law.internal_states

    @property
    def holds(self) -> tuple[str, ...]:
        """Those of the law."""
        return self.law.holds

    def start(self, frames: PathKinematics, t: ScalarLike) -> States:
        """Those of the law at this length and rate."""
        path, rate, *_ = self.length_and_rate(frames)
        return self.law.start(path.length, rate, t)

    def rate(self, frames: PathKinematics, s: States, t: ScalarLike) -> States:
        """Rates of the internal states of the law."""
        path, rate, *_ = self.length_and_rate(frames)
        return self.law.rate(path.length, rate, s, t)

    def wrench(self, frames: PathKinematics, *s_and_t: Any) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """The effort times the derivative of the length by the places and turns of the frames."""
        path, rate, on_places, on_turns = self.length_and_rate(frames)
        effort = self.law.effort(path.length, rate, *s_and_t)
        return on_places * effort, on_turns * effort

    def potential(self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], *s_and_t: Any) -> Scalar:
        """That of the law at the length [J]."""
        return self.law.potential(self.path(rotations, positions).length, *s_and_t)

    def state(self, frames: PathKinematics, *s_and_t: Any) -> CableState:
        """Length, tension and wrap."""
        path, rate, *_ = self.length_and_rate(frames)
        tension = -self.law.effort(path.length, rate, *s_and_t)
        return CableState.of(self.layout, path, rate, tension, jnp.broadcast_to(tension, path.spans.shape))

    def report(self, *args: Any) -> dict[str, Reading]:
        """Length, tension and wrap, of the arguments of `wrench`."""
        return self.state(*args).readings

    def arrows(self, *args: Any) -> Arrows:
        """Forces on the bodies of all elements, of the arguments of `wrench`."""
        frames = args[0]
        return Arrows(middles(self.layout, self.path(frames.rotations, frames.positions)), self.wrench(*args)[0])

    def validity(self, frames: PathKinematics, *s_and_t: Any) -> dict[str, Margin]:
        """Margins of the path."""
        return self.path_margins(frames.rotations, frames.positions)[1]

    def faults(self) -> list[str]:
        """Those of the route and of the law."""
        if not isinstance(self.law, AbstractScalarLaw):
            return [f"law must be a scalar law such as SpringDamper or Actuator, not {type(self.law).__name__}"]
        return [*super().faults(), *self.law.faults(), *self.law.length_faults(), *self.route_faults()]
