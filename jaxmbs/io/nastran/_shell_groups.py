"""Groups of shells and of solids, and the finite elements that their numbers make of them."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ... import elements
from ...elements import AbstractElement, ShellSection
from ...elements._base import as_optional_real, as_real
from ...typing import Convertible
from ._groups import AbstractElementGroup, DeckParameters
from ._partial_element import PartialElement

_PLAIN = {3: elements.Triangle, 4: elements.Quadrilateral}
#: Share of K6ROT in membranes alone: without it a wing has the frequency that MSC Nastran printed, to all digits.
_OF_MEMBRANES = 1e-4
_NASTRAN: dict[Any, dict[str, Any]] = {elements.Wedge: {"side_shear": True}}
_LAYERED = {
    **{3: elements.LayeredTriangle, 4: elements.LayeredQuadrilateral},
    **{6: elements.QuadraticTriangle, 8: elements.QuadraticQuadrilateral},
}


class ShellGroup(AbstractElementGroup):
    """CQUAD4, CQUADR, CTRIA3 and CTRIAR as flat shells with drilling stiffness, CQUAD8 and CTRIA6 as curved ones.

    Attributes:
        thickness: (elements,) means of what the cards give at the corners, or None for the property's.
        offset: (elements,) ZOFFS along the normal [m], or None.
        theta: (elements,) THETA [degrees], from the line of the first two nodes, or from `along` where this is not
            zero.
        along: (elements, 3) x axes of the systems MCID, basic axes.
        drilling: of CQUAD4 and CTRIA3, modulus of the drilling rotation over the shear modulus; None for elements in
            whose membrane it takes part.
        kind: number of nodes of the whole element; halves: of those that are left out, see `PartialElement`.
    """

    property: str = eqx.field(static=True)
    thickness: Convertible[Float[Array, " elements"] | None] = eqx.field(converter=as_optional_real)
    offset: Convertible[Float[Array, " elements"] | None] = eqx.field(converter=as_optional_real)
    theta: Convertible[Float[Array, " elements"]] = eqx.field(converter=as_real)
    along: Convertible[Float[Array, "elements 3"]] = eqx.field(converter=as_real)
    drilling: Convertible[Float[Array, ""] | None] = eqx.field(converter=as_optional_real)
    kind: int = eqx.field(static=True)
    halves: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Shells of one material where the property has one, else of its section."""
        own = numbers.properties[self.property]
        if own.is_plain and self.offset is None and self.kind < 5:
            return self._plain(own, numbers)
        kind = _LAYERED[self.kind]
        bare = kind(
            jax.tree.map(self._all, own.section(numbers.materials, numbers.mass)), self._all(jnp.asarray(0.0))
        )
        share = 1.0 if own.bends else _OF_MEMBRANES
        drilling = bare.drilling if self.drilling is None else self.drilling * share
        if drilling is not None:
            bare = dataclasses.replace(bare, drilling=self._all(drilling))
        weak = self.drilling is not None
        if self.kind == 4:
            bare = dataclasses.replace(bare, residual_bending=True, corner_drilling=weak)
        elif self.kind == 3:
            bare = dataclasses.replace(bare, residual_bending=weak)
        section = bare.layup if self.thickness is None else self._sections(own, numbers)
        if self.offset is not None:
            section = jax.vmap(ShellSection.shift)(section, self.offset)
        angles = self._angles(self._partial(bare), numbers)
        return self._partial(eqx.tree_at(lambda e: [e.layup, e.angle], bare, [section, angles]))

    def outline(self, numbers: DeckParameters) -> AbstractElement:
        """Those of several materials with `outline` of their property: no stiffness of plies is evaluated."""
        own = numbers.properties[self.property]
        if own.is_plain and self.offset is None and self.kind < 5:
            return self._plain(own, numbers)
        section = jax.tree.map(self._all, own.outline(numbers.materials))
        if self.offset is not None:
            section = jax.vmap(ShellSection.shift)(section, self.offset)
        return self._partial(_LAYERED[self.kind](section, self._all(jnp.asarray(0.0))))

    def _partial(self, element):
        return PartialElement(element, self.halves) if self.halves else element

    def _plain(self, own, numbers):
        stuff = numbers.materials[own.material]
        t = self._all(own.thickness) if self.thickness is None else self.thickness
        density = (stuff.density + own.area_mass / t) * numbers.mass
        E, nu = self._all(stuff.young), self._all(stuff.contraction)
        factor = own.shear_factor
        if stuff.shear_modulus is not None:  # of transverse shear where the card has E and nu too
            factor = factor * 2.0 * (1.0 + stuff.contraction) * stuff.shear_modulus / stuff.young
        factor, weak = self._all(factor), self.drilling is not None
        if len(self.nodes[0]) == 3:
            return elements.Triangle(E, nu, t, density, factor, self._all(self.drilling) if weak else None, weak)
        drilling = self._all(self.drilling if weak else jnp.asarray(0.1, E.dtype))
        return elements.Quadrilateral(E, nu, t, density, factor, drilling, True, weak)

    def _sections(self, own, numbers):
        """Sections with the thickness of each element."""
        of = lambda t: eqx.tree_at(lambda p: p.thickness, own, t).section(numbers.materials, numbers.mass)
        return jax.vmap(of)(self.thickness)

    def _angles(self, element: Any, numbers: DeckParameters) -> Array:
        """Angles (elements,) from the x axes of the elements to those of their material [rad]."""
        nodes = numbers.positions[np.array(self.nodes)]
        axes = jax.vmap(element.axes)(nodes)
        by_frame = np.any(np.asarray(self.along) != 0, axis=1, keepdims=True)
        line = jnp.where(by_frame, self.along, nodes[:, 1] - nodes[:, 0])
        x, y, _ = jnp.moveaxis(jnp.einsum("eab,eb->ea", axes, line), 1, 0)
        return jnp.arctan2(y, x) + jnp.deg2rad(self.theta)

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """All; of a membrane those in its plane and the rotation about its normal, of mere bending the others."""
        whole = super().stiff_directions(element, numbers)
        layup: Any = getattr(element, "layup", None)
        if layup is None:
            return whole
        bends = np.any(np.asarray(layup.bending) != 0, axis=(1, 2))
        pulls = np.any(np.asarray(layup.membrane) != 0, axis=(1, 2))
        nodes = numbers.positions[np.array(self.nodes)]
        shell: Any = element
        axes = np.asarray(jax.vmap(shell.axes)(nodes))[:, None]
        axes = np.broadcast_to(axes, (len(nodes), nodes.shape[1], 3, 3))
        in_plane, across = np.array([1.0, 1, 0]), np.array([0.0, 0, 1])
        weigh = lambda a, b: np.outer(pulls, a) + np.outer(bends, b)
        return (
            axes * weigh(in_plane, across)[:, None, :, None],
            axes * weigh(across, in_plane)[:, None, :, None],
        )

    def mass_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """All where the section has mass."""
        layup: Any = getattr(element, "layup", None)
        if layup is None:
            return super().mass_directions(element, numbers)
        heavy = (np.asarray(layup.area_mass) > 0)[:, None, None, None]
        whole = heavy * np.broadcast_to(np.eye(3), (len(self.nodes), element.num_nodes, 3, 3))
        return whole, whole


