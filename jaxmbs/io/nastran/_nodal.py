"""Stiffness and mass of nodes by direction, summed over elements without matrices."""

from typing import NamedTuple

import numpy as np

from ...errors import ModelError
from ._connections import Groups
from ._context import DeckContext
from ._coordinates import DeckCoordinates
from ._groups import DeckParameters
from ._ties import AbstractTie, Pair, RigidTie

WEAK = 1e-8  # below which, against a node's other directions, PARAM AUTOSPC holds one


class NodalSums(NamedTuple):
    """By node: how many coordinates elements give it (0, 3 or 6); sums (nodes, 2, 3, 3), for translations and
    rotations in basic axes, of products of the directions that elements stiffen, and of those that carry mass.
    """

    sizes: np.ndarray
    stiff_directions: np.ndarray
    mass_directions: np.ndarray


def nodal_sums(deck: DeckContext, elements: Groups, numbers: DeckParameters) -> NodalSums:
    """Sums over all elements.  Raises: ModelError for badly shaped elements."""
    count = len(deck.ids)
    found, faults = NodalSums(np.zeros(count, int), *np.zeros((2, count, 2, 3, 3))), []
    for name, own in elements.items():
        element, nodes = own.outline(numbers), np.array(own.nodes)
        bad = np.nonzero(element.is_degenerate(deck.positions[nodes]))[0]
        faults += [f"{name.split()[0]} {own.ids[k]}: {element.degeneracy}" for k in bad[:50]]
        if faults:
            continue
        np.maximum.at(found.sizes, nodes.ravel(), element.coordinates)
        for total, given in (
            (found.stiff_directions, own.stiff_directions),
            (found.mass_directions, own.mass_directions),
        ):
            for kind, directions in enumerate(given(element, numbers)):
                np.add.at(total[:, kind], nodes, np.einsum("eknx,ekny->ekxy", directions, directions))
    if faults:
        raise ModelError(faults)
    return found


def autospc_directions(deck: DeckContext, nodal: NodalSums, ties: dict[str, AbstractTie]) -> set[Pair]:
    """Directions that no element stiffens, which PARAM AUTOSPC holds."""
    masters = {tie.master for tie in ties.values() if isinstance(tie, RigidTie)}
    found = set()
    values = np.linalg.eigvalsh(nodal.stiff_directions)
    suspect = values[..., 0] <= WEAK * np.maximum(values[..., -1], 1e-300)
    for n, kind in np.argwhere(suspect).tolist():
        if n in masters or nodal.sizes[n] <= 3 * kind:
            continue
        axes = deck.axes(n)
        size, shapes = np.linalg.eigh(axes @ nodal.stiff_directions[n, kind] @ axes.T)
        missing = [shapes[:, k] for k in range(3) if size[k] <= WEAK * max(size[-1], 1e-300)]
        taken: set[int] = set()
        for shape in missing:  # the direction of the node that is nearest to each
            taken.add(max((d for d in range(3) if d not in taken), key=lambda d: abs(shape[d])))
        found |= {(n, 3 * kind + d) for d in taken}
    return found


def rows_without_mass(coordinates: DeckCoordinates, nodal: NodalSums, positions) -> tuple[int, ...]:
    """Rows of the free coordinates in which nothing has mass."""
    apart = set(coordinates.others)
    mass = np.array(
        [0.0 if n in apart else nodal.mass_directions[n, d // 3, d % 3, d % 3] for n, d in coordinates.free]
    )
    if apart:
        columns, motions = coordinates.motions_by_columns(positions)
        motions = np.asarray(motions).reshape(len(apart), 2, 3, len(columns))
        mass[columns] += np.einsum(
            "okaq,okab,okbq->q", motions, nodal.mass_directions[np.array(coordinates.others)], motions
        )
    return tuple(np.flatnonzero(mass <= 1e-14 * np.max(mass, initial=0.0)).tolist())
