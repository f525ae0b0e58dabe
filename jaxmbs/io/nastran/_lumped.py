"""Lumped masses of elements, as Nastran has them unless PARAM COUPMASS requests consistent ones."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements import AbstractElement, PointMass
from ._groups import AbstractElementGroup, BarGroup, DeckParameters, RodGroup
from ._panel_groups import PanelGroup, PanelSideGroup
from ._point_groups import PointMassGroup
from ._shell_groups import ShellGroup, SolidGroup

#: Groups whose masses can be lumped.
HEAVY = (BarGroup, RodGroup, ShellGroup, SolidGroup, PanelGroup)


class MasslessGroup(AbstractElementGroup):
    """The stiffness of elements whose masses are `LumpedMassGroup`."""

    of: AbstractElementGroup

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Without density and mass per length or area."""
        return self._without_mass(self.of.element(numbers))

    def outline(self, numbers: DeckParameters) -> AbstractElement:
        """Likewise."""
        return self._without_mass(self.of.outline(numbers))

    def _without_mass(self, made):
        heavy = [name for name in ("density", "line_mass") if hasattr(made, name)]
        layered = hasattr(made, "layup")
        where = lambda e: [e.layup.area_mass, e.layup.turning_mass] if layered else [getattr(e, n) for n in heavy]
        return eqx.tree_at(where, made, [jnp.zeros_like(value) for value in where(made)])

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Stiff directions of those elements."""
        return self.of.stiff_directions(element, numbers)


class LumpedMassGroup(AbstractElementGroup):
    """The masses of elements, shares of each on its nodes; those of bars at the ends of their offsets.

    Attributes:
        turns: whether ends have inertia about the axis, as those of CBEAM have.
    """

    of: AbstractElementGroup
    turns: bool = eqx.field(static=True)

    def element(self, numbers: DeckParameters) -> AbstractElement:
        """Point masses, node by node."""
        return self._masses(self.of.element(numbers), numbers, self._shares)

    def outline(self, numbers: DeckParameters) -> AbstractElement:
        """Point masses, of plates and solids of one where there is any."""
        lines = isinstance(self.of, BarGroup | RodGroup)
        return self._masses(self.of.outline(numbers), numbers, self._shares if lines else _ones)

    def _masses(self, made: Any, numbers, shares):
        nodes = numbers.positions[np.array(self.of.nodes)]
        mass = shares(made, nodes).reshape(-1)
        offset = getattr(self.of, "offsets", None)
        if offset is None and not self.turns:
            return PointMass(mass)
        offset = jnp.zeros_like(nodes) if offset is None else jnp.asarray(offset, nodes.dtype)
        line = nodes[:, 1] + offset[:, 1] - nodes[:, 0] - offset[:, 0]
        length = jnp.linalg.norm(line, axis=1)
        about = 0.5 * length * made.density * (made.inertia_y + made.inertia_z) if self.turns else 0.0 * length
        x = line / length[:, None]
        inertia = about[:, None, None] * x[:, :, None] * x[:, None, :]
        return PointMass(mass, offset.reshape(-1, 3), jnp.repeat(inertia, 2, axis=0))

    def _shares(self, made, nodes) -> Float[Array, "elements k"]:
        """Sums of the rows of consistent masses; lines and triangles have equal ones.

        Where nodes stand at the middles of edges, sums of rows may be negative: shares go with the diagonal.
        Source: Hinton, Rock and Zienkiewicz, Earthq. Eng. Struct. Dyn. 4 (1976) 245-249.
        """
        if isinstance(self.of, BarGroup | RodGroup):
            offset = getattr(self.of, "offsets", None)
            ends = nodes if offset is None else nodes + jnp.asarray(offset, nodes.dtype)
            line = made.density * made.area + getattr(made, "line_mass", 0.0)
            half = line * jnp.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
            return jnp.stack([half, half], axis=1)
        blocks = _blocks(made, nodes)
        count = made.num_nodes
        shares = jnp.trace(jnp.sum(blocks, axis=3), axis1=2, axis2=3) / 3.0
        if count > 4 and not (made.coordinates == 3 and count in (6, 8)):
            where = lambda e: e.layup.area_mass if hasattr(e, "layup") else e.density
            unit = eqx.tree_at(where, made, jnp.ones_like(where(made)))  # its own density may be zero
            own = jnp.einsum("eiaia->ei", _blocks(unit, nodes))
            return own * (jnp.sum(shares, axis=1) / jnp.sum(own, axis=1))[:, None]
        return jnp.broadcast_to(jnp.mean(shares, axis=1, keepdims=True), shares.shape) if count < 4 else shares

    def stiff_directions(self, element: AbstractElement, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Nothing."""
        nothing = np.zeros((len(self.nodes), 1, 0, 3))
        return nothing, nothing

    def mass_directions(self, element: Any, numbers: DeckParameters) -> tuple[np.ndarray, np.ndarray]:
        """Mass directions as of CONM2."""
        masses = PointMassGroup(self.nodes, self.ids, element.value, element.offset, element.inertia)
        return masses.mass_directions(element, numbers)


def _ones(made, nodes):
    """(elements, k) of one where an element has mass."""
    heavy = (made.layup.area_mass if hasattr(made, "layup") else made.density) > 0
    return jnp.broadcast_to(heavy[:, None], nodes.shape[:2]).astype(nodes.dtype)


def _blocks(made, nodes):
    """Blocks (elements, k, 3, k, 3) of the displacements in the consistent masses."""
    M = jax.vmap(lambda element, at: element.mass(at))(made, nodes)
    count, size = made.num_nodes, made.coordinates
    return M.reshape(len(M), count, size, count, size)[:, :, :3, :, :3]


def lump_masses(elements: dict[str, AbstractElementGroup]) -> dict[str, AbstractElementGroup]:
    """Groups with masses of their own divided in two, "CBAR 1" and "mass of CBAR 1"."""
    made: dict[str, AbstractElementGroup] = {}
    for name, own in elements.items():
        if not isinstance(own, HEAVY) or isinstance(own, PanelSideGroup):
            made[name] = own
            continue
        made[name] = MasslessGroup(own.nodes, own.ids, own)
        nodes = tuple((node,) for row in own.nodes for node in row)
        ids = tuple(one for one, row in zip(own.ids, own.nodes, strict=True) for _ in row)
        made[f"mass of {name}"] = LumpedMassGroup(nodes, ids, own, name.startswith("CBEAM"))
    return made
