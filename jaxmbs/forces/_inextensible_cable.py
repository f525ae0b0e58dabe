"""Cable of constant length, or of a length given in time: a constraint, whose multiplier is the tension."""

from collections.abc import Callable
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import faults_if, not_positive
from ..joints._rows import AbstractRows
from ..math._spatial import cross
from ..typing import Convertible, Scalar, ScalarLike
from ._base import PathKinematics
from ._cable_drawing import middles
from ._cable_route import CableRoute, CableState
from ._readings import Arrows, Reading
from ._signals import Constant, as_signal
from ._validity import Margin


class InextensibleCable(CableRoute, AbstractRows):  # type: ignore[override]
    """Cable that neither stretches nor becomes slack: `free length - length of the path = 0`, one row [m].

    Its multiplier is the tension [N], equal along the whole cable; where it is negative the cable would have to push.

    Attributes:
        kinds, radii, axes, turns, closed: as of `Cable`.
        free_length: length of the cable [m]: a number, or a function of time for a winch that pays out at the first
            element.
    """

    has_ends: ClassVar[bool] = True
    has_arrows: ClassVar[bool] = True
    has_report: ClassVar[bool] = True

    free_length: Convertible[Callable] = eqx.field(converter=as_signal, default=1.0)

    @property
    def is_wound(self) -> bool:
        """True if the length is a function of time."""
        return not isinstance(self.free_length, Constant)

    @property
    def may_depend_on_time(self) -> bool:
        """True if the length is a function of time."""
        return self.is_wound

    def is_length(self, kinds: tuple[str, ...]) -> bool:
        """True."""
        return True

    def value(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], q: Array, t: ScalarLike
    ) -> Float[Array, "1"]:
        """Length that is left of the cable (1,) [m]; q: none."""
        return jnp.reshape(self.free_length(t) - self.path(rotations, positions).length, (1,))

    def slopes(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], q: Array, t: ScalarLike
    ) -> tuple[Float[Array, "1 n 6"], Float[Array, "1 0"]]:
        """The loads at a tension of one, as wrenches about the origin."""
        return self.value_and_slopes(rotations, positions, q, t)[1]

    def value_and_slopes(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], q: Array, t: ScalarLike
    ) -> tuple[Float[Array, "1"], tuple[Float[Array, "1 n 6"], Float[Array, "1 0"]]]:
        """Both of the same path."""
        path, on_x, on_turn = self.length_and_slopes(rotations, positions)
        force, moment = -on_x, -on_turn
        wrench = jnp.concatenate([moment + cross(positions, force), force], axis=1)
        left = jnp.reshape(self.free_length(t) - path.length, (1,))
        return left, (wrench[None], jnp.zeros((1, 0), positions.dtype))

    def unit_loads(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]
    ) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """Forces and moments (n, 3) on the frames, each about its origin, in world axes, at a tension of one."""
        _, on_x, on_turn = self.length_and_slopes(rotations, positions)
        return -on_x, -on_turn

    def state(self, frames: PathKinematics, tension: Scalar) -> CableState:
        """The cable under a tension."""
        path, rate, *_ = self.length_and_rate(frames)
        return CableState.of(self.layout, path, rate, tension, jnp.broadcast_to(tension, path.spans.shape))

    def report(self, frames: PathKinematics, multipliers: Float[Array, "1"]) -> dict[str, Reading]:
        """Length, tension and wrap."""
        return self.state(frames, multipliers[0]).readings

    def arrows(self, frames: PathKinematics, multipliers: Float[Array, "1"]) -> Arrows:
        """Forces on the bodies of all elements."""
        path, on_x, _ = self.length_and_slopes(frames.rotations, frames.positions)
        return Arrows(middles(self.layout, path), -multipliers[0] * on_x)

    def validity(self, frames: PathKinematics, multipliers: Float[Array, "1"]) -> dict[str, Margin]:
        """Margins of the path, and the tension [N]."""
        tension = multipliers[0]
        found = self.path_margins(frames.rotations, frames.positions)[1]
        end = "would have to push: give it a stiffness, so that it may become slack"
        return found | {"tension": Margin(tension, "N", end)}

    def faults(self) -> list[str]:
        """Radii and length are positive."""
        short = isinstance(self.free_length, Constant) and not_positive(self.free_length.value)
        return faults_if((short, "free_length must be positive")) + self.route_faults()
