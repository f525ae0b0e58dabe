"""Base of flat shells: transformation to the plane, pressure, and the fields of their sections."""

import abc
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..typing import Convertible, Matrix3, ScalarLike
from ._base import AbstractElement, as_real
from ._shared_matrices import axes_transformation, rigid_arm
from ._shell_section import ShellSection, require_section

_RESULTANTS = ("Nxx", "Nyy", "Nxy", "Mxx", "Myy", "Mxy")


class AbstractShell(AbstractElement):
    """Shell of one section with six coordinates per node, rotation about the normal (drilling) included."""

    force_labels: ClassVar[tuple[str, ...]] = _RESULTANTS

    @property
    @abc.abstractmethod
    def section(self) -> ShellSection:
        """Stiffness and mass per area, in the axes of the element."""

    def axes(self, nodes: Float[Array, "k 3"]) -> Matrix3:
        """Rows x, y, z (3, 3) of the element's axes, z along its normal."""
        raise NotImplementedError

    def membrane(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Stiffness (3 k, 3 k) over u, v, drilling rotation of each node, and strains (3, 3 k) at the centre."""
        raise NotImplementedError

    def bending(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Stiffness (3 k, 3 k) over w, rx, ry of each node, and curvatures (3, 3 k) at the centre."""
        raise NotImplementedError

    def shapes(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Shape functions (q, k) at points of quadrature and the areas (q,) that belong to them."""
        raise NotImplementedError

    def plane_coordinates(self, nodes: Float[Array, "k 3"]) -> tuple[Any, Array]:
        """Positions (k, 2) in the mean plane, and the matrix (6 k, 6 k) of motions there from those of the nodes.

        Motions in the plane are in element axes; a node off the plane is rigidly connected to its projection.
        """
        axes = self.axes(nodes)
        local = (nodes - jnp.mean(nodes, axis=0, keepdims=True)) @ axes.T
        zero = jnp.zeros_like(local[:, 0])
        arms = -jnp.stack([zero, zero, local[:, 2]], axis=1) @ axes
        return local[:, :2], jax.scipy.linalg.block_diag(
            *[axes_transformation(axes) @ rigid_arm(arm) for arm in arms]
        )

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness of membrane and bending."""
        xy, T = self.plane_coordinates(nodes)
        in_plane, across = _plane_rows(self.num_nodes)
        rows = np.concatenate([in_plane, across])
        K = jnp.zeros((self.size, self.size), nodes.dtype).at[np.ix_(rows, rows)].set(self.plane_stiffness(xy))
        return T.T @ K @ T

    def plane_stiffness(self, xy: Float[Array, "k 2"]) -> Float[Array, "n n"]:
        """Stiffness over the displacements u, v and drilling rotations of all nodes, then over w, rx, ry."""
        return jax.scipy.linalg.block_diag(self.membrane(xy)[0], self.bending(xy)[0])

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass per area of displacements and turning mass of rotations, drilling included."""
        xy, T = self.plane_coordinates(nodes)
        N, areas = self.shapes(xy)
        section = self.section
        per_node = jnp.diag(jnp.stack([section.area_mass] * 3 + [section.turning_mass] * 3))
        return T.T @ jnp.kron(jnp.einsum("q,qi,qj->ij", areas, N, N), per_node) @ T

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Membrane forces [N/m] and moments [N] per length at the centre, element axes. Source: S1 (30)."""
        xy, T = self.plane_coordinates(nodes)
        local = (T @ u.reshape(-1)).reshape(self.num_nodes, 6)
        section = self.section
        strain = self.membrane(xy)[1] @ local[:, np.array([0, 1, 5])].reshape(-1)
        curvature = self.bending(xy)[1] @ local[:, 2:5].reshape(-1)
        N, M = section.membrane @ strain, section.bending @ curvature
        if section.coupling is not None:
            N, M = N + section.coupling @ curvature, M + section.coupling @ strain
        return jnp.concatenate([N, M])

    def slopes(self, xy: Float[Array, "k 2"]) -> tuple[Any, Array]:
        """Slopes (q, 2, k) of the shape functions at points of quadrature and the areas (q,) that belong to them."""
        raise NotImplementedError

    def geometric_stiffness(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "n n"]:
        """Of the membrane forces at the centre, `int grad N^T [Nxx, Nxy; Nxy, Nyy] grad N dA` in each direction.

        The shape functions are the linear ones of displacements.
        Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 2, 4.12.
        """
        xy, T = self.plane_coordinates(nodes)
        xx, yy, shear = self.forces(nodes, u)[:3]
        N = jnp.stack([jnp.stack([xx, shear]), jnp.stack([shear, yy])])
        slopes, areas = self.slopes(xy)
        moved = jnp.diag(jnp.asarray([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], nodes.dtype))
        return T.T @ jnp.kron(jnp.einsum("q,qai,ab,qbj->ij", areas, slopes, N, slopes), moved) @ T

    def pressure_load(self, nodes: Float[Array, "k 3"], pressure: ScalarLike) -> Array:
        """Consistent load (6 k,) of a pressure [Pa] along the normal z. Source: S1 (18)."""
        xy, T = self.plane_coordinates(nodes)
        N, areas = self.shapes(xy)
        f = jnp.zeros((self.num_nodes, 6), nodes.dtype).at[:, 2].set(pressure * (areas @ N))
        return T.T @ f.reshape(-1)


class IsotropicFields(AbstractElement):
    """Fields of a shell of one isotropic material, and its stresses.

    Attributes:
        young: modulus [Pa]; poisson; thickness [m]; density [kg/m^3].
    """

    young: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    poisson: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    thickness: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)

    positive_fields: ClassVar[tuple[str, ...]] = ("young", "thickness")
    stress_labels: ClassVar[tuple[str, ...]] = tuple(
        f"{c} {face}" for face in ("top", "bottom") for c in ("xx", "yy", "xy")
    )

    @property
    def section(self) -> ShellSection:
        """Stiffness and mass per area."""
        factor = getattr(self, "shear_factor", 5 / 6)
        return ShellSection.isotropic(self.young, self.poisson, self.thickness, self.density, factor)

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Stresses (6,) at the centre of the top (+z) and the bottom face, element axes. Source: S1 (30)."""
        force = self.forces(nodes, u)
        mean, bent = force[:3] / self.thickness, 6.0 * force[3:6] / self.thickness**2
        return jnp.concatenate([mean + bent, mean - bent])

    def corner_stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "k s"]:
        """Stresses (k, 6) at the corners as at the centre, of the displacements of the nodes alone."""
        shell: Any = self
        xy, T = shell.plane_coordinates(nodes)
        local = (T @ u.reshape(-1)).reshape(-1, 6)
        membrane, curvature = shell.corner_strains(xy)
        strain = membrane @ local[:, np.array([0, 1, 5])].reshape(-1)
        bent = curvature @ local[:, 2:5].reshape(-1) * self.thickness / 2
        moduli = self.section.membrane / self.thickness
        return jnp.concatenate([(strain + bent) @ moduli.T, (strain - bent) @ moduli.T], axis=1)


class LayeredFields(AbstractElement):
    """Fields of a shell of any section, which lies in the axes of a laminate.

    Attributes:
        layup: its section in the axes of the laminate.
        angle: from the x axis of the element to that of the laminate, about the normal [rad].
    """

    layup: ShellSection
    angle: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)

    def __check_init__(self):
        require_section(self.layup)

    @property
    def section(self) -> ShellSection:
        """Stiffness and mass per area in the axes of the element."""
        return self.layup.rotate(self.angle)


def _plane_rows(k):
    node = 6 * np.arange(k)[:, None]
    return (node + np.array([0, 1, 5])).ravel(), (node + np.array([2, 3, 4])).ravel()