class SolidGroup(AbstractElementGroup):
    """CTETRA, CPENTA and CHEXA.

    Attributes:
        axes: (elements, 3, 3) of a MAT9, rows, basic axes; None for a MAT1.
        kind: class of the whole element; halves: of nodes that are left out, see `PartialElement`.
    """

    property: str = eqx.field(static=True)
    axes: Convertible[Float[Array, "elements 3 3"] | None] = eqx.field(converter=as_optional_real)
    kind: Any = eqx.field(static=True)
    halves: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Solids."""
        stuff = numbers.materials[numbers.properties[self.property].material]
        density, options = self._all(stuff.density * numbers.mass), _NASTRAN.get(self.kind, {})
        if self.axes is None:
            made = self.kind(self._all(stuff.young), self._all(stuff.contraction), density, **options)
        else:
            one, turn = jnp.ones(len(self.nodes), density.dtype), jax.vmap(turn_moduli, (None, 0))
            made = self.kind(one, 0.0 * one, density, turn(stuff.moduli, self.axes), **options)
        return PartialElement(made, self.halves) if self.halves else made

    def mass_directions(self, element: Any, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """All where the material has mass."""
        heavy = (np.asarray(element.density) > 0)[:, None, None, None]
        whole = heavy * np.broadcast_to(np.eye(3), (len(self.nodes), element.num_nodes, 3, 3))
        return whole, whole[:, :, :0]


def turn_moduli(moduli: Array, axes: Array) -> Array:
    """Elasticity (6, 6) in basic axes of a material whose axes are rows (3, 3).

    Source: Jones, Mechanics of composite materials (1999), 2.6, written for tensors.
    """
    pairs = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)])
    place = np.zeros((3, 3), int)
    place[pairs[:, 0], pairs[:, 1]] = place[pairs[:, 1], pairs[:, 0]] = np.arange(6)
    tensor = moduli[place[:, :, None, None], place[None, None]]
    turned = jnp.einsum("ijkl,ia,jb,kc,ld->abcd", tensor, axes, axes, axes, axes)
    a, b = pairs.T
    return turned[a[:, None], b[:, None], a[None], b[None]]
