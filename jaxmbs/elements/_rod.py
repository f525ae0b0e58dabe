"""`Rod`: straight truss member that carries axial force only."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..checks import flag
from ..typing import Convertible
from ._base import AbstractElement, as_real


class Rod(AbstractElement):
    """Truss member, displacements only.  Force [N] and stress [Pa]: tension positive.

    Attributes:
        young: modulus [Pa]; area [m^2]; density [kg/m^3].
        lumped: half of the mass on each node; else the consistent mass.
    """

    young: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    area: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)
    lumped: bool = eqx.field(static=True, converter=flag("lumped"), default=False)

    num_nodes = 2
    coordinates = 3
    positive_fields = ("young", "area")
    force_labels = ("axial",)
    stress_labels = ("axial",)

    def _strain(self, nodes):
        """Row (6,) of the axial strain by displacements, and the length."""
        line = nodes[1] - nodes[0]
        length = jnp.linalg.norm(line)
        return jnp.concatenate([-line, line]) / length**2, length

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness `E A l b b^T`, b the strain row."""
        strain, length = self._strain(nodes)
        return self.young * self.area * length * jnp.outer(strain, strain)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass `rho A l / 6 [2 E, E; E, 2 E]`, or half of the mass on each node."""
        length = self._strain(nodes)[1]
        share = jnp.asarray([[1 / 2, 0.0], [0.0, 1 / 2]] if self.lumped else [[1 / 3, 1 / 6], [1 / 6, 1 / 3]])
        share = share.astype(nodes.dtype)
        return self.density * self.area * length * jnp.kron(share, jnp.eye(3, dtype=nodes.dtype))

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Tension [N]. Source: S1 (30)."""
        return self.area * self.stresses(nodes, u)

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Axial stress [Pa]. Source: S1 (30)."""
        return (self.young * (self._strain(nodes)[0] @ u.reshape(-1)))[None]

    def geometric_stiffness(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "n n"]:
        """Of the tension N, `N/l [E, -E; -E, E]` across the axis.

        Source: Przemieniecki, Theory of matrix structural analysis (1968), 15.2.
        """
        line = nodes[1] - nodes[0]
        length = jnp.linalg.norm(line)
        axis = line / length
        across = jnp.eye(3, dtype=nodes.dtype) - jnp.outer(axis, axis)
        bar = jnp.asarray([[1.0, -1.0], [-1.0, 1.0]], nodes.dtype)
        return self.forces(nodes, u)[0] / length * jnp.kron(bar, across)
