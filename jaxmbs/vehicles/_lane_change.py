"""The double lane change, and a driver who follows a path by looking ahead."""

import abc
import dataclasses
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

# of entry lane, way over, side lane, way back, exit lane [m]
_DOUBLE_LANE_CHANGE = (15.0, 30.0, 25.0, 25.0, 30.0)
_OBSTACLE_AVOIDANCE = (12.0, 13.5, 11.0, 12.5, 12.0)


class Lane(NamedTuple):
    """A lane between cones: from start to end along x, from right to left along y [m]."""

    start: Array
    end: Array
    right: Array
    left: Array


class _Course(eqx.Module):
    """Three lanes, and a path through them."""

    width: Convertible[Scalar] = eqx.field(converter=number)
    start: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    __repr__ = fields_repr

    def __check_init__(self):
        faults = []
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("width"):
                faults += number_faults(field.name, value, positive=True)
            else:
                faults += faults_if((value.shape != (), f"{field.name} must be one number"))
        if faults:
            raise ModelError(faults, "the lane change")

    @property
    @abc.abstractmethod
    def lanes(self) -> tuple[Lane, Lane, Lane]:
        """Entry lane, side lane and exit lane; the right edges of the first and the last are in line."""

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


def _lanes(start, lengths, widths, up):
    """Lanes of widths (3,), the second with its right edge `up` over those of the others."""
    x, right = start + np.cumsum((0.0, *lengths)), -0.5 * widths[0]
    return tuple(
        Lane(x[2 * k], x[2 * k + 1], edge, edge + wide)
        for k, (edge, wide) in enumerate(zip((right, right + up, right), widths, strict=True))
    )


class LaneChange(_Course):
    """The double lane change of ISO 3888-1: 15 m, 30 m over, 25 m to the left, 25 m back, 30 m; 125 m in all.

    Lanes are 1.1, 1.2 and 1.3 widths of the vehicle and 0.25 m wide.

    Attributes:
        width: of the vehicle, from which widths of lanes follow [m].
        start: x of the first cones [m].
        offset: of the right edge of the side lane from that of the entry lane [m].  Programs count the 3.5 m from
            elsewhere: Chrono from the middle of the entry lane (here `3.5 + 0.5 * (1.1 * width + 0.25)`), Simscape
            between the middles of both (`3.5 - 0.05 * width`).  Chrono's exit lane has 15 m.

    Source: ISO 3888-1 (2018), by the programs that are named; its figure was not at hand.
    """

    offset: Convertible[Scalar] = eqx.field(converter=number, default=3.5)

    @property
    def lanes(self) -> tuple[Lane, Lane, Lane]:
        """Entry lane, side lane and exit lane; the right edges of the first and the last are in line."""
        widths = [factor * self.width + 0.25 for factor in (1.1, 1.2, 1.3)]
        return _lanes(self.start, _DOUBLE_LANE_CHANGE, widths, self.offset)


class ObstacleAvoidance(_Course):
    """The obstacle avoidance ("elk test") of ISO 3888-2: 12 m, 13.5 m over, 11 m to the left, 12.5 m back, 12 m.

    These are 61 m.  Lanes are 1.1 widths of the vehicle and 0.25 m, one width and 1 m, and `exit_width` wide.

    Attributes:
        width: of the vehicle, from which widths of lanes follow [m].
        start: x of the first cones [m].
        offset: of the right edge of the side lane from the left one of the entry lane [m].
        exit_width: of the exit lane [m]: Chrono's.  Others take 1.3 widths of the vehicle and 0.25 m, or the smaller.

    Source: ISO 3888-2 (2011); widths and the offset by the programs Chrono and iso_maneuvers.
    """

    offset: Convertible[Scalar] = eqx.field(converter=number, default=1.0)
    exit_width: Convertible[Scalar] = eqx.field(converter=number, default=3.0)

    @property
    def lanes(self) -> tuple[Lane, Lane, Lane]:
        """Entry lane, side lane and exit lane; the right edges of the first and the last are in line."""
        widths = [1.1 * self.width + 0.25, self.width + 1.0, self.exit_width]
        return _lanes(self.start, _OBSTACLE_AVOIDANCE, widths, widths[0] + self.offset)


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
