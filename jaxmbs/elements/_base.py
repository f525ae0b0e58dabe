"""Base of finite elements: functions of node positions that return stiffness, mass and forces.

Coordinates of a node: displacements x y z [m] and small rotations rx ry rz [rad] in world axes; solids and rods use
the first three only.  Numbers (section, material, stiffness) are leaves, positions are arguments, so that both have
derivatives.  Methods treat one element and never branch on values; assembly maps them over all elements of a group.
"""

import abc
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete, require_reals
from ..runtime import as_array
from ..tables import fields_repr

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
TENSOR = ("xx", "yy", "zz", "xy", "yz", "zx")


def as_real(value: Any) -> Array:
    """Convert to a real floating array of the same precision; whole numbers become floats.

    Raises: TypeError for complex numbers.
    """
    require_reals(value)
    value = as_array(value, None)
    return value if jnp.issubdtype(value.dtype, jnp.floating) else jnp.asarray(value, float)


def as_optional_real(value: Any) -> Array | None:
    """Convert as `as_real`, or keep None."""
    return None if value is None else as_real(value)


class AbstractElement(eqx.Module):
    """Base of all elements; `coordinates` is the number of x y z rx ry rz that each node uses, 3 or 6.

    `force_labels` and `stress_labels` name what `forces` and `stresses` return.  `nonnegative_fields` lists the
    fields that must not be negative, `positive_fields` those that must not be zero either; `degeneracy` words the
    fault that `is_degenerate` finds.  Where `has_ends`, `forces` and `stresses` are those of the ends and take one
    more argument, the load (n,) that is distributed over the element.
    """

    num_nodes: ClassVar[int]
    coordinates: ClassVar[int] = 6
    force_labels: ClassVar[tuple[str, ...]] = ()
    stress_labels: ClassVar[tuple[str, ...]] = ()
    nonnegative_fields: ClassVar[tuple[str, ...]] = ("young", "area", "thickness", "density")
    positive_fields: ClassVar[tuple[str, ...]] = ()
    degeneracy: ClassVar[str] = "its nodes lie at one point"
    has_ends: ClassVar[bool] = False
    __repr__ = fields_repr

    @property
    def size(self) -> int:
        """Number of coordinates of the element."""
        return self.num_nodes * self.coordinates

    @abc.abstractmethod
    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness matrix in world axes [N/m, N, N m]."""

    @abc.abstractmethod
    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Mass matrix in world axes [kg, kg m, kg m^2]."""

    @property
    def has_damping(self) -> bool:
        """True if `damping` may be nonzero."""
        return type(self).damping is not AbstractElement.damping

    def damping(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Viscous damping matrix in world axes [N s/m, N s, N m s]; zero except for dampers."""
        return jnp.zeros((self.size, self.size), nodes.dtype)

    @property
    def has_geometric_stiffness(self) -> bool:
        """True if `geometric_stiffness` may be nonzero."""
        return type(self).geometric_stiffness is not AbstractElement.geometric_stiffness

    def geometric_stiffness(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "n n"]:
        """Geometric stiffness in world axes [N/m, N, N m] at the stress of displacements u, linear in u.

        It is the second derivative of the work of that stress on the strains of second order: tension stiffens,
        compression softens.  Zero for elements without extent.
        """
        return jnp.zeros((self.size, self.size), nodes.dtype)

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Element loads `F_e = k_e T_e x` in the element's own axes, named by `force_labels`. Source: S1 (30)."""
        return jnp.zeros(0, nodes.dtype)

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Stresses [Pa] in the element's own axes, named by `stress_labels`. Source: S1 (30)."""
        return jnp.zeros(0, nodes.dtype)

    def stress_tensors(self, stresses: Array) -> Float[Array, "... points 6"]:
        """Tensors xx yy zz xy yz zx [Pa] at every point of stresses (..., s), in the element's own axes.

        A label is "xx", or "axial" for the same, and the name of its point: "xy top".
        """
        words = [label.split() for label in self.stress_labels]
        points = list(dict.fromkeys(tuple(rest) for _, *rest in words))
        found = jnp.zeros((*stresses.shape[:-1], len(points), 6), stresses.dtype)
        for column, (component, *rest) in enumerate(words):
            place = TENSOR.index("xx" if component == "axial" else component)
            found = found.at[..., points.index(tuple(rest)), place].set(stresses[..., column])
        return found

    def faults(self) -> list[str]:
        """Messages about invalid values; traced values are not checked."""
        values = {name: getattr(self, name) for name in self.__dataclass_fields__}
        given = {n: np.asarray(v) for n, v in values.items() if eqx.is_array(v) and is_concrete(v)}
        found = [f"{name} must be finite" for name, v in given.items() if not np.all(np.isfinite(v))]
        negative = [name for name in self.nonnegative_fields if name in given and np.any(given[name] < 0)]
        if "poisson" in given and not np.all((given["poisson"] > -1) & (given["poisson"] < 0.5)):
            found.append("poisson must lie between -1 and 1/2")
        zero = [name for name in self.positive_fields if name in given and np.any(given[name] == 0)]
        found += [f"{name} must not be negative" for name in negative]
        return found + [f"{name} must not be zero" for name in zero]

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags (m,) of elements that have no extent or are inside out, from node positions (m, k, 3)."""
        return (np.ptp(nodes, axis=1).max(axis=1) == 0) & (self.num_nodes > 1)
