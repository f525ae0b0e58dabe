"""Cards of plates and solids: which nodes they join, and how their material lies in them."""

from typing import Any, NamedTuple

import numpy as np

from ... import elements
from ._cards import Card
from ._connections import Groups, element_ids, group_cards, node_indices
from ._context import DeckContext
from ._panel_groups import PanelGroup, PanelSideGroup
from ._shell_groups import ShellGroup, SolidGroup

#: Kinds of elements with all their nodes, by the numbers of corners and of all nodes.
_SOLIDS = {
    **dict(CTETRA=(4, elements.Tetrahedron, elements.QuadraticTetrahedron)),
    **dict(CPENTA=(6, elements.Wedge, elements.QuadraticWedge)),
    **dict(CHEXA=(8, elements.Hexahedron, elements.QuadraticHexahedron)),
}


class _ShellFields(NamedTuple):
    """Numbers of nodes and corners; fields of THETA, ZOFFS, T1 and TFLAG; edges with nodes at their middles."""

    nodes: int
    corners: int
    theta: int
    offset: int
    thickness: int
    flag: int
    edges: tuple[tuple[int, int], ...] = ()


_SQUARE, _TRIANGLE = _ShellFields(4, 4, 7, 8, 11, 10), _ShellFields(3, 3, 6, 7, 11, 10)
_SHELLS = {
    **dict(CQUAD4=_SQUARE, CQUADR=_SQUARE, CTRIA3=_TRIANGLE, CTRIAR=_TRIANGLE),
    **dict(CQUAD8=_ShellFields(8, 4, 15, 16, 11, 17, ((0, 1), (1, 2), (2, 3), (3, 0)))),
    **dict(CTRIA6=_ShellFields(6, 3, 9, 10, 11, 14, ((0, 1), (1, 2), (2, 0)))),
}
_SECTIONS = ("PSHELL", "PCOMP", "PCOMPG")


def _given_nodes(card: Card, most: int) -> tuple[int, ...]:
    """Numbers among all nodes of an element of those that its card has."""
    return tuple(k for k in range(most) if card.text(3 + k))


def _nodes_of(card, deck, given, corners):
    for k in range(corners):
        if k not in given:
            card.fault(f"G{k + 1} is missing")
    numbers = [card.text(3 + k) for k in given]
    if len(set(numbers)) < len(numbers):
        card.fault("it repeats a node")
    return tuple(deck.node(card, 3 + k, f"G{k + 1}") for k in given)


def _halves(given, corners, edges):
    """By node of the whole element, the places among the given nodes whose mean it is; () where all are given."""
    place = {node: k for k, node in enumerate(given)}
    if len(given) in (corners, corners + len(edges)):
        return ()
    rows = [(place.get(k, 0),) for k in range(corners)]
    for k, (a, b) in enumerate(edges, start=corners):
        rows.append((place[k],) if k in place else (place.get(a, 0), place.get(b, 0)))
    return tuple(rows)


def _parts(name, given, corners, edges, own):
    """Name of a group of elements of a property with these nodes."""
    whole = "" if len(given) == corners else f" of {len(given)} nodes"
    missing = [k for k in range(corners, corners + len(edges)) if k not in given]
    without = " without " + ", ".join(f"G{k + 1}" for k in missing) if whole and missing else ""
    return f"{own[0].name} {name.partition(' ')[2]}{whole}{without}"


def solids(cards: list[Card], deck: DeckContext) -> Groups:
    """CTETRA, CPENTA, CHEXA; a group for each property and set of nodes."""
    made: Groups = {}
    corners, plain, quadratic = _SOLIDS[cards[0].name]
    edges = quadratic.rule.edges
    most = corners + len(edges)
    key = lambda card: (deck.owner(card, "PSOLID"), _given_nodes(card, most))
    for (owner, given), own in group_cards(cards, key).items():
        nodes = tuple(_nodes_of(card, deck, given, corners) for card in own)
        for card in own:
            if len(card) > 2 + most:
                card.fault(f"it has {len(card) - 2} nodes; a {card.name} has at most {most}")
        axes = None
        if owner and deck.properties[owner].material.startswith("MAT9"):
            frame = deck.frame(own[0], deck.properties[owner].frame)
            axes = np.array([frame.at(deck.positions[list(row)].mean(axis=0), np) for row in nodes])
        kind = plain if len(given) == corners else quadratic
        name = _parts(owner, given, corners, edges, own)
        made[name] = SolidGroup(nodes, element_ids(own), owner, axes, kind, _halves(given, corners, edges))
    return made


