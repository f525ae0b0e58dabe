"""Coordinate systems CORD1R, CORD2R and their cylindrical and spherical kin."""

import graphlib
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ...typing import AnyArray
from ._cards import Card

_KINDS = {f"CORD{n}{kind}": (n, kind) for n in "12" for kind in "RCS"}
NAMES = tuple(_KINDS)


class CoordinateSystem(eqx.Module):
    """A coordinate system in basic axes.

    Attributes:
        origin: (3,) [m]; axes: (3, 3), rows x y z.
        kind: "R" rectangular, "C" cylindrical (r, theta, z), "S" spherical (r, theta, phi); angles in degrees.
    """

    origin: Float[AnyArray, "3"]
    axes: Float[AnyArray, "3 3"]
    kind: str = eqx.field(static=True, default="R")

    def at(self, point: AnyArray, xp: Any = jnp) -> Any:
        """Rows (3, 3): the directions 1 2 3 at a point (3,) in basic axes.  Args: xp: `jnp` or `np`."""
        axes = xp.asarray(self.axes, point.dtype)
        if self.kind == "R":
            return axes
        x, y, z = axes @ (point - xp.asarray(self.origin, point.dtype))
        across = xp.hypot(x, y)
        one = xp.where(across > 0, across, 1.0)  # on the axis, r points along x
        c, s = xp.where(across > 0, x / one, 1.0), y / one
        zero = xp.zeros_like(c)
        radial, turned, up = xp.stack([c, s, zero]), xp.stack([-s, c, zero]), xp.stack([zero, zero, zero + 1.0])
        if self.kind == "C":
            return xp.stack([radial, turned, up]) @ axes
        length = xp.hypot(across, z)
        one = xp.where(length > 0, length, 1.0)
        along, flat = xp.where(length > 0, z / one, 1.0), across / one
        return xp.stack([flat * radial + along * up, along * radial - flat * up, turned]) @ axes


BASIC = CoordinateSystem(np.zeros(3), np.eye(3))


def to_basic(frame: CoordinateSystem, given: list[float]) -> np.ndarray:
    """Basic coordinates (3,) of a point given in a frame; looks at values."""
    a, b, c = given
    if frame.kind == "C":
        a, b = a * np.cos(np.radians(b)), a * np.sin(np.radians(b))
    if frame.kind == "S":
        theta, phi = np.radians([b, c])
        a, b, c = a * np.sin(theta) * np.cos(phi), a * np.sin(theta) * np.sin(phi), a * np.cos(theta)
    return np.asarray(frame.origin) + np.array([a, b, c]) @ np.asarray(frame.axes)


def read_coordinate_systems(
    found: dict[str, list[Card]], grids: dict[int, tuple[Card, int, list[float]]]
) -> dict[int, CoordinateSystem]:
    """All coordinate systems by number, 0 the basic one, whatever their order in the deck.

    Args: grids: card, frame and coordinates of each node, for CORD1R and its kin.
    """
    given: dict[int, tuple[Card, str, list[Any]]] = {}
    for name, (form, kind) in _KINDS.items():
        for card in found.get(name, ()):
            for start in (1, 5) if form == "1" and card.text(5) else (1,):
                one = card.integer(start, "CID")
                points = [card.integer(k, "G") for k in range(start + 1, start + 4)] if form == "1" else _points(card)
                if one in given and given[one][0].fields != card.fields:
                    card.fault(f"duplicate coordinate system {one}")
                given[one] = card, kind, points
    needs = {one: _reference_points(card, points, grids) for one, (card, _, points) in given.items()}
    try:
        order = list(graphlib.TopologicalSorter(needs).static_order())
    except graphlib.CycleError as error:
        card = next(given[one][0] for one in error.args[1] if one in given)
        card.fault(f"coordinate systems refer to one another in a cycle: {error.args[1][:8]}")
        return {0: BASIC}
    made = {0: BASIC}
    for one in order:
        if one in given:
            made[one] = _read_system(*given[one], made, grids)
    return made


def _points(card):
    """(reference, coordinates of three points) of a CORD2R and its kin."""
    return [card.integer(2, "RID", 0, low=0), *(card.reals(k, 3, name) for k, name in ((3, "A"), (6, "B"), (9, "C")))]


def _reference_points(card, points, grids):
    if card.name.startswith("CORD2"):
        return {points[0]}
    return {grids[g][1] for g in points if g in grids}


def _read_system(card, kind, points, made, grids):
    if card.name.startswith("CORD2"):
        reference = find_system(points[0], made, card)
        a, b, c = (to_basic(reference, point) for point in points[1:])
    else:
        missing = [g for g in points if g not in grids]
        if missing:
            card.fault(f"there is no GRID {', '.join(map(str, missing))}")
            return BASIC
        a, b, c = (to_basic(find_system(grids[g][1], made, card), grids[g][2]) for g in points)
    z = b - a
    y = np.cross(z, c - a)
    if not np.linalg.norm(y) > 1e-9 * np.linalg.norm(z) * np.linalg.norm(c - a) or not np.all(np.isfinite(y)):
        card.fault("its three points lie on a line")
        return BASIC
    z, y = z / np.linalg.norm(z), y / np.linalg.norm(y)
    return CoordinateSystem(a, np.stack([np.cross(y, z), y, z]), kind)


def find_system(one: int, made: dict[int, CoordinateSystem], card: Card) -> CoordinateSystem:
    """A coordinate system by its number; the basic one, and a fault, where there is none."""
    if one not in made:
        card.fault(f"there is no coordinate system {one}")
    return made.get(one, BASIC)
