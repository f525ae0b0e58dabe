"""Masses, springs and bushings of a deck in groups, and their finite elements."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import AbstractElement, GroundSpring, PointMass, Spring
from ...elements._base import as_optional_real, as_real
from ...elements._shared_matrices import axes_along
from ...typing import Convertible
from ._groups import AbstractElementGroup, DeckParameters


class PointMassGroup(AbstractElementGroup):
    """CONM2.

    Attributes:
        mass: (elements,); offset: (elements, 3) [m]; inertia: (elements, 3, 3) about the centre of mass, as the
            offset in basic axes; or None.
    """

    mass: Convertible[Float[Array, " elements"]] = eqx.field(converter=as_real)
    offset: Convertible[Float[Array, "elements 3"] | None] = eqx.field(converter=as_optional_real)
    inertia: Convertible[Float[Array, "elements 3 3"] | None] = eqx.field(converter=as_optional_real)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Point masses."""
        inertia = None if self.inertia is None else self.inertia * numbers.mass
        return PointMass(self.mass * numbers.mass, self.offset, inertia)

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Nothing."""
        nothing = np.zeros((len(self.nodes), 1, 0, 3))
        return nothing, nothing

    def mass_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """All directions, and those about which the inertia and the offset count."""
        mass = (np.asarray(self.mass) > 0)[:, None, None, None] * np.eye(3)
        if self.inertia is None or self.offset is None:
            return mass, mass[:, :, :0]
        square = np.einsum("ea,ea,bc->ebc", self.offset, self.offset, np.eye(3))
        about = np.asarray(self.inertia) + np.asarray(self.mass)[:, None, None] * (
            square - np.einsum("eb,ec->ebc", self.offset, self.offset)
        )
        values, axes = np.linalg.eigh(about)
        values = values > 1e-12 * np.maximum(values[:, -1:], 1e-300)
        return mass, (values[:, :, None] * np.swapaxes(axes, 1, 2))[:, None]


class ScalarSpring(AbstractElement):
    """`rate (a . u1 - b . u2)`, whatever lies between the nodes: as a CELAS is, no bushing; or a mass or a damper.

    Attributes:
        rate: [N/m or N m/rad]; ends: (2, 6) a and b over x y z rx ry rz.
        what: "stiffness", "mass" or "damping".
    """

    rate: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    ends: Convertible[Float[Array, "... k 6"]] = eqx.field(converter=as_real)
    what: str = eqx.field(static=True, default="stiffness")

    num_nodes = 2
    force_labels = ("force",)
    nonnegative_fields = ()

    def _row(self):
        return jnp.concatenate([self.ends[0], *(-end for end in self.ends[1:])])

    def _matrix(self, what, nodes):
        if what != self.what:
            return jnp.zeros((self.size, self.size), nodes.dtype)
        return self.rate * jnp.outer(self._row(), self._row())

    @property
    def has_damping(self) -> bool:
        """True for a damper."""
        return self.what == "damping"

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """`k b b^T` of a spring."""
        return self._matrix("stiffness", nodes)

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """`m b b^T` of a mass."""
        return self._matrix("mass", nodes)

    def damping(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """`c b b^T` of a damper."""
        return self._matrix("damping", nodes)

    def forces(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, " f"]:
        """Force of a spring on its first end, reversed; zero of others."""
        return ((self._row() @ u.reshape(-1)) * (self.rate if self.what == "stiffness" else 0.0 * self.rate))[None]

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """No fault: the nodes of a scalar element may coincide."""
        return np.zeros(len(nodes), bool)


class ScalarToGround(ScalarSpring):
    """`rate a . u` of a mass or damper from one direction to ground."""

    num_nodes = 1


class ScalarSpringGroup(AbstractElementGroup):
    """CELAS, CMASS or CDAMP, of one property or with rates of their own.

    Attributes:
        rate: (elements,) [N/m or N m/rad], or None where the property has it.
        ends: (elements, 1 or 2, 6) the directions at the nodes, basic axes.
        what: "stiffness", "mass" or "damping".
    """

    property: str = eqx.field(static=True)
    rate: Convertible[Float[Array, " elements"] | None] = eqx.field(converter=as_optional_real)
    ends: Convertible[Float[Array, "elements k 6"]] = eqx.field(converter=as_real)
    what: str = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Scalar springs, masses or dampers, or those to ground."""
        own = getattr(numbers.properties[self.property], self.what) if self.rate is None else self.rate
        rate = self._all(own) if self.rate is None else own
        rate = rate * numbers.mass if self.what == "mass" else rate
        if len(self.nodes[0]) == 2:
            return ScalarSpring(rate, self.ends, self.what)
        if self.what != "stiffness":
            return ScalarToGround(rate, self.ends, self.what)
        return GroundSpring(
            jax.vmap(lambda k, d: k * jnp.outer(d[0], d[0]))(rate, self.ends), place=jnp.ones_like(rate)
        )

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """The directions of springs."""
        return self._directions(self.what == "stiffness")

    def mass_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """The directions of masses."""
        return self._directions(self.what == "mass")

    def _directions(self, counts):
        ends = np.asarray(self.ends)[:, :, None] * float(counts)
        return ends[..., :3], ends[..., 3:]


class BushingGroup(AbstractElementGroup):
    """CBUSH of one PBUSH.

    Attributes:
        axes: (elements, 3, 3) rows, basic axes, where a coordinate system or a vector gives them; None: along the
            line of its nodes, which are apart.
        place: (elements,) where on that line the spring sits.
    """

    property: str = eqx.field(static=True)
    axes: Convertible[Float[Array, "elements 3 3"] | None] = eqx.field(converter=as_optional_real)
    vectors: Convertible[Float[Array, "elements 3"] | None] = eqx.field(converter=as_optional_real)
    place: Convertible[Float[Array, " elements"]] = eqx.field(converter=as_real)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Springs of six directions, between two nodes or to ground."""
        own = numbers.properties[self.property]
        matrix, damper = (None if v is None else self._all(jnp.diag(v)) for v in (own.stiffness, own.damping))
        kind = Spring if len(self.nodes[0]) == 2 else GroundSpring
        return kind(matrix, damper, self._turned(numbers), self.place)

    def _turned(self, numbers):
        if self.axes is not None:
            return self.axes
        ends = numbers.positions[np.array(self.nodes)]
        return jax.vmap(axes_along)(ends[:, 1] - ends[:, 0], self.vectors)

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """The axes along which it is stiff."""
        stiff = np.asarray(numbers.properties[self.property].stiffness) > 0
        axes = np.asarray(self._turned(numbers))[:, None].repeat(len(self.nodes[0]), axis=1)
        return stiff[:3, None] * axes, stiff[3:, None] * axes
