"""Context of a deck while it is read: nodes, coordinate systems, materials, properties."""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ._cards import REQUIRED, Card
from ._coordinate_systems import CoordinateSystem, find_system, read_coordinate_systems, to_basic
from ._ignored_cards import HARMLESS

CardReaders = dict[str, Callable[[Card, "DeckContext"], Any]]


class DeckContext:
    """Nodes and properties by number, as far as the cards are right.

    Attributes:
        ids: numbers of the GRIDs in ascending order; `index` gives their places.
        positions: (nodes, 3) in basic axes; `turned[node]` is the number of its displacement frame, 0 the basic one.
        scalars: places of the scalar points, which stand at the origin and have direction 1 alone.
        frames: coordinate systems by number.
        materials, properties: by name, "MAT1 3", "PBAR 100".
        held: (node, direction) of the permanent constraints on GRIDs.
        notes, remarks: what is read over, and what was decided about it, in words, with the number of times.
        polar: whether CBARs have inertia about their own axis.
        drilling: modulus of the drilling rotation of CQUAD4 and CTRIA3 over the shear modulus, by PARAM K6ROT.
        bars_only: materials whose E and G make no Poisson's ratio between -1 and 1/2.
    """

    def __init__(self, found: dict[str, list[Card]], polar: bool) -> None:
        self.notes: dict[str, int] = {}
        self.remarks: dict[str, int] = {}
        self.polar = polar
        self.drilling = _drilling(found)
        default = _read_grdset(found)
        grids = {}
        for card in found.get("GRID", ()):
            one, frame = card.integer(1, "ID"), card.integer(2, "CP", default[0], low=0)
            if one in grids and grids[one][0].fields != card.fields:
                card.fault("duplicate node with different data")
            grids[one] = card, frame, card.reals(3, 3, "X")
        self.frames = read_coordinate_systems(found, grids)
        points = scalar_points(found)
        for one in points & grids.keys():
            grids[one][0].fault("a scalar point has the same number")
        grids |= {one: (Card("SPOINT", "", []), 0, [0.0] * 3) for one in points - grids.keys()}
        self.ids = sorted(grids)
        self.index = {one: k for k, one in enumerate(self.ids)}
        self.positions = np.array([self._place(*grids[one]) for one in self.ids]).reshape(-1, 3)
        self.scalars = {k for k, one in enumerate(self.ids) if one in points}
        self.turned = [
            self._turned(grids[one][0], 0 if k in self.scalars else default[1]) for k, one in enumerate(self.ids)
        ]
        self.held = {
            (k, d)
            for k, one in enumerate(self.ids)
            for d in (range(1, 6) if k in self.scalars else _permanent(grids[one][0]) or default[2])
        }
        self.axes = lru_cache(maxsize=None)(self._axes)
        self.materials: dict[str, Any] = {}
        self.properties: dict[str, Any] = {}
        self.bars_only: set[str] = set()
        self._found = found
        self._missing: set[str] = set()

    def read_numbers(self, materials: CardReaders, properties: CardReaders) -> None:
        """Read all materials, then the properties, which refer to them."""
        read = {*materials, *properties, *HARMLESS}
        refused = {name for name in self._found if name.startswith(("P", "MAT")) and name not in read}
        refused = {name for name in refused if not name.startswith(("PARAM", "PLOAD", "PLOT"))}
        self._unread = {card.text(1) for name in refused for card in self._found[name]}  # are told by themselves
        for into, readers in ((self.materials, materials), (self.properties, properties)):
            first: dict[str, Card] = {}
            for kind, make in readers.items():
                for card in self._found.get(kind, ()):
                    name = f"{kind} {card.integer(1, 'ID')}"
                    if first.setdefault(name, card).fields != card.fields:
                        card.fault("duplicate number with different data")
                    into[name] = make(card, self)

    def material(
        self, card: Card, k: int, name: str, kinds: tuple[str, ...] = ("MAT1",), default: Any = REQUIRED
    ) -> str:
        """Name of the material that a field refers to, "MAT1 3"; a fault where there is none of these kinds."""
        one = card.integer(k, name, default, low=1 if default is REQUIRED else -1)
        if not card.text(k) or one == -1:
            return "" if default is REQUIRED else default
        names = [f"{kind} {one}" for kind in kinds]
        found = self._one_of(card, [name for name in names if name in self.materials])
        if found in self.bars_only and card.name[1] in "SC":
            card.fault(f"E and G of {found} make a Poisson's ratio that does not lie between -1 and 1/2")
        if found is None and str(one) not in self._unread:
            card.fault(f"there is no {' or '.join(names)}")
        return found or names[0]

    def note(self, what: str) -> None:
        """Note something that is ignored."""
        self.notes[what] = self.notes.get(what, 0) + 1

    def remark(self, what: str) -> None:
        """Note an assumption."""
        self.remarks[what] = self.remarks.get(what, 0) + 1

    def remark_once(self, what: str) -> None:
        """Note an assumption about one card."""
        self.remarks[what] = 1

    def directions(self, card: Card, k: int, name: str, node: int) -> tuple[int, ...]:
        """Components of a GRID, or the one of a scalar point, which is 0, 1 or blank."""
        if node in self.scalars and card.text(k) in ("", "0", "1"):
            return (0,)
        return card.directions(k, name)

    def node(self, card: Card, k: int, name: str) -> int:
        """Place of the GRID that a field names; 0, and a fault, where there is none."""
        return self.place_of_node(card, card.integer(k, name))

    def place_of_node(self, card: Card, one: int) -> int:
        """Place of a GRID by its number; 0, and a fault, where there is none."""
        if one not in self.index:
            card.fault(f"there is no GRID {one}")
        return self.index.get(one, 0)

    def nodes(self, card: Card, ranges: list[range]) -> list[int]:
        """Places of GRIDs in ranges of numbers; of a `THRU` those that there are."""
        found = []
        for numbers in ranges:
            if len(numbers) == 1:
                found.append(self.place_of_node(card, numbers[0]))
            else:
                low, high = np.searchsorted(self.ids, [numbers.start, numbers.stop])
                found.extend(range(int(low), int(high)))
        return found

    def owner(self, card: Card, *kinds: str) -> str:
        """Name of the property that an element has, of one of these kinds; by default it has the element's number."""
        one = card.integer(2, "PID", card.integer(1, "EID"))
        names = [f"{kind} {one}" for kind in kinds]
        found = self._one_of(card, [name for name in names if name in self.properties])
        if found is None and str(one) not in self._unread and names[0] not in self._missing:
            others = [name for name in self.properties if name.split()[1] == str(one)]
            self._missing.add(names[0])  # its other elements would say the same
            card.fault(f"there is no {' or '.join(names)}{f', but a {others[0]}' if others else ''}")
        return found or ""

    def frame(self, card: Card, one: int) -> CoordinateSystem:
        """A coordinate system by its number."""
        return find_system(one, self.frames, card)

    def _one_of(self, card, names):
        """The only one of them, None where there is none; a fault, once, where a number names several."""
        if len(names) > 1 and names[1] not in self._missing:
            self._missing.add(names[1])
            card.fault(f"{' and '.join(names)} have the same number")
        return names[0] if names else None

    def _axes(self, node: int) -> np.ndarray:
        return self.frames.get(self.turned[node], self.frames[0]).at(self.positions[node], np)

    def _place(self, card, frame, given):
        found = to_basic(find_system(frame, self.frames, card), given)
        if not np.all(np.isfinite(found)):
            card.fault("its position is not finite")
        return found

    def _turned(self, card, default):
        one = card.integer(6, "CD", default, low=-1)
        if one == -1:
            card.fault("fluid nodes (CD = -1) are not supported")
            return 0
        find_system(one, self.frames, card)
        return one if one in self.frames else 0


