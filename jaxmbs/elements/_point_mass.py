"""`PointMass`: rigid mass attached to a node, at an offset."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..typing import Convertible
from ._base import AbstractElement, as_optional_real, as_real
from ._shared_matrices import rigid_arm


class PointMass(AbstractElement):
    """Mass with inertia, rigidly carried by one node. Without offset and inertia it uses displacements only.

    It has no forces: its weight and inertia come by `fem.body_load` and the mass matrix.

    Attributes:
        value: mass [kg].
        offset: (3,) centre of mass from the node, world axes [m], or None.
        inertia: (3, 3) about the centre of mass, world axes [kg m^2], or None.
    """

    value: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    offset: Convertible[Float[Array, "... 3"] | None] = eqx.field(converter=as_optional_real, default=None)
    inertia: Convertible[Float[Array, "... 3 3"] | None] = eqx.field(converter=as_optional_real, default=None)

    num_nodes = 1
    nonnegative_fields = ("value",)

    def faults(self) -> list[str]:
        """Messages also for an inertia that is not symmetric, or negative about some axis."""
        found = super().faults()
        if found or self.inertia is None or not is_concrete(self.inertia):
            return found
        I = np.asarray(self.inertia)
        size = 1e-6 * np.max(np.abs(I))
        if np.max(np.abs(I - np.swapaxes(I, -1, -2))) > size:
            return ["inertia must be symmetric"]
        return ["inertia must not be negative"] if np.any(np.linalg.eigvalsh(I) < -size) else []

    @property
    def coordinates(self) -> int:  # type: ignore[override]
        """Coordinates of the node: 3, or 6 with an offset or an inertia."""
        return 3 if self.offset is None and self.inertia is None else 6

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Zero stiffness."""
        return jnp.zeros((self.size, self.size), nodes.dtype)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Mass matrix `[m E, -m c~; m c~, I + m c~^T c~]`, c the offset."""
        central = self.value * jnp.eye(3, dtype=nodes.dtype)
        if self.coordinates == 3:
            return central
        inertia = jnp.zeros((3, 3), nodes.dtype) if self.inertia is None else self.inertia
        offset = jnp.zeros(3, nodes.dtype) if self.offset is None else self.offset
        T = rigid_arm(offset)
        return T.T @ jax.scipy.linalg.block_diag(central, inertia) @ T
