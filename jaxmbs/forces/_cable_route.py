"""Route of a cable: its elements in order, the path over them, and the state of a cable on it."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..checks import any_concrete, faults_if, not_positive
from ..drawings import Drawing
from ..math._vector import VectorComponents
from ..runtime import gather_static
from ..typing import Convertible, Scalar
from ._base import PathKinematics
from ._cable_drawing import cable_course, cable_drawing
from ._cable_margins import path_margins
from ._cable_path import CablePath, Circles, PathLayout, cable_path
from ._cable_slopes import length_slopes
from ._fields import number
from ._readings import Reading
from ._validity import Margin


class CableState(NamedTuple):
    """A cable at one instant.

    Attributes:
        length: from end to end along the path, or around [m]; rate [m/s].
        tension: () the mean along the cable [N].
        tensions: (m,) of each span between two elements, in order [N].
        wrap: (n,) angle about each element [rad], zero at ends; negative where the cable has left it.
        points: (m, 2, 3) world points where each span begins and ends [m].
        is_tangent: (m,) true where a span touches its wheels, false where they have no such span.
    """

    length: Array
    rate: Array
    tension: Array
    tensions: Array
    wrap: Array
    points: Array
    is_tangent: Array

    @property
    def readings(self) -> dict[str, Reading]:
        """The numbers with their units."""
        spans, elements = (
            tuple(f"{name} {k}" for k in range(part.shape[0]))
            for name, part in (("span", self.tensions), ("element", self.wrap))
        )
        return {
            "length": Reading(self.length, "m"),
            "rate": Reading(self.rate, "m/s"),
            "tension": Reading(self.tension, "N"),
            "tension of": Reading(self.tensions, "N", spans),
            "wrap about": Reading(self.wrap, "rad", elements),
        }

    @classmethod
    def of(cls, layout: PathLayout, path: CablePath, rate, tension, tensions) -> "CableState":
        """The state of a cable along a path."""
        start, end = path.touching_points(layout)
        points = jnp.stack([start.rows, end.rows], axis=1)
        return cls(path.length, rate, tension, tensions, path.wrap, points, path.is_tangent)


_KINDS = ("point", "sheave", "cylinder", "sphere")


def _kinds(kinds):
    """Kinds of elements.  Raises: TypeError for others."""
    if not isinstance(kinds, tuple | list) or any(kind not in _KINDS for kind in kinds):
        raise TypeError(f"kinds has one of {', '.join(_KINDS)} for each element, not {kinds!r}")
    return tuple(kinds)


class CableRoute(eqx.Module):
    """The elements that a cable passes, in order.

    Attributes:
        kinds: of each element, "point", "sheave", "cylinder" or "sphere".
        radii: (c,) of the elements that are no points, in order [m].
        axes: (c, 3) unit vectors in their frames' axes, about which the cable turns in the positive sense on its way;
            of spheres about along them.
        turns: (c,) whole turns about them beside the wrap.
        closed: True for a belt, whose last element is followed by the first.
    """

    kinds: tuple[str, ...] = eqx.field(static=True, converter=_kinds)
    radii: Convertible[Float[Array, " c"]] = eqx.field(converter=number)
    axes: Convertible[Float[Array, "c 3"]] = eqx.field(converter=number)
    turns: Convertible[Float[Array, " c"]] = eqx.field(converter=number)
    closed: bool = eqx.field(static=True, default=False)

    @property
    def num_frames(self) -> int:
        """Number of elements of the path."""
        return len(self.kinds)

    @property
    def layout(self) -> PathLayout:
        """The static parts of the path."""
        return PathLayout(self.kinds, self.closed)

    @property
    def has_corners(self) -> bool:
        """True if it can leave a wheel."""
        return len(self.layout.free_wheels) > 0

    def path(self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]) -> CablePath:
        """The path through frames of these poses."""
        return cable_path(self.layout, self._circles(rotations, positions))

    def course(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]
    ) -> tuple[Float[Array, "m 2 3"], Float[Array, "k 3"]]:
        """Ends of the straight parts, and points along the whole cable, for pictures."""
        return cable_course(self.layout, self.path(rotations, positions), positions)

    def drawing(self) -> Drawing:
        """The cable and its wheels."""
        return cable_drawing(self)

    def length_and_slopes(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]
    ) -> tuple[CablePath, Float[Array, "n 3"], Float[Array, "n 3"]]:
        """(path, derivatives (n, 3) of its length by the places and small turns of the frames)."""
        path = self.path(rotations, positions)
        return path, *length_slopes(self.layout, path)

    def sides_of_corners(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]
    ) -> Float[Array, " k"]:
        """Share of the way over each wheel that it can leave, in the derivative of the length: 1 on it, 0 off it."""
        past = self.path(rotations, positions).bypass
        return jnp.ones(0, positions.dtype) if past is None else past.wheel

    def path_margins(
        self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"]
    ) -> tuple[CablePath, dict[str, Margin]]:
        """The path through frames of these poses, and its margins by name."""
        circles = self._circles(rotations, positions)
        path = cable_path(self.layout, circles)
        return path, path_margins(self.layout, circles, path)

    def length_and_rate(
        self, frames: PathKinematics
    ) -> tuple[CablePath, Scalar, Float[Array, "n 3"], Float[Array, "n 3"]]:
        """(path, rate of its length, derivatives as of `length_and_slopes`)."""
        path, on_x, on_turn = self.length_and_slopes(frames.rotations, frames.positions)
        return path, frames.power(on_x, on_turn), on_x, on_turn

    def _circles(self, rotations, positions):
        """The elements in world axes."""
        own, count = self.layout.circles, len(self.layout.circles)
        rows = jnp.concatenate([self.radii[:, None], self.turns[:, None], self.axes], axis=1)
        rows = jnp.concatenate([rows, jnp.zeros((1, 5), rows.dtype)])
        places = np.full(len(self.kinds), count)
        places[own] = np.arange(count)
        rows = gather_static(rows, places)  # zero at points
        axes = jnp.sum(rotations * rows[:, None, 2:], axis=2)
        return Circles(VectorComponents.of(positions), rows[:, 0], VectorComponents.of(axes), rows[:, 1])

    def route_faults(self) -> list[str]:
        """Faults of the elements: their number, sizes and order."""
        n, kinds = len(self.kinds), self.kinds
        count = len(self.layout.circles)
        ends = () if self.closed else (0, n - 1)
        found = faults_if(
            (not_positive(self.radii), "radii must be positive"),
            (n < 2, "a path has two elements or more"),
            (
                (self.radii.shape, self.axes.shape, self.turns.shape) != ((count,), (count, 3), (count,)),
                "radii (c,), axes (c, 3) and turns (c,) are those of the c circles",
            ),
            (
                any_concrete(lambda m: (m < 0) | (m > 1000) | (m != np.round(m)), self.turns),
                "turns are whole numbers between 0 and 1000",
            ),
            (any(kinds[k] != "point" for k in ends), "the ends are points: Attachment(...)"),
        )
        for k, kind in enumerate(kinds):
            if kind in ("cylinder", "sphere") and (kinds[k - 1], kinds[(k + 1) % n]) != ("point", "point"):
                found.append(
                    f"element {k}: a {kind} stands between two points of the cable; put an Eyelet before and after it"
                )
            if kind not in ("point", "sheave", "cylinder", "sphere"):
                found.append(f"element {k}: {kind!r} is not point, sheave, cylinder or sphere")
        return found
