"""Cards of masses, springs and bushings."""

import numpy as np

from ...checks import in_range
from ._cards import Card
from ._connections import Groups, element_ids, group_cards, node_indices
from ._context import DeckContext
from ._point_groups import BushingGroup, PointMassGroup, ScalarSpringGroup


def masses(cards: list[Card], deck: DeckContext) -> Groups:
    """CONM2: those that are mere points apart from those with an offset or an inertia."""
    made: Groups = {}
    for plain, own in group_cards(cards, lambda card: not any(card.text(k) for k in range(5, 15))).items():
        nodes = tuple((deck.node(card, 2, "G"),) for card in own)
        values = [card.real(4, "M", 0.0) for card in own]
        for card, value in zip(own, values, strict=True):
            if value < 0:
                card.fault("M must not be negative")
        if plain:
            made["CONM2"] = PointMassGroup(nodes, element_ids(own), values, None, None)
            continue
        found = [_offset_and_inertia(card, deck, node) for card, (node,) in zip(own, nodes, strict=True)]
        offsets, inertias = (np.array(part) for part in zip(*found, strict=True))
        made["CONM2 with inertia"] = PointMassGroup(nodes, element_ids(own), values, offsets, inertias)
    return made


def _offset_and_inertia(card, deck, node):
    """Offset (3,) and inertia (3, 3) about the centre of mass, basic axes."""
    one, point = card.integer(3, "CID", 0, low=-1), deck.positions[node]
    axes = deck.frame(card, max(one, 0)).at(point, np)
    offset = np.array(card.reals(5, 3, "X"))
    xx, yx, yy, zx, zy, zz = card.reals(9, 6, "I")
    inertia = np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])
    if not in_range(inertia):
        card.fault("its inertia is too large")
    elif np.linalg.eigvalsh(inertia)[0] < -1e-6 * np.max(np.abs(inertia)):
        card.fault("its inertia is negative about some axis")
    offset = offset - point if one == -1 else offset @ axes
    return offset, axes.T @ inertia @ axes


_SCALARS = {"CELAS": ("PELAS", "stiffness"), "CMASS": ("PMASS", "mass"), "CDAMP": ("PDAMP", "damping")}


def scalars(cards: list[Card], deck: DeckContext) -> Groups:
    """CELAS, CMASS, CDAMP between two directions of GRIDs or scalar points, or from one to ground.

    Forms 1 and 3 have a property, 2 and 4 a number of their own; 3 and 4 join scalar points.
    """
    kind, form = cards[0].name[:-1], cards[0].name[-1]
    prop, what = _SCALARS[kind]
    own_rate, step = form in "24", 2 if form in "12" else 1
    key = lambda card: ("" if own_rate else deck.owner(card, prop), _ends(card, step))
    made: Groups = {}
    for (owner, fields), own in group_cards(cards, key).items():
        nodes = [tuple(deck.node(card, k, "G") for k in fields) for card in own]
        ends = [
            [_direction(card, k + 1 if step == 2 else 99, deck, node) for k, node in zip(fields, row, strict=True)]
            for card, row in zip(own, nodes, strict=True)
        ]
        rates = [_rate(card, deck) for card in own] if own_rate else None
        for card, row in zip(own, nodes, strict=True):
            if len(set(row)) < len(row):
                card.fault("a spring between two directions of one node is not supported")
        parts = [own[0].name, owner.partition(" ")[2], "to ground" if len(fields) == 1 else ""]
        name = " ".join(part for part in parts if part)
        if name in made:  # grounded at the first or at the second end
            name += ", first end"
        made[name] = ScalarSpringGroup(tuple(nodes), element_ids(own), owner, rates, np.array(ends), what)
    return made


def _ends(card, step):
    """Fields of the nodes that are given."""
    given = tuple(k for k in (3, 3 + step) if card.text(k) not in ("", "0"))
    if not given:
        card.fault("it names no node")
    return given or (3,)


def _direction(card, k, deck, node):
    found = deck.directions(card, k, f"C{k // 2 - 1}", node)
    if len(found) != 1:
        card.fault(f"C{k // 2 - 1} must be one of 1 to 6")
        return np.zeros(6)
    row = np.zeros(6)
    first = 3 * (found[0] // 3)
    row[first : first + 3] = deck.axes(node)[found[0] % 3]
    return row


def _rate(card, deck):
    if card.name == "CELAS2" and card.real(7, "GE", 0.0):
        deck.note("structural damping GE of CELAS2")
    value = card.real(2, {"CELAS": "K", "CMASS": "M", "CDAMP": "B"}[card.name[:-1]])
    if value < 0 and card.name[:-1] != "CELAS":
        card.fault("its number must not be negative")
    return value


def bushes(cards: list[Card], deck: DeckContext) -> Groups:
    """CBUSH: a group for each property, to ground or between nodes, with axes of its own or along its line."""
    made: Groups = {}
    key = lambda card: (deck.owner(card, "PBUSH"), card.text(4) in ("", "0"), _kind(card))
    for (owner, grounded, kind), own in group_cards(cards, key).items():
        nodes = [(deck.node(card, 3, "GA"),) if grounded else node_indices(card, deck, 3, 2) for card in own]
        axes = vectors = None
        if kind == "frame":
            axes = np.array([_frame(card, deck, row[0]) for card, row in zip(own, nodes, strict=True)])
        else:
            lines = [_line(card, deck, row) for card, row in zip(own, nodes, strict=True)]
            if kind == "vector":
                pairs = zip(own, nodes, lines, strict=True)
                vectors = np.array([_vector(card, deck, row, line) for card, row, line in pairs])
            elif owner and np.any(np.delete(np.asarray(deck.properties[owner].stiffness), [0, 3])):
                own[0].fault("it needs a vector or a CID: its PBUSH is stiff across its line")
        places = [card.real(9, "S", 0.5) for card in own]
        for card in own:
            card.refuse_fields("an offset OCID, S1, S2, S3", 10, 11, 12, 13, harmless=("-1",))
        name = " ".join(["CBUSH", owner.partition(" ")[2], *(["to ground"] if grounded else []), kind])
        made[name] = BushingGroup(tuple(nodes), element_ids(own), owner, axes, vectors, places)
    return made


def _kind(card):
    if card.text(8):
        return "frame"
    return "vector" if card.text(5) else "line"


def _frame(card, deck, node):
    return deck.frame(card, card.integer(8, "CID", low=0)).at(deck.positions[node], np)


def _line(card, deck, row):
    line = deck.positions[row[-1]] - deck.positions[row[0]]
    if not np.linalg.norm(line) > 0:
        card.fault("its nodes coincide or it is grounded: it needs a CID")
    return line


def _vector(card, deck, row, line):
    if card.text(5).isdigit() and not card.text(6) and not card.text(7):
        vector = deck.positions[deck.node(card, 5, "G0")] - deck.positions[row[0]]
    else:
        vector = np.array(card.reals(5, 3, "X")) @ deck.axes(row[0])
    if not np.linalg.norm(np.cross(line, vector)) > 1e-9 * np.linalg.norm(line) * np.linalg.norm(vector):
        card.fault("its vector lies along its line")
    return vector
