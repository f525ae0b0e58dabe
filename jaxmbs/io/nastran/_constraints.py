"""Cards of supports and ties: SPC, MPC, RBE2, RBE3, RBAR."""

import numpy as np

from ._cards import Card
from ._context import DeckContext
from ._ties import AbstractTie, MeanTie, MultipointTie, Pair, RigidTie

CardsByName = dict[str, list[Card]]


def select_sets(what: str, found: CardsByName, one: int | None, by_case: list[int], faults: list[str]) -> set[int]:
    """Numbers of the active SPC or MPC sets: `one`, else the first of the case control, else the only set."""
    cards = [card for name in (what, what + "1") for card in found.get(name, ())]
    sums = {}
    for card in found.get(what + "ADD", ()):
        if card.integer(1, "SID") in sums:
            card.fault("duplicate set")
        sums[card.integer(1, "SID")] = card, [card.integer(k, "S") for k in range(2, len(card) + 1)]
    sets = {card.integer(1, "SID") for card in cards}
    wanted = {one} if one is not None else set(by_case[:1]) or (set(sums) if len(sums) == 1 else sets)
    listed = ", ".join(map(str, sorted(sets | set(sums))[:20])) or "none"
    if len(wanted) > 1:
        faults.append(f"the deck has the {what} sets {listed}; choose one: read_nastran(..., {what.lower()}=)")
    for missing in sorted(wanted - sets - set(sums)):
        faults.append(f"there is no {what} set {missing}; there are: {listed}")
    for card, parts in (sums[chosen] for chosen in wanted if chosen in sums):
        for part in parts:
            if part not in sets:
                card.fault(f"there is no {what} set {part}{', but a sum of sets' if part in sums else ''}")
        if not parts:
            card.fault("it lists no sets")
    return {part for chosen in wanted for part in (sums[chosen][1] if chosen in sums else [chosen])}


def read_supports(found: CardsByName, sets: set[int], deck: DeckContext) -> set[Pair]:
    """Directions that SPC and SPC1 of these sets hold."""
    pairs = set()
    for card in found.get("SPC", ()):
        if card.integer(1, "SID") in sets:
            for k in (2, 5) if card.text(5) else (2,):
                node = deck.node(card, k, "G")
                pairs |= {(node, d) for d in deck.directions(card, k + 1, "C", node)}
                if card.real(k + 2, "D", 0.0):
                    deck.remark("SPC with an enforced displacement D, which is a load, holds the place where it is")
    for card in found.get("SPC1", ()):
        if card.integer(1, "SID") in sets:
            nodes = deck.nodes(card, card.identifiers(3, "G"))
            if not nodes:
                card.fault("it names no GRID")
            directions = deck.directions(card, 2, "C", nodes[0] if nodes else -1)
            pairs |= {(node, d) for node in nodes for d in directions}
    return pairs


def read_ties(found: CardsByName, sets: set[int], deck: DeckContext) -> dict[str, AbstractTie]:
    """RBE2, RBAR, RBE3, and the MPC of these sets, by name: "RBE2 7"."""
    made: dict[str, AbstractTie] = {}
    for card in found.get("RBE2", ()):
        _add_tie(made, card, _read_rbe2(card, deck))
    for card in found.get("RBAR", ()):
        _add_tie(made, card, _read_rbar(card, deck))
    for card in found.get("RBE3", ()):
        _add_tie(made, card, _read_rbe3(card, deck))
    for k, card in enumerate(card for card in found.get("MPC", ()) if card.integer(1, "SID") in sets):
        made[f"MPC {k + 1}"] = _read_mpc(card, deck)
    return made


def _add_tie(made, card, tie):
    name = f"{card.name} {card.integer(1, 'EID')}"
    if name in made:
        card.fault("duplicate element")
    if tie is not None:
        made[name] = tie


def _read_rbe2(card, deck):
    last = len(card)
    if last > 4 and "." in card.text(last):  # the coefficient of expansion
        deck.note("thermal expansion ALPHA of RBE2")
        card.fields[last] = ""
    master, directions = deck.node(card, 2, "GN"), card.directions(3, "CM")
    nodes = dict.fromkeys(deck.nodes(card, card.identifiers(4, "GM")))
    if not nodes:
        card.fault("it has no dependent GRID")
        return None
    if master in nodes:
        card.fault("its independent node GN is among the dependent ones")
        return None
    return RigidTie(tuple((node, d) for node in nodes for d in directions), master)


