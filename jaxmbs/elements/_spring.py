"""Springs and bushings of six directions, between two nodes or from one to ground."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import are_axes, is_concrete
from ..typing import Convertible
from ._base import DIRECTIONS, AbstractElement, as_optional_real, as_real
from ._shared_matrices import axes_transformation, rigid_arm


def _as_six_by_six(value):
    """Convert a matrix, or six numbers of a diagonal, to (..., 6, 6)."""
    value = as_real(value)
    if value.shape == (6,):
        return jnp.diag(value)
    if value.shape[-2:] != (6, 6):
        raise ValueError(f"a spring needs six numbers or (6, 6), not the shape {value.shape}")
    return value


def _as_optional_six_by_six(value):
    return None if value is None else _as_six_by_six(value)


class Spring(AbstractElement):
    """Bushing between two nodes: force by the relative motion at one point, so that rigid motions strain nothing.

    Forces: what the second node puts on the spring along x y z [N], then moments about x y z [N m], in its own axes;
    positive where the second node moves, or turns, along the axis from the first.

    Attributes:
        matrix: (6, 6) stiffness x y z rx ry rz in the spring's axes, or six numbers [N/m, N, N m/rad].
        damper: (6, 6) likewise [N s/m, N s, N m s/rad], or None.
        axes: (3, 3), rows are the spring's axes in world axes; None: world axes.
        place: where on the line of the nodes the spring sits, 0 at the first, 1 at the second.
    """

    matrix: Convertible[Float[Array, "... 6 6"]] = eqx.field(converter=_as_six_by_six)
    damper: Convertible[Float[Array, "... 6 6"] | None] = eqx.field(converter=_as_optional_six_by_six, default=None)
    axes: Convertible[Float[Array, "... 3 3"] | None] = eqx.field(converter=as_optional_real, default=None)
    place: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.5)

    num_nodes = 2
    force_labels = DIRECTIONS
    nonnegative_fields = ()

    def faults(self) -> list[str]:
        """Messages also for matrices that are not symmetric, and axes that are not orthonormal."""
        named = {"matrix": self.matrix, "damper": self.damper}
        given = {n: np.asarray(v) for n, v in named.items() if v is not None and is_concrete(v)}
        uneven = [name for name, v in given.items() if not _is_symmetric(v)]
        fine = self.axes is None or are_axes(self.axes)
        skewed = [] if fine else ["axes must be three right-handed orthogonal unit vectors"]
        return super().faults() + [f"{name} must be symmetric" for name in uneven] + skewed

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """No spring is degenerate: its nodes may coincide."""
        return np.zeros(len(nodes), bool)

    def relative_motion(self, nodes: Float[Array, "k 3"]) -> Array:
        """Matrix (6, 12) of the relative displacement and rotation, second node minus first, in the spring's axes."""
        line = nodes[1] - nodes[0]
        at_first, at_second = rigid_arm(self.place * line), rigid_arm((self.place - 1.0) * line)
        return _resolve(self.axes, jnp.concatenate([-at_first, at_second], axis=1))

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness `B^T K B` with B the relative motion."""
        B = self.relative_motion(nodes)
        return B.T @ self.matrix @ B

    @property
    def has_damping(self) -> bool:
        return self.damper is not None

    def damping(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Damping `B^T C B` with B the relative motion."""
        B = self.relative_motion(nodes)
        return jnp.zeros_like(B.T @ B) if self.damper is None else B.T @ self.damper @ B

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Zero mass."""
        return jnp.zeros((self.size, self.size), nodes.dtype)

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Force and moment that the second node puts on the spring, in its axes. Source: S1 (30)."""
        return self.matrix @ self.relative_motion(nodes) @ u.reshape(-1)


class GroundSpring(Spring):
    """Bushing from one node to ground, at the node; fields as in `Spring`, `place` unused.

    Forces: what the node puts on the spring along x y z [N], then moments about x y z [N m], in the spring's axes,
    positive as the node moves.
    """

    num_nodes = 1

    def relative_motion(self, nodes: Float[Array, "k 3"]) -> Array:
        """Matrix (6, 6) of the motion of the node in the spring's axes."""
        return _resolve(self.axes, jnp.eye(6, dtype=nodes.dtype))


def _is_symmetric(matrix):
    return np.allclose(matrix, np.swapaxes(matrix, -1, -2), rtol=0, atol=1e-6 * np.abs(matrix).max())


def _resolve(axes, motion):
    return motion if axes is None else axes_transformation(axes) @ motion
