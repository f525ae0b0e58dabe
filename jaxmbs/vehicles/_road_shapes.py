"""Roads of known shape: splines through measured heights, a sine, a cleat."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import any_concrete, check_count, faults_if, not_positive
from ..contact import HeightField
from ..drawings import Drawing, HeightSurface
from ..forces._fields import number
from ..forces._validity import Margin
from ..typing import Convertible, Scalar, WordedError
from ._road import AbstractRoad

_GOLDEN = 0.6180339887498949
_MANY = 100_000  # places are enough for every road
_ROUNDS = 40  # of the golden section: where a cam touches is known to 1e-9 of its length


class SurfaceRoad(AbstractRoad):
    """A road through measured heights: a profile along x that is the same for every y, or a grid.

    Beyond the measurement it goes on straight; a wheel there is beyond the model's validity.

    Attributes: field: `contact.HeightField(x, heights)`, or `HeightField(x, heights, y)`.
    """

    field: WordedError[HeightField]

    def __check_init__(self):
        if not isinstance(self.field, HeightField):
            raise TypeError(f"field must be a HeightField, got {type(self.field).__name__}")

    def height(self, x: Any, y: Any) -> Any:
        return self.field(x, y)

    def slopes(self, x: Any, y: Any) -> tuple[Any, Any]:
        slopes = self.field.derivatives(jnp.stack([number(x), number(y)]))[1]
        return slopes[0], slopes[1]

    def validity(self, place: Any) -> dict[str, Margin]:
        """Way that is left to the end of the measurement [m]."""
        known = ((place[0], self.field.x), (place[1], self.field.y))
        left = [side for at, ends in known if ends is not None for side in (at - ends[0], ends[-1] - at)]
        return {"road": Margin(jnp.min(jnp.stack(left)), "m", "rolls beyond the end of its measured road")}

    def drawing(self) -> Drawing:
        """The surface as long as the measurement."""
        return (HeightSurface(self.field, (self.field.x[0], self.field.x[-1]), 0),)


class SineRoad(AbstractRoad):
    """A road with waves: `amplitude sin(2 pi x / wavelength + phase + sidewards y)`.

    Attributes:
        amplitude: [m].
        wavelength: > 0 [m].
        phase: [rad].
        sidewards: lag of the wave to the side [rad/m]: pi over the track has the wheels of an axle in opposite phase.
    """

    amplitude: Convertible[Scalar] = eqx.field(converter=number)
    wavelength: Convertible[Scalar] = eqx.field(converter=number)
    phase: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    sidewards: Convertible[Scalar] = eqx.field(converter=number, default=0.0)

    def height(self, x: Any, y: Any) -> Any:
        return self.amplitude * jnp.sin(self._angle(x, y))

    def slopes(self, x: Any, y: Any) -> tuple[Any, Any]:
        rise = self.amplitude * jnp.cos(self._angle(x, y))
        return rise * 2.0 * np.pi / self.wavelength, rise * self.sidewards

    def _angle(self, x, y):
        return 2.0 * np.pi * x / self.wavelength + self.phase + self.sidewards * y

    def faults(self) -> list[str]:
        """A positive wavelength."""
        return super().faults() + faults_if(
            (not_positive(self.wavelength), "wavelength must be positive"),
            (any(np.shape(x) for x in (self.amplitude, self.wavelength, self.phase)), "each is one number"),
        )


class CleatRoad(AbstractRoad):
    """A flat road with a bar or a hole across: its height rises over ramps at both ends.

    Feel it through `TandemCams`: a tyre is longer than the ramps.

    Attributes: start: of the first ramp, x [m]; length: with both ramps [m]; rise: height, negative for a hole [m];
    ramp: length of a ramp, up to half of the length [m].
    """

    start: Convertible[Scalar] = eqx.field(converter=number)
    length: Convertible[Scalar] = eqx.field(converter=number)
    rise: Convertible[Scalar] = eqx.field(converter=number)
    ramp: Convertible[Scalar] = eqx.field(converter=number, default=1e-3)

    def height(self, x: Any, y: Any) -> Any:
        inside = jnp.minimum(x - self.start, self.start + self.length - x) / self.ramp
        return self.rise * jnp.clip(inside, 0.0, 1.0)

    def faults(self) -> list[str]:
        """Lengths that go with each other."""
        return super().faults() + faults_if(
            (not_positive(self.length), "length must be positive"),
            (not_positive(self.ramp), "ramp must be positive"),
            (any_concrete(lambda a, b: a > b / 2, self.ramp, self.length), "ramp must be at most half of the length"),
        )


class TandemCams(AbstractRoad):
    """A road as a tyre feels it that rolls over short obstacles: by two elliptical cams in tandem.

    Each cam lies on the road; the tyre feels the plane through both, `height` the mean of their heights above the
    ground.  Cams have the outline `|x/a|^c + |z/b|^c = 1`.

    Attributes:
        road: as it is.
        base: distance of the cams [m], about 0.8 of the contact's length.
        half_length, half_height: of a cam, a and b [m], about 1.03 and 1.0 of the free radius.
        exponent: c, about 1.8.
        points: at which the search for where a cam touches starts (static).

    Source: Schmeitz (2004); Pacejka (2012), chapter 10.1.6.
    """

    road: WordedError[AbstractRoad]
    base: Convertible[Scalar] = eqx.field(converter=number)
    half_length: Convertible[Scalar] = eqx.field(converter=number)
    half_height: Convertible[Scalar] = eqx.field(converter=number)
    exponent: Convertible[Scalar] = eqx.field(converter=number, default=1.8)
    points: int = eqx.field(static=True, default=81)

    def __check_init__(self):
        if not isinstance(self.road, AbstractRoad):
            raise TypeError(f"road must be a road, got {type(self.road).__name__}")
        check_count("points", self.points, 3)
        if self.points > _MANY:
            raise ValueError(f"points must be at most {_MANY}, got {self.points}")

    def height(self, x: Any, y: Any) -> Any:
        return self.plane(jnp.stack([number(x), number(y)]), jnp.asarray([1.0, 0.0]))[0][2]

    def plane(self, place: Any, ahead: Any) -> tuple[Any, Any]:
        front, rear = (self._cam(place + s * self.base * ahead, ahead) for s in (0.5, -0.5))
        slope = (front - rear) / self.base
        point = jnp.concatenate([place, 0.5 * (front + rear)[None]])
        across = self.road.slopes(place[0], place[1])
        side = across[1] * ahead[0] - across[0] * ahead[1]
        steep = jnp.stack(
            [-slope * ahead[0] + side * ahead[1], -slope * ahead[1] - side * ahead[0], 1.0 + 0.0 * slope]
        )
        return point, steep / jnp.sqrt(jnp.sum(steep * steep))

    def _cam(self, place, ahead):
        """Height of a cam at a place (2,), above that of a cam on the ground.

        The search for where it touches has no derivative: the point of the road there is fixed, the cam moves over
        it, which is right on smooth roads and at corners alike.
        """
        fixed, start, along = lax.stop_gradient((self, place, ahead))
        reach = lax.stop_gradient(fixed._touch(start, along)) * fixed.half_length
        at = start + reach * along
        offset = jnp.dot(at - place, ahead) / self.half_length
        return self.road.height(at[0], at[1]) + self.half_height * (self._outline(offset) - 1.0)

    def _touch(self, place, ahead):
        """Place of the cam that touches, from -1 to 1: the best of many, then a golden section search around it."""

        def lift(s):
            at = place + s * self.half_length * ahead
            return self.road.height(at[0], at[1]) + self.half_height * self._outline(s)

        grid = np.sin(np.linspace(-np.pi / 2, np.pi / 2, self.points))
        k = jnp.argmax(jax.vmap(lift)(jnp.asarray(grid, place.dtype)))
        ends = (np.maximum(np.arange(self.points) - 1, 0), np.minimum(np.arange(self.points) + 1, self.points - 1))
        low, high = (jnp.asarray(grid[end], place.dtype)[k] for end in ends)

        def shrink(_, ends):
            low, high = ends
            left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            is_left = lift(left) > lift(right)
            return jnp.where(is_left, low, left), jnp.where(is_left, right, high)

        low, high = lax.fori_loop(0, _ROUNDS, shrink, (low, high))
        return 0.5 * (low + high)

    def _outline(self, s):
        """Height of the lower half of the outline over its middle, from 1 below to 0 at its ends."""
        size = jnp.abs(s)
        inside = 1.0 - jnp.where(size > 0.0, jnp.where(size > 0.0, size, 1.0) ** self.exponent, 0.0)
        below = inside > 0.0
        return jnp.where(below, jnp.where(below, inside, 1.0) ** (1.0 / self.exponent), 0.0)

    def validity(self, place: Any) -> dict[str, Margin]:
        """That of the road as it is."""
        return self.road.validity(place)

    def drawing(self) -> Drawing:
        """The road as it is."""
        return self.road.drawing()

    def faults(self) -> list[str]:
        """Positive lengths."""
        found = super().faults()
        for name in ("base", "half_length", "half_height", "exponent"):
            found += faults_if((not_positive(getattr(self, name)), f"{name} must be positive"))
        return found
