"""Laws of constraint rows: what vanishes at poses of frames and at coordinates, and how it changes with them.

A new kind of row is a law here or in the room of its subject; the walks over all rows are `constraints._rows`.
"""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from ..drawings import Drawing
from ..math._linalg import skew
from ..tables import fields_repr
from ..typing import ScalarLike


class AbstractRows(eqx.Module):
    """Rows that vanish: a function of the poses of k frames, of m coordinates and of time.

    A kind of row defines `value`, or `slip` where it restricts velocities alone.  `slopes` follow by differentiation;
    a kind that knows them in closed form gives them itself.

    `num_frames`: k, the frames in `constraint(..., between=)`; `joints`: names of the m joints, of one coordinate
    each.  `prescribes`: each row holds one coordinate at a value in time; `is_nonholonomic`: the rows restrict
    velocities alone; `reads_all`: they are functions of all coordinates and velocities of the mechanism;
    `has_ends`: the law has a `validity(frames, multipliers)`, of a `forces.PathKinematics` and its loads (rows,),
    which gives `forces.Margin`s by name; `has_report`, `has_arrows`: so it has a `report` of `forces.Reading`s by
    name, and `arrows`, a `forces.Arrows`; `has_corners`: its slopes change at some poses at once, beside which
    numbers (n,) of `sides_of_corners(rotations, positions)` are constant; `takes`: arguments of a function of the
    user's that the law calls, `gives_one`: which gives one number.
    """

    num_frames: ClassVar[int] = 0
    joints: ClassVar[tuple[str, ...]] = ()
    prescribes: ClassVar[bool] = False
    is_nonholonomic: ClassVar[bool] = False
    reads_all: ClassVar[bool] = False
    has_ends: ClassVar[bool] = False
    has_report: ClassVar[bool] = False
    has_arrows: ClassVar[bool] = False
    has_corners: ClassVar[bool] = False
    takes: ClassVar[str] = ""
    gives_one: ClassVar[bool] = False
    __repr__ = fields_repr

    def row(self, known: Callable) -> "AbstractRows":
        """The law as systems hold it.  Args: known: makes functions of the user's comparable by their content."""
        return self

    def called(self, q: Array, u: Array, t: ScalarLike) -> Any:
        """Value of the function of the user's, if the law calls one, in the shape that it has."""
        raise NotImplementedError

    def drawing(self) -> Drawing:
        """Shapes (`jaxmbs.drawings`) in the frames that the rows act on; none by default."""
        return ()

    def faults(self) -> list[str]:
        """Faults of concrete values, one sentence each; none when traced."""
        return []

    @property
    def may_depend_on_time(self) -> bool:
        """True if the rows may be functions of time."""
        return True

    def is_length(self, kinds: tuple[str, ...]) -> bool:
        """True if the rows are lengths [m], else they are angles, or in a unit of the user's.

        Args: kinds: of the simple joints that the coordinates belong to, "revolute", "prismatic", ...
        """
        return False

    def value(
        self, rotations: Float[Array, "k 3 3"], positions: Float[Array, "k 3"], q: Float[Array, " m"], t: ScalarLike
    ) -> Float[Array, " rows"]:
        """The rows, zero where they are kept, at poses in world axes and coordinates."""
        raise NotImplementedError(f"{type(self).__name__} restricts velocities alone")

    def slip(self, q: Float[Array, " nq"], u: Float[Array, " nv"], t: ScalarLike) -> Float[Array, " rows"]:
        """Rows of velocity, affine in the velocities, zero where they are kept."""
        raise NotImplementedError(f"{type(self).__name__} restricts positions")

    def slopes(
        self, rotations: Float[Array, "k 3 3"], positions: Float[Array, "k 3"], q: Float[Array, " m"], t: ScalarLike
    ) -> tuple[Float[Array, "rows k 6"], Float[Array, "rows m"]]:
        """Derivatives of `value` by the twists of the frames (angular velocity, velocity of the point at the origin,
        in world axes), and by the coordinates."""
        still = jnp.zeros((len(positions), 6), positions.dtype)

        def moved(twists):
            turned = jax.vmap(skew)(twists[:, :3])
            places = positions + twists[:, 3:] + jnp.einsum("kij,kj->ki", turned, positions)
            return self.value(rotations + turned @ rotations, places, q, t)

        jacobian = jax.jacrev if self.reads_all else jax.jacfwd  # rows, or joints, one by one
        by_q = jacobian(lambda q: self.value(rotations, positions, q, t))(q)
        return (jax.jacfwd(moved)(still) if len(still) else jnp.zeros((len(by_q), 0, 6), q.dtype)), by_q

    def value_and_slopes(
        self, rotations: Float[Array, "k 3 3"], positions: Float[Array, "k 3"], q: Float[Array, " m"], t: ScalarLike
    ) -> tuple[Float[Array, " rows"], tuple[Float[Array, "rows k 6"], Float[Array, "rows m"]]]:
        """Both, for laws that find them together."""
        return self.value(rotations, positions, q, t), self.slopes(rotations, positions, q, t)


class DriveRow(AbstractRows):
    """Row of a drive: the coordinate of a joint is a function of time."""

    prescribes: ClassVar[bool] = True

    signal: Any

    def is_length(self, kinds: tuple[str, ...]) -> bool:
        """True for joints that slide."""
        return kinds == ("prismatic",)

    def value(self, rotations: Array, positions: Array, q: Array, t: ScalarLike) -> Array:
        """The coordinate beyond its value in time (1,)."""
        return q - jnp.reshape(jnp.asarray(self.signal(t), q.dtype), (1,))

    def slopes(self, rotations: Array, positions: Array, q: Array, t: ScalarLike) -> tuple[Array, Array]:
        """One by the coordinate."""
        return jnp.zeros((1, 0, 6), q.dtype), jnp.ones((1, 1), q.dtype)


class LinearCouplerRow(AbstractRows):
    """Row of a `Coupler`, linear in the coordinates of its joints."""

    coefficients: Float[Array, " joints"]
    offset: Float[Array, ""]

    @property
    def may_depend_on_time(self) -> bool:
        """False."""
        return False

    def value(self, rotations: Array, positions: Array, q: Array, t: ScalarLike) -> Array:
        """`sum c_i q_i - offset` (1,)."""
        return jnp.reshape(jnp.dot(self.coefficients, q) - self.offset, (1,))

    def slopes(self, rotations: Array, positions: Array, q: Array, t: ScalarLike) -> tuple[Array, Array]:
        """The coefficients."""
        return jnp.zeros((1, 0, 6), q.dtype), self.coefficients[None].astype(q.dtype)


class CouplerRow(AbstractRows):
    """Row of a `Coupler` by a function of the coordinates of its joints."""

    takes: ClassVar[str] = "the coordinates of its joints"
    gives_one: ClassVar[bool] = True

    function: Callable = eqx.field(static=True)
    offset: Float[Array, ""]

    @property
    def may_depend_on_time(self) -> bool:
        """False."""
        return False

    def value(self, rotations: Array, positions: Array, q: Array, t: ScalarLike) -> Array:
        """`function(*q) - offset` (1,)."""
        return jnp.reshape(self.called(q, q, t) - self.offset, (1,))

    def called(self, q: Array, u: Array, t: ScalarLike) -> Any:
        """`function(*q)`."""
        return self.function(*q)
