"""What the cards of a deck refer to while it is read: nodes, coordinate systems, materials, properties."""

from functools import lru_cache
from typing import Any

import numpy as np

from .cards import Card
from .frames import Frame, frames_of, known_frame, place
from .properties import READ


class Context:
    """Nodes and properties by number, as far as the cards are right.

    Attributes:
        ids: numbers of the GRIDs in ascending order; `index` gives their places.
        positions: (nodes, 3) in basic axes; `turned[node]` is the number of its displacement frame, 0 the basic one.
        frames: coordinate systems by number.
        materials, properties: by name, "MAT1 3", "PBAR 100".
        held: (node, direction) of the permanent constraints on GRIDs.
        notes: what is read over, in words, with the number of times.
        polar: whether CBARs have inertia about their own axis.
    """

    def __init__(self, found: dict[str, list[Card]], polar: bool) -> None:
        self.notes: dict[str, int] = {}
        self.polar = polar
        default = _default(found)
        grids = {}
        for card in found.get("GRID", ()):
            one, frame = card.integer(1, "ID"), card.integer(2, "CP", default[0], low=0)
            if one in grids and grids[one][0].fields != card.fields:
                card.fault("this node stands here a second time, otherwise")
            grids[one] = card, frame, card.reals(3, 3, "X")
        self.frames = frames_of(found, grids)
        self.ids = sorted(grids)
        self.index = {one: k for k, one in enumerate(self.ids)}
        self.positions = np.array([self._place(*grids[one]) for one in self.ids]).reshape(-1, 3)
        self.turned = [self._turned(grids[one][0], default[1]) for one in self.ids]
        self.held = {(k, d) for k, one in enumerate(self.ids) for d in (_permanent(grids[one][0]) or default[2])}
        self.axes = lru_cache(maxsize=None)(self._axes)
        self.materials: dict[str, Any] = {}
        self.properties: dict[str, Any] = {}
        cards_of: dict[str, Card] = {}
        for kind, read in READ.items():
            for card in found.get(kind, ()):
                name = f"{kind} {card.integer(1, 'ID')}"
                if name in cards_of and cards_of[name].fields != card.fields:
                    card.fault("this number stands here a second time, otherwise")
                (self.materials if kind == "MAT1" else self.properties)[name] = read(card, self.note)
                cards_of[name] = card
        for name, owner in self.properties.items():
            if getattr(owner, "material", None) not in {None, *self.materials}:
                cards_of[name].fault(f"there is no {owner.material}")

    def note(self, what: str) -> None:
        """Something that is read over."""
        self.notes[what] = self.notes.get(what, 0) + 1

    def node(self, card: Card, k: int, name: str) -> int:
        """Place of the GRID that a field names; 0, and a fault, where there is none."""
        return self.known(card, card.integer(k, name))

    def known(self, card: Card, one: int) -> int:
        """Place of a GRID by its number; 0, and a fault, where there is none."""
        if one not in self.index:
            card.fault(f"there is no GRID {one}")
        return self.index.get(one, 0)

    def nodes(self, card: Card, ranges: list[range]) -> list[int]:
        """Places of GRIDs in ranges of numbers; of a `THRU` those that there are."""
        found = []
        for numbers in ranges:
            if len(numbers) == 1:
                found.append(self.known(card, numbers[0]))
            else:
                low, high = np.searchsorted(self.ids, [numbers.start, numbers.stop])
                found.extend(range(int(low), int(high)))
        return found

    def owner(self, card: Card, *kinds: str) -> str:
        """Name of the property that an element has, of one of these kinds; by default it has the element's number."""
        one = card.integer(2, "PID", card.integer(1, "EID"))
        names = [f"{kind} {one}" for kind in kinds]
        found = next((name for name in names if name in self.properties), None)
        if found is None:
            card.fault(f"there is no {' or '.join(names)}")
        return found or ""

    def frame(self, card: Card, one: int) -> Frame:
        """A coordinate system by its number."""
        return known_frame(one, self.frames, card)

    def _axes(self, node: int) -> np.ndarray:
        return self.frames.get(self.turned[node], self.frames[0]).at(self.positions[node], np)

    def _place(self, card, frame, given):
        found = place(known_frame(frame, self.frames, card), given)
        if not np.all(np.isfinite(found)):
            card.fault("its position is not finite")
        return found

    def _turned(self, card, default):
        one = card.integer(6, "CD", default, low=-1)
        if one == -1:
            card.fault("CD = -1, a fluid's node, is not read")
            return 0
        known_frame(one, self.frames, card)
        return one if one in self.frames else 0


def _default(found):
    """CP, CD and PS of GRDSET."""
    cards = found.get("GRDSET", [])
    for card in cards[1:]:
        card.fault("GRDSET stands here a second time")
    if not cards:
        return 0, 0, ()
    card = cards[0]
    return card.integer(2, "CP", 0, low=0), card.integer(6, "CD", 0, low=0), card.directions(7, "PS", "")


def _permanent(card):
    return card.directions(7, "PS", "") if card.text(7) != "0" else ()
