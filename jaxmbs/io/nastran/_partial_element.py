"""Elements of which some nodes at the middles of edges are left out, as Nastran allows."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import AbstractElement
from ...typing import Matrix3


class PartialElement(AbstractElement):
    """An element without some nodes, each of which stands and moves half-way between two that are there.

    Attributes:
        of: the element with all nodes; halves: by node of it, the places among the nodes that are there.
    """

    of: AbstractElement
    halves: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    @property
    def num_nodes(self) -> int:  # type: ignore[override]
        """Number of nodes that are there."""
        return 1 + max(node for row in self.halves for node in row)

    @property
    def coordinates(self) -> int:  # type: ignore[override]
        """Coordinates of a node."""
        return self.of.coordinates

    @property
    def force_labels(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of the forces."""
        return self.of.force_labels

    @property
    def stress_labels(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of the stresses."""
        return self.of.stress_labels

    @property
    def degeneracy(self) -> str:  # type: ignore[override]
        """Words of its fault."""
        return self.of.degeneracy

    @property
    def layup(self) -> Any:
        """Section of a shell."""
        return self.of.layup  # type: ignore[attr-defined]

    @property
    def density(self) -> Array:
        """Density of a solid."""
        return self.of.density  # type: ignore[attr-defined]

    def _means(self, dtype):
        P = np.zeros((len(self.halves), self.num_nodes))
        for row, nodes in enumerate(self.halves):
            P[row, list(nodes)] = 1.0 / len(nodes)
        return P.astype(dtype)

    def _matrix(self, of, nodes):
        P = self._means(nodes.dtype)
        T = jnp.kron(P, jnp.eye(self.coordinates, dtype=nodes.dtype))
        return T.T @ of(P @ nodes) @ T

    def axes(self, nodes: Float[Array, "k 3"]) -> Matrix3:
        """Axes of a shell."""
        return self.of.axes(self._means(nodes.dtype) @ nodes)  # type: ignore[attr-defined]

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness of the motions that are left."""
        return self._matrix(self.of.stiffness, nodes)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass."""
        return self._matrix(self.of.mass, nodes)

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Forces of the whole element."""
        P = self._means(nodes.dtype)
        return self.of.forces(P @ nodes, P @ u)

    def stresses(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " s"]:
        """Stresses of the whole element."""
        P = self._means(nodes.dtype)
        return self.of.stresses(P @ nodes, P @ u)

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of the whole elements."""
        return self.of.is_degenerate(np.einsum("kn,mnx->mkx", self._means(float), nodes))
