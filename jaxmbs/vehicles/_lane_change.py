"""The double lane change, and a driver who follows a path by looking ahead."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..blocks import AbstractBlock
from ..checks import faults_if, not_positive, number_faults
from ..errors import ModelError
from ..forces._fields import as_function, number
from ..forces._internal_state import States
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike

_LENGTHS = (15.0, 30.0, 25.0, 25.0, 30.0)  # of entry lane, way over, side lane, way back, exit lane [m]


class Lane(NamedTuple):
    """A lane between cones: from start to end along x, from right to left along y [m]."""

    start: Array
    end: Array
    right: Array
    left: Array


class LaneChange(eqx.Module):
    """The double lane change of ISO 3888-1: 15 m, 30 m over, 25 m at 3.5 m to the left, 25 m back, 30 m.

    Attributes:
        width: of the vehicle, from which widths of lanes follow [m].
        start: x of the first cones [m].
        offset: of the right edge of the side lane from that of the entry lane [m].  Chrono counts from the middle of
            the entry lane: there it is 3.5 m and half of that lane's width.

    Source: ISO 3888-1 (2018).
    """

    width: Convertible[Scalar] = eqx.field(converter=number)
    start: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    offset: Convertible[Scalar] = eqx.field(converter=number, default=3.5)

    __repr__ = fields_repr

    def __check_init__(self):
        faults = number_faults("width", self.width, positive=True)
        faults += faults_if((self.offset.shape != (), "offset must be one number"))
        faults += faults_if((self.start.shape != (), "start must be one number"))
        if faults:
            raise ModelError(faults, "the lane change")

    @property
    def lanes(self) -> tuple[Lane, Lane, Lane]:
        """Entry lane, side lane and exit lane; the right edges of the first and the last are in line."""
        entry, side, last = (factor * self.width + 0.25 for factor in (1.1, 1.2, 1.3))
        x = self.start + np.cumsum((0.0, *_LENGTHS))
        right = -0.5 * entry
        up = right + self.offset
        return (
            Lane(x[0], x[1], right, right + entry),
            Lane(x[2], x[3], up, up + side),
            Lane(x[4], x[5], right, right + last),
        )

    def __call__(self, x: ArrayLike) -> Array:
        """A path y (...) [m] through the middle of the lanes, at x (...) [m], with quintics between them (C2)."""
        first, second, third = self.lanes
        x, middle = number(x), [0.5 * (lane.right + lane.left) for lane in self.lanes]
        over, back = (
            _rise((x - first.end) / (second.start - first.end)),
            _rise((x - second.end) / (third.start - second.end)),
        )
        return middle[0] + (middle[1] - middle[0]) * over + (middle[2] - middle[1]) * back

    def margin(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Distance () [m] of points x, y (...) to the edges of the lanes that they are in; negative: over a cone."""
        x, y = number(x), number(y)
        found = []
        for lane in self.lanes:
            inside = (x >= lane.start) & (x <= lane.end)
            found.append(jnp.min(jnp.where(inside, jnp.minimum(y - lane.right, lane.left - y), jnp.inf)))
        return jnp.min(jnp.stack(found))


def _rise(s):
    s = jnp.clip(s, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


class PathFollower(AbstractBlock):
    """A driver who steers for a point of a path ahead (pure pursuit): `atan(2 L sin(angle) / distance)`.

    It reads x, y and the heading of the middle of the rear axle, of a path y(x) towards positive x, and gives the
    steer angle of the front wheels [rad].

    Attributes:
        path: y(x) [m], such as `LaneChange(width=1.8)`; the arrays of an `eqx.Module` are leaves.
        wheelbase: L [m].
        preview: distance ahead along x [m].
        gain: factor of the angle.

    Source: Coulter (1992).
    """

    path: Convertible[Callable[..., Any]] = eqx.field(converter=as_function)
    wheelbase: Convertible[Scalar] = eqx.field(converter=number)
    preview: Convertible[Scalar] = eqx.field(converter=number)
    gain: Convertible[Scalar] = eqx.field(converter=number, default=1.0)

    def output(self, u: Array, s: States, t: ScalarLike) -> Array:
        """The steer angle."""
        x, y, heading = u[0], u[1], u[2]
        aside = number(self.path(x + self.preview)) - y
        angle = jnp.arctan2(aside, self.preview) - heading
        distance = jnp.sqrt(aside * aside + self.preview**2)
        return self.gain * jnp.arctan(2.0 * self.wheelbase * jnp.sin(angle) / distance)

    def faults(self) -> list[str]:
        """Positive lengths."""
        return super().faults() + faults_if(
            (not_positive(self.wheelbase), "wheelbase must be positive"),
            (not_positive(self.preview), "preview must be positive"),
        )
