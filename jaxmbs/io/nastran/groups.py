"""Elements of a deck in groups that share a property, and the finite elements that its numbers make of them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import AbstractElement, Beam, Hexahedron, Quadrilateral, Rod, Triangle
from ...elements.base import number, optional
from ...typing import Converted


class Numbers(NamedTuple):
    """All physical numbers of a deck: positions (nodes, 3), materials, properties; mass: PARAM WTMASS."""

    positions: Array
    materials: dict[str, Any]
    properties: dict[str, Any]
    mass: Array


class AbstractCards(eqx.Module):
    """Elements of one property: `nodes` places of the nodes of each, `ids` their numbers in the deck."""

    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    ids: tuple[int, ...] = eqx.field(static=True)

    def element(self, numbers: Numbers) -> AbstractElement:
        """One finite element with stacked leaves (elements, ...)."""
        raise NotImplementedError

    def strained(self, element: AbstractElement, numbers: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """Directions that the elements hold at their nodes: translations and rotations (elements, k, any, 3)."""
        whole = np.broadcast_to(np.eye(3), (len(self.nodes), element.num_nodes, 3, 3))
        return whole, whole if element.coordinates == 6 else whole[:, :, :0]

    def _all(self, value: Array) -> Array:
        """A number for each element."""
        return jnp.broadcast_to(value, (len(self.nodes), *jnp.shape(value)))


class Bars(AbstractCards):
    """CBAR and CBEAM.  A CBAR has no inertia about its own axis, nor of its turning sections.

    Attributes:
        vectors: (elements, 3) in plane 1, basic axes; where `third` is the place of a node, not -1, towards it.
        offsets: (elements, 2, 3) in basic axes [m], or None.
    """

    property: str = eqx.field(static=True)
    vectors: Converted[Float[Array, "elements 3"]] = eqx.field(converter=number)
    third: tuple[int, ...] = eqx.field(static=True)
    offsets: Converted[Float[Array, "elements 2 3"] | None] = eqx.field(converter=optional)
    releases: tuple[str, ...] = eqx.field(static=True)

    def element(self, numbers: Numbers) -> AbstractElement:
        """Beams; the shear factors K1 and K2 make them Timoshenko's."""
        own = numbers.properties[self.property]
        stuff = numbers.materials[own.material]
        line = own.line_mass * numbers.mass
        density = stuff.density * numbers.mass
        if self.property.startswith("PBAR"):
            line, density = line + density * own.area, 0.0 * density
        third, first = np.array(self.third), np.array(self.nodes)[:, 0]
        towards = numbers.positions[np.maximum(third, 0)] - numbers.positions[first]
        return Beam(
            self._all(stuff.young),
            self._all(stuff.shear),
            self._all(own.area),
            self._all(own.inertia_2),
            self._all(own.inertia_1),
            self._all(own.torsion),
            density=self._all(density),
            line_mass=self._all(line),
            shear=None if own.shear is None else self._all(own.shear),
            reference=jnp.where((third >= 0)[:, None], towards, self.vectors),
            offsets=self.offsets,
            releases=self.releases,
            fibres=jnp.zeros((len(self.nodes), 1, 2), numbers.positions.dtype),
        )

    def strained(self, element: AbstractElement, numbers: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """The axes of the section along which it is stiff and that no pin frees."""
        assert isinstance(element, Beam)
        ends = np.asarray(numbers.positions)[np.array(self.nodes)]
        line = (
            ends[:, 1]
            - ends[:, 0]
            + (0 if self.offsets is None else np.asarray(jnp.diff(self.offsets, axis=1))[:, 0])
        )
        axes = np.stack(_axes(line, np.asarray(element.reference)), axis=1)
        stiff = [
            element.area,
            element.inertia_z,
            element.inertia_y,
            element.torsion,
            element.inertia_y,
            element.inertia_z,
        ]
        held = np.stack([np.asarray(value) > 0 for value in stiff], axis=1)[:, None].repeat(2, axis=1)
        names = ("x", "y", "z", "rx", "ry", "rz")
        free = np.array([[f"{name}{end}" in self.releases for name in names] for end in (1, 2)])
        held = held & ~free[None]
        return held[:, :, :3, None] * axes[:, None], held[:, :, 3:, None] * axes[:, None]


class Rods(AbstractCards):
    """CROD."""

    property: str = eqx.field(static=True)

    def element(self, numbers: Numbers) -> AbstractElement:
        """Rods; NSM as density."""
        own = numbers.properties[self.property]
        stuff = numbers.materials[own.material]
        density = (stuff.density + own.line_mass / own.area) * numbers.mass
        return Rod(self._all(stuff.young), self._all(own.area), self._all(density))

    def strained(self, element: AbstractElement, numbers: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """Their line."""
        ends = np.asarray(numbers.positions)[np.array(self.nodes)]
        line = ends[:, 1] - ends[:, 0]
        line = (line / np.linalg.norm(line, axis=1, keepdims=True))[:, None, None].repeat(2, axis=1)
        return line, line[:, :, :0]


class Plates(AbstractCards):
    """CQUAD4 and CTRIA3 as flat shells with drilling stiffness."""

    property: str = eqx.field(static=True)

    def element(self, numbers: Numbers) -> AbstractElement:
        """Quadrilaterals or triangles; NSM as density."""
        own = numbers.properties[self.property]
        stuff = numbers.materials[own.material]
        density = (stuff.density + own.area_mass / own.thickness) * numbers.mass
        values = [self._all(x) for x in (stuff.young, stuff.contraction, own.thickness, density)]
        if len(self.nodes[0]) == 3:
            return Triangle(*values)
        drilling = jnp.full(len(self.nodes), 0.1, values[0].dtype)
        return Quadrilateral(*values, shear_factor=self._all(own.shear_factor), drilling=drilling)


class Solids(AbstractCards):
    """CHEXA of eight nodes."""

    property: str = eqx.field(static=True)

    def element(self, numbers: Numbers) -> AbstractElement:
        """Hexahedra."""
        stuff = numbers.materials[numbers.properties[self.property].material]
        return Hexahedron(*map(self._all, (stuff.young, stuff.contraction, stuff.density * numbers.mass)))


def _axes(line, reference):
    """Axes x y z (elements, 3) of beams, as `along` has them."""
    x = line / np.linalg.norm(line, axis=1, keepdims=True)
    z = np.cross(x, reference)
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return x, np.cross(z, x), z
