"""Loads of a deck as records, each of which makes forces on nodes of the deck's numbers."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...elements._base import as_optional_real, as_real
from ...elements._shared_matrices import gauss_points
from ...elements._solid import face_rule
from ...errors import ModelError
from ...fem import Structure
from ...fem._loads import _scatter_to_nodes
from ...math._linalg import safe_norm
from ...typing import Convertible


class NodalForces(eqx.Module):
    """FORCE and MOMENT: (m, 6) forces [N] and moments [N m] in basic axes at places of nodes."""

    nodes: tuple[int, ...] = eqx.field(static=True)
    values: Convertible[Float[Array, "m 6"]] = eqx.field(converter=as_real)

    def forces(self, structure: Structure) -> Float[Array, "nodes 6"]:
        """Forces on all nodes."""
        return jnp.zeros((structure.num_nodes, 6)).at[np.array(self.nodes, int)].add(self.values)


class FacePressures(eqx.Module):
    """PLOAD, PLOAD2 and PLOAD4: pressures on faces of as many nodes, consistent with their shape functions.

    Attributes:
        nodes: (m, k) of each face, corners first, counter-clockwise about the normal along which the pressure acts.
        pressures: (m, corners) [Pa].
        direction: (m, 3) along which it acts in place of the normal, zeros for the normal.
    """

    nodes: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    pressures: Convertible[Float[Array, "m corners"]] = eqx.field(converter=as_real)
    direction: Convertible[Float[Array, "m 3"]] = eqx.field(converter=as_real)

    def forces(self, structure: Structure) -> Float[Array, "nodes 6"]:
        """Forces on all nodes."""
        nodes = np.array(self.nodes, int)
        N, slopes, weights = face_rule(nodes.shape[1])
        corners = self.pressures.shape[1]
        of_corners = N if nodes.shape[1] == corners else _corner_shapes(N, corners)

        def one(places, pressures, direction):
            tangents = slopes @ places
            areas = jnp.cross(tangents[:, 0], tangents[:, 1]) * weights[:, None]
            given = jnp.any(direction != 0)
            along = jnp.linalg.norm(areas, axis=1, keepdims=True) * direction[None]
            return N.T @ (jnp.where(given, along, areas) * (of_corners @ pressures)[:, None])

        found = jax.vmap(one)(structure.positions[nodes], self.pressures, self.direction)
        return jnp.zeros((structure.num_nodes, 6)).at[nodes, :3].add(found)


def _corner_shapes(N, corners):
    """Linear shape functions of the corners at the points, from those of a face with nodes on its edges."""
    found = np.array(N[:, :corners])
    for k in range(corners):
        for corner in (k, (k + 1) % corners):
            found[:, corner] += 0.5 * N[:, corners + k]
    return found


class SpanLoads(eqx.Module):
    """PLOAD1: forces and moments along bars of one property, concentrated or linear between two places.

    Attributes:
        group: name of the bars, "CBAR 3"; places (m,): which of them.
        at: (m, 2) where it begins and ends; fractions: (m,) whether as a share of the length, else as a length [m].
        values: (m, 2) there [N, N m, or per m]; spread: (m,) False where it is concentrated at the first.
        projected: (m,) per length as seen along its direction.
        direction: (m,) 0-5 for forces and moments along x, y, z; own_axes: (m,) of the bar, else of the deck.
    """

    group: str = eqx.field(static=True)
    places: tuple[int, ...] = eqx.field(static=True)
    at: Convertible[Float[Array, "m 2"]] = eqx.field(converter=as_real)
    values: Convertible[Float[Array, "m 2"]] = eqx.field(converter=as_real)
    fractions: tuple[bool, ...] = eqx.field(static=True)
    spread: tuple[bool, ...] = eqx.field(static=True)
    projected: tuple[bool, ...] = eqx.field(static=True)
    direction: tuple[int, ...] = eqx.field(static=True)
    own_axes: tuple[bool, ...] = eqx.field(static=True)

    def forces(self, structure: Structure) -> Float[Array, "nodes 6"]:
        """Forces on all nodes: consistent ones, exact at the ends of the bars."""
        group, places = structure.groups[self.group], np.array(self.places, int)
        bars = group.element if group.shared else jax.tree.map(lambda leaf: leaf[places], group.element)
        flags = [np.array(flag) for flag in (self.fractions, self.spread, self.projected, self.own_axes)]
        units = np.eye(6)[np.array(self.direction, int)]
        nodes = group.connections[places]
        axes = (None if group.shared else 0, *[0] * 8)
        found = jax.vmap(_span_load, axes)(bars, structure.positions[nodes], self.at, self.values, units, *flags)
        total = jnp.zeros((structure.num_nodes, 6))
        return total.at[nodes].add(found.reshape(*nodes.shape, 6))


_POINTS, _WEIGHTS = gauss_points(3, 1)  # a linear load on cubic deflections


def _span_load(bar, nodes, at, values, unit, fraction, spread, projected, own):
    length, axes = bar.span(nodes)
    begin, end = at / jnp.where(fraction, 1.0, length)
    share = jnp.asarray((1.0 + _POINTS[:, 0]) / 2.0, nodes.dtype)
    weights = jnp.asarray(_WEIGHTS / 2.0, nodes.dtype)
    load = weights * length * (end - begin) * (values[0] + share * (values[1] - values[0]))
    load = jnp.where(spread, load, weights * values[0])
    places = jnp.where(spread, begin + share * (end - begin), begin)
    frame = jnp.where(own, axes, jnp.eye(3, dtype=axes.dtype))
    force, moment = unit[:3] @ frame, unit[3:] @ frame
    across = jnp.cross(axes[0], force + moment)
    load = load * jnp.where(projected, safe_norm(across), 1.0)
    return bar.span_load(nodes, places, load[:, None] * force[None], load[:, None] * moment[None])


class Acceleration(eqx.Module):
    """GRAV and RFORCE: the masses in a field `field - spin x (spin x (r - centre))` [m/s^2]."""

    field: Convertible[Float[Array, "3"]] = eqx.field(converter=as_real)
    spin: Convertible[Float[Array, "3"]] = eqx.field(converter=as_real, default=(0.0, 0.0, 0.0))
    centre: Convertible[Float[Array, "3"]] = eqx.field(converter=as_real, default=(0.0, 0.0, 0.0))

    def forces(self, structure: Structure) -> Float[Array, "nodes 6"]:
        """Mass matrix of each element times the field at its nodes, or where offsets from them end."""
        total = jnp.zeros((structure.num_nodes, 6))
        for group in structure.groups.values():
            total = total + _scatter_to_nodes(structure, group, group.map(self._forces, structure.positions))
        return total

    def _forces(self, element, nodes):
        """Of one element; the parts of a rigid mass with inertia J make a moment `-spin x J spin`, too."""
        given = (getattr(element, name, None) for name in ("offsets", "offset"))
        offsets = next((offset for offset in given if offset is not None), jnp.zeros_like(nodes))
        arms = nodes + offsets.reshape(-1, 3) - self.centre[None]
        spin = jnp.broadcast_to(self.spin, arms.shape)
        field = self.field[None] - jnp.cross(spin, jnp.cross(spin, arms))
        rows = jnp.zeros((element.num_nodes, element.coordinates), nodes.dtype).at[:, :3].set(field)
        force = element.mass(nodes) @ rows.reshape(-1)
        inertia = getattr(element, "inertia", None)
        return force if inertia is None else force.at[3:].add(-jnp.cross(self.spin, inertia @ self.spin))


class EnforcedPlaces(eqx.Module):
    """SPCD and D of an SPC: displacements (m,) [m or rad] of held directions of nodes.

    Attributes:
        directions: (m, 6) of each, a unit vector over x y z rx ry rz in basic axes.
    """

    nodes: tuple[int, ...] = eqx.field(static=True)
    values: Convertible[Float[Array, " m"]] = eqx.field(converter=as_real)
    directions: Convertible[Float[Array, "m 6"]] = eqx.field(converter=as_real)

    def displacements(self, count: int) -> Float[Array, "nodes 6"]:
        """Of all nodes, zero at the others."""
        rows = self.values[:, None] * self.directions
        return jnp.zeros((count, 6)).at[np.array(self.nodes, int)].add(rows)

    def without(self, held: Float[Array, "nodes 6"]) -> Float[Array, "nodes 6"]:
        """Displacements `held` without what they have in these directions."""
        nodes = np.array(self.nodes, int)
        own = jnp.sum(held[nodes] * self.directions, axis=1, keepdims=True)
        return held.at[nodes].add(-own * self.directions)


class LoadSet(eqx.Module):
    """Loads of a LOAD, or of one number.

    Attributes:
        parts: records; factors (parts,) by which each acts.
        refused: why it cannot be used, one sentence each.
    """

    parts: tuple[Any, ...] = ()
    factors: Convertible[Float[Array, " parts"] | None] = eqx.field(converter=as_optional_real, default=None)
    refused: tuple[str, ...] = eqx.field(static=True, default=())

    def forces(self, structure: Structure, what: str) -> Float[Array, "nodes 6"]:
        """Sum of all but enforced places.  Raises: ModelError."""
        if self.refused:
            raise ModelError(list(self.refused), f"{what} is not supported")
        total = jnp.zeros((structure.num_nodes, 6))
        for k, part in enumerate(self.parts):
            if not isinstance(part, EnforcedPlaces):
                total = total + self._factor(k) * part.forces(structure)
        return total

    @property
    def moves(self) -> bool:
        """True if it has enforced places."""
        return any(isinstance(part, EnforcedPlaces) for part in self.parts)

    def enforced(self, held: Float[Array, "nodes 6"]) -> Float[Array, "nodes 6"]:
        """Enforced displacements, in place of those that the SPC cards give in the same directions."""
        places = [(k, part) for k, part in enumerate(self.parts) if isinstance(part, EnforcedPlaces)]
        for _, part in places:
            held = part.without(held)
        return sum((self._factor(k) * part.displacements(len(held)) for k, part in places), held)

    def _factor(self, k):
        return 1.0 if self.factors is None else self.factors[k]


def stiffness_forces(structure: Structure, u: Float[Array, "nodes 6"]) -> Float[Array, "nodes 6"]:
    """`K u` over all nodes, held ones too, element by element."""
    total = jnp.zeros((structure.num_nodes, 6))
    for group in structure.groups.values():
        own = u[group.connections, : group.element.coordinates].reshape(len(group.nodes), -1)
        found = group.map(lambda e, nodes, x: e.stiffness(nodes) @ x, structure.positions, own)
        total = total + _scatter_to_nodes(structure, group, found)
    return total
