"""PSHEAR, groups of shear panels, and of the rods along their sides."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import AbstractElement, Rod, ShearPanel
from ...elements._base import as_real
from ...typing import Convertible
from ._cards import Card, require_positive
from ._context import DeckContext
from ._groups import AbstractElementGroup, DeckParameters, RodGroup

Scalar = Convertible[Float[Array, ""]]


class PanelProperty(eqx.Module):
    """PSHEAR.

    Attributes:
        thickness [m]; area_mass: NSM [kg/m^2].
        edges: (2,) F1 and F2, the part of the panel that its sides carry along them: to 1.01 of the area of its
            cross-section, above in units of `thickness^2 / 2`.
        material: name, "MAT1 3".
    """

    thickness: Scalar = eqx.field(converter=as_real)
    area_mass: Scalar = eqx.field(converter=as_real)
    edges: Convertible[Float[Array, "2"]] = eqx.field(converter=as_real)
    material: str = eqx.field(static=True)


def panel(card: Card, deck: DeckContext) -> PanelProperty:
    """PSHEAR."""
    t, nsm = card.real(3, "T"), card.real(4, "NSM", 0.0)
    edges = [card.real(5, "F1", 0.0), card.real(6, "F2", 0.0)]
    require_positive(card, T=t, nonnegative={"NSM": nsm, "F1": edges[0], "F2": edges[1]})
    return PanelProperty(t, nsm, edges, deck.material(card, 2, "MID"))


class PanelGroup(AbstractElementGroup):
    """CSHEAR."""

    property: str = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Shear panels; NSM as density."""
        own = numbers.properties[self.property]
        stuff = numbers.materials[own.material]
        density = (stuff.density + own.area_mass / own.thickness) * numbers.mass
        return ShearPanel(self._all(stuff.shear), self._all(own.thickness), self._all(density))

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """At each node the force of a unit shear flow."""
        nodes = numbers.positions[np.array(self.nodes)]
        flows = np.asarray(jax.vmap(lambda one, at: one._flow(at)[0])(element, nodes)).reshape(len(nodes), 4, 1, 3)
        flows = flows / np.maximum(np.linalg.norm(flows, axis=3, keepdims=True), 1e-300)
        return flows, flows[:, :, :0]


class PanelSideGroup(RodGroup):
    """Rods without mass along one side of CSHEAR.

    Attributes:
        panels: nodes of the panels; direction: 0 for F1, of the sides 12 and 34, 1 for F2.
    """

    panels: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    direction: int = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Rods of the area `F A t / (l12 + l34)`, A that of the panel, or `F t^2 / 2`."""
        own, at = numbers.properties[self.property], numbers.positions[np.array(self.panels)]
        factor, t = own.edges[self.direction], own.thickness
        length = lambda a, b: jnp.linalg.norm(at[:, a] - at[:, b], axis=1)
        sides = length(0, 1) + length(2, 3) if self.direction == 0 else length(1, 2) + length(3, 0)
        area = jnp.linalg.norm(jnp.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1]), axis=1) / 2
        areas = jnp.where(factor <= 1.01, factor * area * t / sides, factor * t**2 / 2)
        return Rod(self._all(numbers.materials[own.material].young), areas, jnp.zeros_like(areas))