def _read_rbar(card, deck):
    """RBAR with all six independent directions at one end, as an RBE2 of the other."""
    if card.real(8, "ALPHA", 0.0):
        deck.note("thermal expansion ALPHA of RBAR")
    ends = deck.node(card, 2, "GA"), deck.node(card, 3, "GB")
    given = [card.directions(k, name, "") for k, name in ((4, "CNA"), (5, "CNB"))]
    if sorted(map(len, given)) != [0, 6]:
        card.fault("CNA or CNB must be 123456, the other one blank")
        return None
    first = 0 if given[0] else 1
    if card.text(6 + first):
        card.fault("the end with the independent directions has dependent ones, too")
    directions = card.directions(7 - first, "CMB" if first == 0 else "CMA", "") or tuple(range(6))
    if card.text(2) == card.text(3):
        card.fault("it repeats a node")
        return None
    return RigidTie(tuple((ends[1 - first], d) for d in directions), ends[first])


def _read_rbe3(card, deck):
    words = {k: card.text(k).upper() for k in range(5, len(card) + 1)}
    marks = {word: k for k, word in words.items() if word in ("UM", "ALPHA")}
    end = min(marks.values(), default=len(card) + 1)
    if "ALPHA" in marks:
        deck.note("thermal expansion ALPHA of RBE3")
    reference, directions = deck.node(card, 3, "REFGRID"), card.directions(4, "REFC")
    weighed = _read_weights(card, deck, end)
    of = [(reference, d) for d in directions]
    dependent = _pairs(card, deck, marks["UM"] + 1, marks.get("ALPHA", len(card) + 1)) if "UM" in marks else of
    pairs = [pair for pair, _ in weighed]
    if not set(dependent) <= {*of, *pairs} or len(set(dependent)) != len(of):
        card.fault(f"UM must name {len(of)} of the directions that it ties")
        return None
    if reference in {node for node, _ in pairs}:
        card.fault("its reference node is among the averaged nodes")
        return None
    tie = MeanTie(tuple(dependent), reference, directions, tuple(pairs), np.array([w for _, w in weighed]))
    if pairs and not tie.holds(deck.positions, deck.axes):
        card.fault("the directions that it averages do not hold its reference node")
        return None
    return tie if pairs else card.fault("it averages no node")


def _read_weights(card, deck, end):
    """((node, direction), weight) of all groups `weight components nodes ...`."""
    found, weight, directions = [], 1.0, ()
    k = 5
    while k < end:
        text = card.text(k)
        if "." in text:
            weight, directions = card.real(k, "WT"), card.directions(k + 1, "C")
            if not weight > 0:
                card.fault("a weight must be positive")
            k += 2
        else:
            if text.upper() == "THRU":
                card.fault("THRU is not supported in RBE3")
            elif text:
                node = deck.node(card, k, "G")
                found += [((node, d), weight) for d in directions]
            k += 1
    return found


def _pairs(card, deck, first, end):
    given = [k for k in range(first, end) if card.text(k)]
    if len(given) % 2:
        card.fault("UM needs pairs of a node and its directions")
        return []
    named = zip(given[::2], given[1::2], strict=True)
    return [(deck.node(card, a, "UM"), d) for a, b in named for d in card.directions(b, "UM")]


def _read_mpc(card, deck):
    places = [k for row in range(2, len(card) + 1, 8) for k in (row, row + 3) if card.text(k)]
    terms: dict[Pair, float] = {}
    for k in places:
        node = deck.node(card, k, "G")
        directions = deck.directions(card, k + 1, "C", node)
        if len(directions) != 1:
            card.fault("C must be one of 1 to 6")
            directions = (0,)
        pair = node, directions[0]
        terms[pair] = terms.get(pair, 0.0) + card.real(k + 2, "A", 0.0)
    first = next(iter(terms), (0, 0))
    scale = terms.setdefault(first, 0.0)
    if scale == 0:
        card.fault("its first coefficient must not be zero")
        scale = 1.0
    return MultipointTie((first,), tuple(terms), np.array(list(terms.values())) / scale)
