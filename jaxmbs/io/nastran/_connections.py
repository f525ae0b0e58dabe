"""Cards of lines: which nodes they join."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from ...elements import DIRECTIONS
from ._cards import Card
from ._context import DeckContext
from ._groups import AbstractElementGroup, BarGroup, RodGroup, TwistGroup
from ._properties import BeamProperty

Groups = dict[str, AbstractElementGroup]
_PROPERTY_CARDS = {"CBAR": ("PBAR", "PBARL"), "CBEAM": ("PBEAM", "PBEAML"), "CROD": ("PROD",)}
_PROPERTY_CARDS |= {"CTUBE": ("PTUBE",), "CVISC": ("PVISC",)}


def group_cards(cards: list[Card], key: Callable[[Card], Any]) -> dict[Any, list[Card]]:
    """Cards by what they have in common, each identifier once; a card that repeats another one is left out."""
    found, seen = {}, {}
    for card in cards:
        one = card.integer(1, "EID")
        if one in seen:
            if seen[one] != card.fields:
                card.fault("duplicate element with different data")
            continue
        seen[one] = card.fields
        found.setdefault(key(card), []).append(card)
    return found


def element_ids(cards: list[Card]) -> tuple[int, ...]:
    """Identifiers of elements."""
    return tuple(card.integer(1, "EID") for card in cards)


def node_indices(card: Card, deck: DeckContext, first: int, count: int) -> tuple[int, ...]:
    """Places of the nodes of an element."""
    nodes = tuple(deck.node(card, k, f"G{k - first + 1}") for k in range(first, first + count))
    if len({card.text(k) for k in range(first, first + count)}) < count and deck.index:
        card.fault("it repeats a node")
    return nodes


def bars(cards: list[Card], deck: DeckContext) -> Groups:
    """CBAR or CBEAM; a group for each property and each set of pins."""
    made: Groups = {}
    for (owner, pins), own in group_cards(
        cards, lambda card: (deck.owner(card, *_PROPERTY_CARDS[card.name]), _pins(card))
    ).items():
        nodes = [node_indices(card, deck, 3, 2) for card in own]
        third = tuple(_orientation_node(card, deck) for card in own)
        vectors = [_orientation_vectors(card, deck, ends) for card, ends in zip(own, nodes, strict=True)]
        offsets = np.array([_offsets(card, deck, ends) for card, ends in zip(own, nodes, strict=True)])
        name = " ".join([own[0].name, owner.partition(" ")[2], *(["without", *pins] if pins else [])])
        given = offsets if np.any(offsets) else None
        polar = deck.polar or own[0].name == "CBEAM"
        made[name] = BarGroup(tuple(nodes), element_ids(own), owner, np.array(vectors), third, given, pins, polar)
    return made


def _pins(card):
    ends = [card.directions(k, name, "") for k, name in ((9, "PA"), (10, "PB"))]
    if {0, 1, 2, 3} & set(ends[0]) & set(ends[1]):
        card.fault("PA and PB free the same direction at both ends: a mechanism")
        return ()
    if card.name == "CBEAM":
        card.refuse_fields("warping SA, SB", 17, 18)
    return tuple(f"{DIRECTIONS[d]}{end}" for end, free in enumerate(ends, start=1) for d in free)


def _orientation_node(card, deck):
    """Place of the node that gives plane 1, -1 where a vector does."""
    by_node = card.text(5).isdigit() and not card.text(6) and not card.text(7)
    return deck.node(card, 5, "G0") if by_node else -1


def _orientation_vectors(card, deck, ends):
    if _orientation_node(card, deck) >= 0:
        return np.zeros(3)
    vector = np.array(card.reals(5, 3, "X"))
    if not any(vector):
        card.fault("the vector X1 X2 X3 of plane 1 is missing")
    return vector if _systems(card)[0] == "B" else vector @ deck.axes(ends[0])


def _systems(card):
    """OFFT: the systems of the vector, basic or of the displacements, and of the offsets.

    Old decks have 1 for a vector and 2 for a node there.
    """
    text = card.text(8).upper()
    if text in ("1", "2"):
        return "GGG"
    if text and not re.fullmatch("[GB]GG", text):
        card.fault(f"OFFT {text[:8]!r} is not supported: GGG and BGG are")
    return text or "GGG"


def _offsets(card, deck, ends):
    given = card.reals(11, 3, "WA"), card.reals(14, 3, "WB")
    return [np.array(offset) @ deck.axes(end) for offset, end in zip(given, ends, strict=True)]


def rods(cards: list[Card], deck: DeckContext) -> Groups:
    """CROD and CTUBE, whose torsion is a group of its own, or CVISC."""
    made: Groups = {}
    for owner, own in group_cards(cards, lambda card: deck.owner(card, *_PROPERTY_CARDS[card.name])).items():
        nodes, name = (
            tuple(node_indices(card, deck, 3, 2) for card in own),
            f"{own[0].name} {owner.partition(' ')[2]}",
        )
        if own[0].name == "CVISC":
            made[name] = TwistGroup(nodes, element_ids(own), owner)
        else:
            made |= _rod_groups(name, nodes, own, owner, deck)
    return made


def _rod_groups(name, nodes, own, owner, deck):
    made: Groups = {name: RodGroup(nodes, element_ids(own), owner)}
    if owner and float(deck.properties[owner].torsion) > 0:
        made[f"torsion of {name}"] = TwistGroup(nodes, element_ids(own), owner)
    return made


def conrods(cards: list[Card], deck: DeckContext) -> Groups:
    """CONROD: a group and a property "CONROD 7", of its first element, for each material, area and NSM."""
    made: Groups = {}
    values = lambda card: (
        card.integer(4, "MID"),
        *(card.real(k, n, 0.0) for k, n in ((5, "A"), (6, "J"), (8, "NSM"))),
    )
    for (_, area, J, nsm), own in group_cards(cards, values).items():
        name = f"CONROD {own[0].integer(1, 'EID')}"
        material = deck.material(own[0], 4, "MID")
        if not area > 0 or nsm < 0 or J < 0:
            own[0].fault("A must be positive, J and NSM must not be negative")
        deck.properties[name] = BeamProperty(area, 0.0, 0.0, J, nsm, None, material)
        made |= _rod_groups(name, tuple(node_indices(card, deck, 2, 2) for card in own), own, name, deck)
    return made
