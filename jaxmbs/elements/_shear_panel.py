"""`ShearPanel`: a web of four nodes that carries shear flows along its sides only."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..typing import Convertible
from ._base import AbstractElement, as_real
from ._shared_matrices import axes_across, gauss_points, inverse_jacobian, linear_shapes

_CORNERS = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
_POINTS, _WEIGHTS = gauss_points(2, 2)
_N, _DN = linear_shapes(_CORNERS, _POINTS)


class ShearPanel(AbstractElement):
    """Panel in pure shear, displacements only; a warped one by forces across it, of least squares, that balance it.

    Force: its shear flow [N/m], of a trapezoid that of the sides which are not parallel, in other shapes the
    geometric mean of the four; positive where it draws nodes 0 and 2 apart.  Stress [Pa]: the flow over thickness.
    The work is `q^2 A / 2 G t`, exact for rectangles and trapezoids.
    Source: Kuhn, Stresses in aircraft and shell structures (1956), 3.

    Attributes:
        shear_modulus [Pa]; thickness [m]; density [kg/m^3].
    """

    shear_modulus: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    thickness: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)

    num_nodes = 4
    coordinates = 3
    nonnegative_fields = ("shear_modulus", "thickness", "density")
    positive_fields = ("shear_modulus", "thickness")
    force_labels = ("flow",)
    stress_labels = ("xy",)
    degeneracy = "its corners do not go round a convex outline"

    def _flow(self, nodes):
        """Forces (12,) at the nodes of a unit shear flow, and the area."""
        first, second = nodes[2] - nodes[0], nodes[3] - nodes[1]
        axes = axes_across(first, second, first - second)
        place = (nodes - jnp.mean(nodes, axis=0, keepdims=True)) @ axes.T
        xy = place[:, :2]
        sides = jnp.roll(xy, -1, axis=0) - xy
        lengths = jnp.linalg.norm(sides, axis=1)
        along = sides / lengths[:, None]
        moments = xy[:, 0] * along[:, 1] - xy[:, 1] * along[:, 0]
        balance = jnp.stack([along[:, 0], along[:, 1], moments])  # (3, 4): what four forces along the sides must do
        forces = jnp.stack([(-1.0) ** k * jnp.linalg.det(jnp.delete(balance, k, axis=1)) for k in range(4)])
        flows = forces / lengths
        forces = forces / jnp.exp(jnp.mean(jnp.log(jnp.abs(flows)))) * -jnp.sign(flows[0])
        halves = 0.5 * forces[:, None] * along
        in_plane = halves + jnp.roll(halves, 1, axis=0)
        area = 0.5 * jnp.linalg.norm(jnp.cross(first, second))
        return (in_plane @ axes[:2] + _kicks(in_plane, place)[:, None] * axes[2:]).reshape(-1), area

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """`G t / A f f^T`, f the forces of a unit flow."""
        f, area = self._flow(nodes)
        return self.shear_modulus * self.thickness / area * jnp.outer(f, f)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass."""
        first, second = nodes[2] - nodes[0], nodes[3] - nodes[1]
        axes = axes_across(first, second, first - second)
        areas = inverse_jacobian(_DN, nodes @ axes[:2].T)[1] * _WEIGHTS.astype(nodes.dtype)
        N = _N.astype(nodes.dtype)
        line = self.density * self.thickness
        return jnp.kron(line * (N.T * areas[None]) @ N, jnp.eye(3, dtype=nodes.dtype))

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Shear flow [N/m]. Source: S1 (30)."""
        f, area = self._flow(nodes)
        return (self.shear_modulus * self.thickness / area * (f @ u.reshape(-1)))[None]

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Shear stress [Pa]. Source: S1 (30)."""
        return self.forces(nodes, u) / self.thickness

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of elements with a corner of 180 degrees or more."""
        normal = np.cross(nodes[:, 2] - nodes[:, 0], nodes[:, 3] - nodes[:, 1])
        after, before = np.roll(nodes, -1, axis=1) - nodes, np.roll(nodes, 1, axis=1) - nodes
        return np.any(np.sum(np.cross(after, before) * normal[:, None], axis=2) <= 0, axis=1)


def _kicks(forces, place):
    """Forces (4,) across the mean plane that balance the moments of forces (4, 2) in it, at heights place[:, 2]."""
    x, y, height = place.T
    moments = jnp.stack([jnp.zeros_like(height[0]), -(height @ forces[:, 1]), height @ forces[:, 0]])
    R = jnp.stack([jnp.ones_like(x), y, -x])
    return -R.T @ jnp.linalg.solve(R @ R.T, moments)