def scalar_points(found: dict[str, list[Card]]) -> set[int]:
    """Numbers of SPOINT, and of what the third and fourth forms of scalar elements join."""
    points = {one for card in found.get("SPOINT", ()) for part in card.identifiers(1, "ID") for one in part}
    for kind in ("CELAS", "CMASS", "CDAMP"):
        for card in (*found.get(f"{kind}3", ()), *found.get(f"{kind}4", ())):
            points |= {card.integer(k, "S") for k in (3, 4) if card.text(k) not in ("", "0")}
    return points


#: How many data each of several entries on one card has.
_SHARED = {"PVISC": 4, "PELAS": 4, "PMASS": 2, "PDAMP": 2} | {
    f"{kind}{form}": 4 for kind in ("CELAS", "CMASS", "CDAMP") for form in "34"
}


def split_shared_cards(found: dict[str, list[Card]]) -> None:
    """Split cards that hold several entries."""
    for name, width in _SHARED.items():
        made = []
        for card in found.get(name, ()):
            starts = [k for k in range(1, max(len(card), 1) + 1, width) if k == 1 or card.text(k)]
            for start in starts:
                one = Card(name, card.place, card.faults)
                one.fields += card.fields[start : start + width]
                made.append(one)
        if made:
            found[name] = made


def default_cards(found: dict[str, list[Card]]) -> None:
    """Fill blank fields of bars and beams from BAROR and BEAMOR."""
    for name, kind in (("BAROR", "CBAR"), ("BEAMOR", "CBEAM")):
        own = found.get(name, [])
        for card in own[1:]:
            card.fault(f"duplicate {name}")
        for card in found.get(kind, ()) if own else ():
            whole = card.fields + [""] * (9 - len(card.fields))
            given = (2,), (5, 6, 7), (8,)  # PID, the vector as a whole, OFFT
            for fields in given:
                if not any(whole[k] for k in fields):
                    for k in fields:
                        whole[k] = own[0].text(k)
            card.fields = whole


def _drilling(found):
    """PARAM K6ROT, 100 unless given, as a modulus over the shear modulus; of 0 what is next to nothing.

    The Quick Reference Guide of MSC Nastran has 1e-6 and an integral over the element; the matrices that NX Nastran
    2412 wrote for a deck of pyNastran have the whole area at each corner, which is 4e-6 over all.
    """
    given = [card.real(2, "K6ROT") for card in found.get("PARAM", ()) if card.text(1).upper() == "K6ROT"]
    return 4e-6 * max([100.0, *given][-1], 0.01)


def _read_grdset(found):
    """CP, CD and PS of GRDSET."""
    cards = found.get("GRDSET", [])
    for card in cards[1:]:
        card.fault("duplicate GRDSET")
    if not cards:
        return 0, 0, ()
    card = cards[0]
    return card.integer(2, "CP", 0, low=0), card.integer(6, "CD", 0, low=0), card.directions(7, "PS", "")


def _permanent(card):
    return card.directions(7, "PS", "") if card.text(7) != "0" else ()
