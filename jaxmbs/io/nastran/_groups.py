"""Elements of a deck in groups that share a property, and the finite elements that its numbers make of them."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import AbstractElement, Beam, Rod, Spring
from ...elements._base import as_optional_real, as_real
from ...elements._shared_matrices import axes_along
from ...typing import Convertible


class DeckParameters(NamedTuple):
    """All physical numbers of a deck: positions (nodes, 3), materials, properties; mass: PARAM WTMASS."""

    positions: Array
    materials: dict[str, Any]
    properties: dict[str, Any]
    mass: Array


class LineDamperProperty(eqx.Module):
    """PVISC: `damping` (2,) along [N s/m] and about [N m s] the line of a CVISC."""

    damping: Convertible[Float[Array, "2"]] = eqx.field(converter=as_real)


class AbstractElementGroup(eqx.Module):
    """Elements of one property: `nodes` places of the nodes of each, `ids` their numbers in the deck."""

    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    ids: tuple[int, ...] = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """One finite element with stacked leaves (elements, ...)."""
        raise NotImplementedError

    def outline(self, numbers: DeckParameters) -> AbstractElement:
        """The same as far as its shape and the directions of stiffness and mass are concerned."""
        return self.element(numbers)

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Directions that the elements hold at their nodes: translations and rotations (elements, k, any, 3)."""
        whole = np.broadcast_to(np.eye(3), (len(self.nodes), element.num_nodes, 3, 3))
        return whole, whole if element.coordinates == 6 else whole[:, :, :0]

    def mass_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Directions in which the elements have mass at their nodes, likewise."""
        density = np.broadcast_to(getattr(element, "density", 0.0), (len(self.nodes),)) > 0
        whole = density[:, None, None, None] * np.broadcast_to(np.eye(3), (len(self.nodes), element.num_nodes, 3, 3))
        return whole, whole if element.coordinates == 6 else whole[:, :, :0]

    def _all(self, value: Array) -> Array:
        """A number for each element."""
        return jnp.broadcast_to(value, (len(self.nodes), *jnp.shape(value)))


class BarGroup(AbstractElementGroup):
    """CBAR and CBEAM.

    Attributes:
        polar: whether sections have inertia in turning; a CBAR of Nastran has none by default.
        vectors: (elements, 3) in plane 1, basic axes; where `third` is the place of a node, not -1, towards it.
        offsets: (elements, 2, 3) in basic axes [m], or None.
    """

    property: str = eqx.field(static=True)
    vectors: Convertible[Float[Array, "elements 3"]] = eqx.field(converter=as_real)
    third: tuple[int, ...] = eqx.field(static=True)
    offsets: Convertible[Float[Array, "elements 2 3"] | None] = eqx.field(converter=as_optional_real)
    releases: tuple[str, ...] = eqx.field(static=True)
    polar: bool = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Beams; the shear factors K1 and K2 make them Timoshenko's."""
        own = numbers.properties[self.property]
        stuff = numbers.materials[own.material]
        line = own.line_mass * numbers.mass
        density = stuff.density * numbers.mass
        if not self.polar:
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

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """The axes of the section along which it is stiff and that no pin frees."""
        bent = "inertia_z", "inertia_y"
        held = self._positive(element, "area", *bent, "torsion", *bent[::-1])
        held[:, :, 3:4] &= self._positive(element, "shear_modulus")
        names = [[f"{name}{end}" for name in ("x", "y", "z", "rx", "ry", "rz")] for end in (1, 2)]
        return self._along(element, numbers, held & ~np.isin(names, self.releases)[None])

    def mass_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """All but turning about the axis where there is no polar inertia."""
        heavy = self._positive(element, "density") | self._positive(element, "line_mass")
        about = self._positive(element, "density") & np.any(
            self._positive(element, "inertia_y", "inertia_z"), axis=2, keepdims=True
        )
        return self._along(element, numbers, np.concatenate([heavy] * 3 + [about] + [heavy] * 2, axis=2))

    def _positive(self, element, *names):
        """(elements, 2, names): which numbers are more than zero, for both ends."""
        values = np.stack([np.asarray(getattr(element, name)) > 0 for name in names], axis=1)
        return values[:, None].repeat(2, axis=1)

    def _along(self, element, numbers, which):
        """Axes of the section at both ends, for translations and rotations, zero where `which` (.., 2, 6) is not."""
        line = _element_axes(self.nodes, numbers)
        if self.offsets is not None:
            line = line + np.asarray(self.offsets)[:, 1] - np.asarray(self.offsets)[:, 0]
        axes = np.stack(_section_axes(line, np.asarray(element.reference)), axis=1)[:, None]
        return which[:, :, :3, None] * axes, which[:, :, 3:, None] * axes


def _element_axes(nodes, numbers):
    """Vectors (elements, 3) from the first node to the second."""
    ends = np.asarray(numbers.positions)[np.array(nodes)]
    return ends[:, 1] - ends[:, 0]


class RodGroup(AbstractElementGroup):
    """CROD."""

    property: str = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Rods; NSM as density."""
        own = numbers.properties[self.property]
        stuff = numbers.materials[own.material]
        density = (stuff.density + own.line_mass / own.area) * numbers.mass
        return Rod(self._all(stuff.young), self._all(own.area), self._all(density))

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Their line."""
        line = _element_axes(self.nodes, numbers)
        line = (line / np.linalg.norm(line, axis=1, keepdims=True))[:, None, None].repeat(2, axis=1)
        return line, line[:, :, :0]


class TwistGroup(AbstractElementGroup):
    """Torsion of CROD, CONROD and CTUBE, `G J / l` about their line; or the dampers CVISC along and about it."""

    property: str = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Springs, or dampers, in the axes of the lines."""
        own = numbers.properties[self.property]
        ends = numbers.positions[np.array(self.nodes)]
        line = ends[:, 1] - ends[:, 0]
        axes = jax.vmap(axes_along)(line)
        none = jnp.zeros((len(self.nodes), 6, 6), line.dtype)
        if isinstance(own, LineDamperProperty):
            along = jnp.asarray(np.eye(6)[[0, 3]], line.dtype)
            damper = jnp.einsum("d,da,db->ab", own.damping, along, along)
            return Spring(none, jnp.broadcast_to(damper, none.shape), axes, self._all(jnp.asarray(0.5)))
        rate = numbers.materials[own.material].shear * own.torsion / jnp.linalg.norm(line, axis=1)
        return Spring(none.at[:, 3, 3].set(rate), None, axes, self._all(jnp.asarray(0.5)))

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Rotations about their line; of dampers nothing."""
        line = _element_axes(self.nodes, numbers)
        line = (line / np.linalg.norm(line, axis=1, keepdims=True))[:, None, None].repeat(2, axis=1)
        stiff = not isinstance(numbers.properties[self.property], LineDamperProperty)
        return line[:, :, :0], line if stiff else line[:, :, :0]


def _section_axes(line, reference):
    """Axes x y z (elements, 3) of beams, as `along` has them."""
    x = line / np.linalg.norm(line, axis=1, keepdims=True)
    z = np.cross(x, reference)
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return x, np.cross(z, x), z