def panels(cards: list[Card], deck: DeckContext) -> Groups:
    """CSHEAR, and rods along its sides where F1 and F2 of its PSHEAR ask for them."""
    made: Groups = {}
    for owner, own in group_cards(cards, lambda card: deck.owner(card, "PSHEAR")).items():
        nodes = tuple(node_indices(card, deck, 3, 4) for card in own)
        name = f"CSHEAR {owner.partition(' ')[2]}"
        made[name] = PanelGroup(nodes, element_ids(own), owner)
        for k in range(2) if owner and any(np.asarray(deck.properties[owner].edges) > 0) else ():
            for a, b in ((0, 1), (2, 3)) if k == 0 else ((1, 2), (3, 0)):
                pairs = tuple((row[a], row[b]) for row in nodes)
                side = f"side {a + 1} {b + 1} of {name}"
                made[side] = PanelSideGroup(pairs, element_ids(own), owner, nodes, k)
    return made


def plates(cards: list[Card], deck: DeckContext) -> Groups:
    """CQUAD4, CQUADR, CQUAD8, CTRIA3, CTRIAR or CTRIA6 of a PSHELL, PCOMP or PCOMPG."""
    made: Groups = {}
    fields = _SHELLS[cards[0].name]
    key = lambda card: (deck.owner(card, *_SECTIONS), _given_nodes(card, fields.nodes))
    for (owner, given), own in group_cards(cards, key).items():
        nodes = tuple(_nodes_of(card, deck, given, fields.corners) for card in own)
        section: Any = deck.properties.get(owner)
        _remark_shear(own[0], section, deck, fields)
        sizes = [_thickness(card, section, fields, deck) for card in own]
        offsets = np.array([card.real(fields.offset, "ZOFFS", 0.0) for card in own])
        axes = [_material_axis(card, deck, fields, row) for card, row in zip(own, nodes, strict=True)]
        theta, along = zip(*axes, strict=True)
        made[_parts(owner, given, fields.corners, fields.edges, own)] = ShellGroup(
            nodes,
            element_ids(own),
            owner,
            _sizes(sizes, section),
            offsets if np.any(offsets) else None,
            np.array(theta),
            np.array(along),
            deck.drilling if own[0].name in ("CQUAD4", "CTRIA3") else None,
            fields.corners + (len(fields.edges) if len(given) > fields.corners else 0),
            _halves(given, fields.corners, fields.edges),
        )
    return made


def _sizes(given, section):
    """Thicknesses (elements,), those of the property where a card gives none; None where none does."""
    if all(t is None for t in given):
        return None
    return np.array([float(section.thickness) if t is None else t for t in given])


def _remark_shear(card, section, deck, fields):
    if section is not None and section.is_plain and section.is_thin and not fields.edges:
        deck.remark(f"{card.name} has no transverse shear, as MID3 is blank; shear_factor 5/6 of its PSHELL gives it")


def _thickness(card, section, fields, deck):
    """Mean of T1 ... of the corners where the card gives them, else None or the thickness of the property."""
    given = [card.real(fields.thickness + k, "T", None) for k in range(fields.corners)]
    common = None if section is None or np.ndim(section.thickness) else float(section.thickness)
    if all(t is None or t == common for t in given):
        return None
    if common is None:
        return card.fault("a thickness T1 ... needs a PSHELL")
    relative = card.text(fields.flag) == "1"  # TFLAG
    found = [common if t is None else t * common if relative else t for t in given]
    if not all(t > 0 for t in found):
        card.fault("T1 ... must be positive")
    if len(set(found)) > 1:
        deck.remark(f"{card.name} of a thickness that changes over it has its mean")
    return float(np.mean(found))


def _material_axis(card, deck, fields, row):
    """THETA in degrees and zero, or zero and the x axis of the system MCID in the middle of the element."""
    text = card.text(fields.theta)
    if not text or "." in text:
        return card.real(fields.theta, "THETA", 0.0), np.zeros(3)
    one = card.integer(fields.theta, "MCID", low=0)
    return 0.0, deck.frame(card, one).at(deck.positions[list(row)].mean(axis=0), np)[0]
