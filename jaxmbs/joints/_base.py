"""Base of joints: a run of simple joints for the tree, and closure rows for the cut of a loop."""

from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..drawings import Drawing
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import Matrix3, Scalar, ScalarLike


class Node(NamedTuple):
    """One simple joint of a run: `kind` is revolute, prismatic, screw or ball; `axis` a canonical axis x, y or z."""

    kind: str
    axis: str = "z"


#: Units of the coordinates of simple joints.
UNITS = {"revolute": ("rad",), "screw": ("rad",), "prismatic": ("m",), "ball": ("",) * 4}


class AbstractJoint(eqx.Module):
    """A joint between a frame on the parent and a frame on the child.

    `nodes` is the run of simple joints from parent to child in canonical axes; `basis()` turns canonical axes into
    the axes of the joint frame, so that an axis chosen by the user costs nothing later.  `closure(R, d)` gives the
    rows that vanish while the joint is closed, from the child frame's rotation R (3, 3) and displacement d (3,) in
    the canonical axes of the parent frame.  Kinds that roll or slide add `num_slips` rows `slip(R, d, omega, v)`,
    speeds that vanish though no coordinate does.  `labels` names the coordinates, `row_units` gives each row's unit,
    closure rows before slips.  `is_reversible`: True if the run of nodes with its axis reversed is the same joint
    traversed from child to parent, so that the tree may have it either way.  `may_depend_on_time`: True if the rows
    are those of `closure_at`, which follow a path in time.  `symbol`: how pictures show the joint, one of
    `drawings.JOINT_SYMBOLS`.

    Coordinates are those of the child frame in the parent frame, positive along the axis or right-handed about it,
    and zero (a quaternion one) where the two frames agree: the zero pose of a mechanism is drawn by its frames alone.
    A joint traversed from child to parent keeps its sign.
    """

    nodes: ClassVar[tuple[Node, ...]] = ()
    labels: ClassVar[tuple[str, ...]] = ()
    row_units: ClassVar[tuple[str, ...]] = ()
    num_slips: ClassVar[int] = 0
    is_reversible: ClassVar[bool] = False
    may_depend_on_time: ClassVar[bool] = False
    symbol: ClassVar[str] = "point"
    __repr__ = fields_repr

    @property
    def num_rows(self) -> int:
        """Number of velocity rows: closure rows and slips."""
        return len(self.row_units)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the coordinates; those of a quaternion have none."""
        return tuple(unit for node in self.nodes for unit in UNITS[node.kind])

    @property
    def own_labels(self) -> tuple[str, ...]:
        """Labels of the coordinates of this one, where its numbers name them; by default those of its class."""
        return self.labels

    def basis(self) -> Matrix3:
        """Rotation (3, 3) from canonical axes to the axes of the joint frame."""
        return jnp.eye(3)

    def lead(self) -> Scalar:
        """Advance per radian [m/rad] of a screw; 0 for every other joint."""
        return jnp.zeros(())

    def closure(self, R: Array, d: Array) -> Array:
        """Rows (num_rows - num_slips,) that vanish when closed: lengths [m] or tangents of half angles."""
        raise NotImplementedError(f"a {type(self).__name__} joint leaves all motions free, so it cannot close a loop")

    def closure_at(self, R: Array, d: Array, t: ScalarLike) -> Array:
        """`closure` at a time [s]."""
        return self.closure(R, d)

    def slip(self, R: Array, d: Array, omega: Array, v: Array) -> Array:
        """Speeds (num_slips,) [m/s] that vanish, linear in the relative angular velocity omega [rad/s] and velocity v
        of the child frame's origin, in the canonical axes of the parent frame."""
        raise NotImplementedError(f"{type(self).__name__} has no slips")

    def drawing(self) -> Drawing:
        """Shapes (`jaxmbs.drawings`) beside the symbol, in the frames 0 of the parent and 1 of the child."""
        return ()

    def faults(self) -> list[str]:
        """Faults of concrete values, one sentence each; none when traced."""
        return []


def axis_direction(axis):
    """Unit or raw direction (3,) from a name such as "x" or "-z", or from three numbers."""
    if isinstance(axis, str):
        sign = -1.0 if axis.startswith("-") else 1.0
        name = axis.lstrip("+-")
        if name not in ("x", "y", "z"):
            raise ValueError(f"axis {axis!r} is not one of x, y, z, -x, -y, -z or three numbers")
        return as_array(sign * np.eye(3)["xyz".index(name)])
    axis = as_array(axis)
    if axis.shape != (3,):
        raise ValueError(f"an axis needs three numbers, got shape {axis.shape}")
    return axis


def axis_faults(axis) -> list[str]:
    """Faults of an axis: zero or not finite, when its values are concrete."""
    if not is_concrete(axis):
        return []
    length = np.linalg.norm(np.asarray(axis))
    return [] if np.isfinite(length) and length > 1e-12 else ["its axis has no direction (zero or not finite)"]


#: Length of `half_angle_tangents` at half a turn: 2 (1 - cosine).
HALF_TURN_RESIDUAL = 4.0
_HALF_TURN_ROUNDING = 1e-15  # 1 + cosine at rounding: this is half a turn, and the sine has lost its direction


def half_angle_tangents(sine, cosine):
    """Twice the tangent of half an angle along `sine` (n,), a vector of that length, given its cosine ().

    Beyond a quarter turn 2 (1 - cosine): finite, rising up to half a turn, and not zero there, where the sine is.
    """
    some = np.eye(1, sine.shape[0], dtype=sine.dtype)[0]
    sine = jnp.where(1.0 + cosine < _HALF_TURN_ROUNDING, some, sine)
    held = lax.stop_gradient(sine)
    return _half_angle_factor(cosine, jnp.dot(held, held)) * sine


@jax.custom_jvp
def _half_angle_factor(cosine, square):
    """Factor by which `half_angle_tangents` multiplies the sine, the root of `square`."""
    return jnp.where(cosine < 0.0, 2.0 * (1.0 - cosine) * lax.rsqrt(square), 2.0 / (1.0 + cosine))


@_half_angle_factor.defjvp
def _half_angle_factor_jvp(primals, tangents):
    # by the cosine alone, of which the sine is a function: few operations, and none that overflows where it is zero
    cosine, square = primals
    stretch, above = _half_angle_factor(cosine, square), jnp.maximum(1.0 + cosine, _HALF_TURN_ROUNDING)
    return stretch, -stretch * tangents[0] / jnp.where(cosine < 0.0, above * (1.0 - cosine), above)


def parallel_rows(R: Matrix3) -> Float[Array, "2"]:
    """Two rows that vanish when the child's z lies along the parent's z, and only then; twice the tangents of half
    the angles between them.

    Args: R: (3, 3), rotation of the child in the canonical axes of the parent.
    """
    z = R[:, 2]
    return half_angle_tangents(z[:2], z[2])


def alignment_rows(R):
    """Three rows that vanish when the rotation R is the identity, and only then; along its axis, by
    `half_angle_tangents`."""
    skew = jnp.stack([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return half_angle_tangents(skew / 2.0, (jnp.trace(R) - 1.0) / 2.0)
