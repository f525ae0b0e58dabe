"""Cards of plates and solids: which nodes they join, and how their material lies in them."""

from typing import Any

import numpy as np

from ._cards import Card
from ._connections import Groups, element_ids, group_cards, node_indices
from ._context import DeckContext
from ._shell_groups import ShellGroup, SolidGroup

_CORNERS = {"CQUAD4": 4, "CQUADR": 4, "CTRIA3": 3, "CTRIAR": 3}
#: Nodes at corners, and with those at the middles of edges.
_SOLIDS = {"CTETRA": (4, 10), "CPENTA": (6, 15), "CHEXA": (8, 20)}


def solids(cards: list[Card], deck: DeckContext) -> Groups:
    """CTETRA, CPENTA, CHEXA; a group for each property and number of nodes."""
    made: Groups = {}
    counts = _SOLIDS[cards[0].name]
    for (owner, whole), own in group_cards(
        cards, lambda card: (deck.owner(card, "PSOLID"), len(card) > 2 + counts[0])
    ).items():
        nodes = tuple(node_indices(card, deck, 3, counts[whole]) for card in own)
        for card in own:
            if len(card) > 2 + counts[1]:
                card.fault(f"it has {len(card) - 2} nodes; a {card.name} has at most {counts[1]}")
        axes = None
        if owner and deck.properties[owner].material.startswith("MAT9"):
            frame = deck.frame(own[0], deck.properties[owner].frame)
            axes = np.array([frame.at(deck.positions[list(row)].mean(axis=0), np) for row in nodes])
        name = f"{own[0].name} {owner.partition(' ')[2]}" + (f" of {counts[1]} nodes" if whole else "")
        made[name] = SolidGroup(nodes, element_ids(own), owner, axes)
    return made


def plates(cards: list[Card], deck: DeckContext) -> Groups:
    """CQUAD4, CQUADR, CTRIA3 or CTRIAR of a PSHELL, PCOMP or PCOMPG."""
    made: Groups = {}
    count = _CORNERS[cards[0].name]
    owner_of = lambda card: deck.owner(card, "PSHELL", "PCOMP", "PCOMPG")
    for owner, own in group_cards(cards, owner_of).items():
        nodes = tuple(node_indices(card, deck, 3, count) for card in own)
        section: Any = deck.properties.get(owner)
        _remark_shear(own[0], section, deck, count)
        sizes = [_thickness(card, section, count, deck) for card in own]
        offsets = np.array([card.real(count + 4, "ZOFFS", 0.0) for card in own])
        theta, along = zip(
            *[_material_axis(card, deck, row) for card, row in zip(own, nodes, strict=True)], strict=True
        )
        made[f"{own[0].name} {owner.partition(' ')[2]}"] = ShellGroup(
            nodes,
            element_ids(own),
            owner,
            _sizes(sizes, section),
            offsets if np.any(offsets) else None,
            np.array(theta),
            np.array(along),
        )
    return made


def _sizes(given, section):
    """Thicknesses (elements,), those of the property where a card gives none; None where none does."""
    if all(t is None for t in given):
        return None
    return np.array([float(section.thickness) if t is None else t for t in given])


def _remark_shear(card, section, deck, count):
    if section is None or not section.is_plain:
        return
    if section.is_thin and count == 4:
        deck.remark(f"{card.name} has no transverse shear, as MID3 is blank; shear_factor 5/6 of its PSHELL gives it")
    elif not section.is_thin and count == 3:
        deck.remark(f"{card.name} has no transverse shear, whatever MID3 says")


def _thickness(card, section, count, deck):
    """Mean of T1 ... of the corners where the card gives them, else None or the thickness of the property."""
    last = 2 * count + 6 + (count == 3)  # T1 ... stand in the last fields of the second row
    given = [card.real(k, "T", None) for k in range(last - count + 1, last + 1)]
    common = None if section is None or np.ndim(section.thickness) else float(section.thickness)
    if all(t is None or t == common for t in given):
        return None
    if common is None:
        return card.fault("a thickness T1 ... needs a PSHELL")
    relative = card.text(last - count) == "1"  # TFLAG
    found = [common if t is None else t * common if relative else t for t in given]
    if not all(t > 0 for t in found):
        card.fault("T1 ... must be positive")
    if len(set(found)) > 1:
        deck.remark(f"{card.name} of a thickness that changes over it has its mean")
    return float(np.mean(found))


def _material_axis(card, deck, row):
    """THETA in degrees and zero, or zero and the x axis of the system MCID in the middle of the element."""
    k = 3 + len(row)
    text = card.text(k)
    if not text or "." in text:
        return card.real(k, "THETA", 0.0), np.zeros(3)
    return 0.0, deck.frame(card, card.integer(k, "MCID", low=0)).at(deck.positions[list(row)].mean(axis=0), np)[0]
