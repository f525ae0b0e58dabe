"""Constraints beside joints: rows between two frames, and rows between joint coordinates."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, is_concrete
from ..drawings import Drawing, Plane, Rail, Symbol
from ..runtime import KnownFunction, as_array
from ..typing import ArrayLike, Convertible, ScalarLike
from ._base import AbstractJoint
from ._rows import AbstractRows, CouplerRow, LinearCouplerRow


class AbstractClosure(AbstractJoint):
    """Rows on the pose of frame B in frame A, like those of a cut joint, but with no joint behind them."""


class Distance(AbstractClosure):
    """A massless rod with ball ends: the two origins stay `length` [m] apart, `(d.d / length - length) / 2 = 0`.

    One row [m].  Its multiplier is the rod's force [N], positive where it pushes the ends apart; `reactions` gives
    the force on frame B.
    """

    row_units: ClassVar[tuple[str, ...]] = ("m",)

    length: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)

    def drawing(self) -> Drawing:
        return (Symbol("rod"),)

    def closure(self, R: Array, d: Array) -> Array:
        return ((jnp.dot(d, d) / self.length - self.length) / 2.0)[None]

    def faults(self) -> list[str]:
        bad = is_concrete(self.length) and not (np.isfinite(self.length) and self.length > 0)
        return ["its length is not positive; for coinciding points use a Spherical joint"] if bad else []


class PointOnPlane(AbstractClosure):
    """The origin of frame B stays in the x-y plane of frame A.

    One row [m]: z of the origin in frame A, positive along the z axis of A; so is its multiplier [N], the force on B.
    """

    row_units: ClassVar[tuple[str, ...]] = ("m",)

    def drawing(self) -> Drawing:
        return (Plane(0),)

    def closure(self, R: Array, d: Array) -> Array:
        return d[2:]


class PointOnLine(AbstractClosure):
    """The origin of frame B stays on the z axis of frame A.

    Two rows [m]: x, then y of the origin in frame A, positive along the axes of A; their multipliers [N] are the
    force on B.
    """

    row_units: ClassVar[tuple[str, ...]] = ("m", "m")

    def drawing(self) -> Drawing:
        return (Rail(0),)

    def closure(self, R: Array, d: Array) -> Array:
        return d[:2]


class Coupler(AbstractRows):
    """A gear, rack or cam between joint coordinates q_i: `sum c_i q_i = offset`, or `function(*q) = 0`.

    One row, in the unit of c q.  Coordinates count as the joints count them, positive as they are: external gears of
    20 and 60 teeth are `{"pinion": 20, "wheel": 60}` with a positive sign each, internal ones have opposite signs,
    and a rack on a pinion of radius r is `{"rack": 1, "pinion": -r}`.  Joints of one coordinate only.

    Args:
        coefficients: joint name -> coefficient (any value when `function` is given: only the order counts).
        offset: right-hand side [unit of c q].
        function: scalar function of the coordinates, in the order of `coefficients`.
    """

    joints: tuple[str, ...] = eqx.field(static=True)  # type: ignore[misc]
    coefficients: Float[Array, " joints"]
    offset: Float[Array, ""]
    function: Callable | None = eqx.field(static=True)

    def __init__(
        self, coefficients: Mapping[str, ArrayLike], offset: ArrayLike = 0.0, function: Callable | None = None
    ) -> None:
        self.joints = tuple(coefficients)
        self.coefficients = jnp.stack([as_array(c) for c in coefficients.values()])
        self.offset = as_array(offset)
        self.function = function

    def row(self, known: Callable) -> AbstractRows:
        """Its row without the names of joints, so that couplers of as many joints are rows of one structure."""
        if self.function is None:
            return LinearCouplerRow(self.coefficients, self.offset)
        return CouplerRow(KnownFunction(self.function), self.offset)

    def faults(self) -> list[str]:
        zero = self.function is None and is_concrete(self.coefficients) and not np.any(self.coefficients)
        infinite = any(any_concrete(lambda x: ~np.isfinite(x), value) for value in (self.coefficients, self.offset))
        return faults_if(
            (zero, "all its coefficients are zero"),
            (infinite, "its numbers are not finite"),
            (len(set(self.joints)) < len(self.joints), f"it names a joint twice: {', '.join(self.joints)}"),
            (
                np.shape(self.coefficients) != (len(self.joints),),
                f"it has {np.size(self.coefficients)} coefficients for {len(self.joints)} joints",
            ),
        )


class VelocityRows(AbstractRows):
    """Rows of velocity given by the user (nonholonomic): `function(coordinates (nq,), velocities (nv,), t) -> (m,)`.

    Zero when satisfied, affine in the velocities.  Coordinates and velocities are in the order of those of a `State`,
    `system.columns("joint")` finds the velocities of a joint; a row has the unit that the function gives it, and its
    sign.
    """

    is_nonholonomic: ClassVar[bool] = True
    reads_all: ClassVar[bool] = True
    takes: ClassVar[str] = "coordinates (nq,), velocities (nv,), t"

    function: Callable

    def slip(self, q: Array, u: Array, t: ScalarLike) -> Array:
        """The rows (m,)."""
        return jnp.atleast_1d(self.called(q, u, t))

    def called(self, q: Array, u: Array, t: ScalarLike) -> Any:
        """`function(q, u, t)`."""
        return self.function(q, u, t)

    def row(self, known: Callable) -> AbstractRows:
        """The same with a function that is compared by its content."""
        return VelocityRows(known(self.function))


class PositionRows(AbstractRows):
    """Holonomic rows given by the user: `function(coordinates (nq,), t) -> (m,)`, zero when satisfied.

    Coordinates are in the order of those of a `State`; a row has the unit that the function gives it, and its sign.
    A function with design parameters should be an `equinox.Module`, whose numbers are then leaves of the system.
    """

    reads_all: ClassVar[bool] = True
    takes: ClassVar[str] = "coordinates (nq,), t"

    function: Callable

    def value(self, rotations: Array, positions: Array, q: Array, t: ScalarLike) -> Array:
        """The rows (m,)."""
        return jnp.atleast_1d(self.called(q, q, t))

    def called(self, q: Array, u: Array, t: ScalarLike) -> Any:
        """`function(q, t)`."""
        return self.function(q, t)

    def row(self, known: Callable) -> AbstractRows:
        """The same with a function that is compared by its content."""
        return PositionRows(known(self.function))
