"""Cards of bulk data: small, large and free fields, with continuations.

The library has its own reader for two reasons.  pyYeti's `rdcards`, which the tests compare it with, loses the fields
after a comment inside a card, accepts any text as a number, follows INCLUDE anywhere and reports no line numbers.
pyNastran, the field's reader of whole models, makes objects of its own of some 400 cards and requires matplotlib and
qtpy among others; what is needed here, numbers as leaves of a pytree, all faults in one report with their lines, and
INCLUDE within one folder, would have to be written around it all the same.
"""

import math
import re
from collections.abc import Iterable, Iterator
from typing import Any

from ...errors import ModelError
from ._text import DeckLine

MAX_FAULTS = 200  # more are not read by anybody
_INTEGER = re.compile(r"[+-]?\d{1,9}", re.ASCII)
_REAL = re.compile(r"([+-]?(?:\d{1,40}\.?\d{0,40}|\.\d{1,40}))(?:[ED]?([+-]?\d{1,4}))?", re.ASCII | re.IGNORECASE)
_STEP = re.compile(r"\*\(?([^()]{1,40})\)?")
_REPEAT = re.compile(r"=\(?(\d{0,6})\)?")
_EQUATION = re.compile(r"DEQATN\b", re.IGNORECASE)
REQUIRED: Any = object()


class Card:
    """One card: `fields[0]` is its name, `fields[k]` the k-th datum, eight to a row.

    The methods return the value of a field, its default if it is blank, and a default with a fault if it is wrong, so
    that all faults of a deck are found at once.
    """

    def __init__(self, name: str, place: str, faults: list[str]) -> None:
        self.fields, self.place, self.faults = [name], place, faults

    @property
    def name(self) -> str:
        return self.fields[0]

    def __len__(self) -> int:
        """Number of the last datum that is not blank."""
        return max((k for k, text in enumerate(self.fields) if text), default=0)

    def text(self, k: int) -> str:
        """The datum as text, "" if it is blank."""
        return self.fields[k] if k < len(self.fields) else ""

    def fault(self, message: str) -> None:
        """Report a fault: "CBAR 7 (frame.bdf:12): ..."."""
        if len(self.faults) >= MAX_FAULTS:
            raise ModelError([*self.faults, f"there are more faults; these are the first {MAX_FAULTS}"])
        self.faults.append(f"{self.name} {self.text(1)[:16]} ({self.place}): {message}".replace("  ", " "))

    def integer(self, k: int, name: str, default: Any = REQUIRED, low: int = 1) -> Any:
        """A whole number, at least `low`."""
        text = self.text(k)
        if not text:
            return self._blank(name, default, low)
        if not _INTEGER.fullmatch(text) or int(text) < low:
            self.fault(f"{name} must be a whole number from {low} on, got {text[:32]!r}")
            return low if default is REQUIRED else default
        return int(text)

    def real(self, k: int, name: str, default: Any = REQUIRED) -> Any:
        """A number; whole ones count, and `1.2-3` is 1.2e-3."""
        text = self.text(k)
        if not text:
            return self._blank(name, default, 1.0)
        found = _REAL.fullmatch(text)
        value = float(f"{found[1]}e{found[2] or 0}") if found else math.nan
        if not math.isfinite(value):
            self.fault(f"{name} must be a finite number, got {text[:32]!r}")
            return 1.0 if default is REQUIRED else default
        return value

    def reals(self, first: int, count: int, name: str, default: Any = 0.0) -> list[float]:
        """Numbers of consecutive fields."""
        return [self.real(k, f"{name}{k - first + 1}", default) for k in range(first, first + count)]

    def directions(self, k: int, name: str, default: str | None = None) -> tuple[int, ...]:
        """Components "1" to "6", without repetition, as 0 to 5."""
        text = self.text(k) or default
        if text is None or not re.fullmatch("[1-6]{1,6}", text) or len(set(text)) < len(text):
            if text != "":
                self.fault(f"{name} must be some of the digits 1 to 6, got {(text or '')!r}")
            return ()
        return tuple(sorted(int(digit) - 1 for digit in text))

    def refuse_fields(self, what: str, *fields: int, harmless: tuple = (0.0,)) -> None:
        """Report fields whose content is not supported."""
        for k in fields:
            text = self.text(k)
            value = _REAL.fullmatch(text)
            if text and text not in harmless and not (value and float(f"{value[1]}e{value[2] or 0}") in harmless):
                self.fault(f"{what} {text[:16]!r} is not supported")

    def identifiers(self, first: int, name: str, low: int = 1, last: int | None = None) -> list[range]:
        """Identifiers to the end of the card (or to `last`), `5 THRU 8` among them, as ranges."""
        found, k, end = [], first, min(len(self), last or len(self))
        while k <= end:
            if not self.text(k):
                k += 1
                continue
            one = self.integer(k, name, low=low)
            if self.text(k + 1).upper() == "THRU":
                found.append(range(one, self.integer(k + 2, name) + 1))
                if not found[-1]:
                    self.fault(f"{name} {one} THRU {self.text(k + 2)[:16]} runs backwards")
                k += 3
            else:
                found.append(range(one, one + 1))
                k += 1
        if not found:
            self.fault(f"{name} is missing")
        return found

    def _blank(self, name, default, stand_in):
        if default is not REQUIRED:
            return default
        self.fault(f"{name} is missing")
        return stand_in


def require_positive(card: Card, nonnegative: dict[str, float], **numbers: float) -> None:
    """Report numbers that are not positive, or negative ones among `nonnegative`."""
    for name, value in numbers.items():
        if not value > 0:
            card.fault(f"{name} must be positive")
    for name, value in nonnegative.items():
        if value < 0:
            card.fault(f"{name} must not be negative")


def parse_cards(lines: Iterable[DeckLine], faults: list[str]) -> Iterator[Card]:
    """Cards in the order of the deck, to ENDDATA."""
    card, label, steps = None, "", []
    awaited: set[str] = set()  # labels of cards that go on, but not on the next line
    for text, place in lines:
        if _EQUATION.match(text):  # its text is no fields, which goes on in lines that begin with a blank or a mark
            if card is not None:
                yield card
            card, label = Card("DEQATN", place, faults), ""
            card.fields.append(text[8:16].strip(" ,"))
            continue
        if card is not None and card.name == "DEQATN" and text[0] in " +*\t,":
            continue
        first, data, tail, row = _split_fields(text)
        if card is not None and (repeat := _REPEAT.fullmatch(first)):
            steps = steps if repeat[1] else [*data, *tail]
            for _ in range(int(repeat[1] or 1)):
                yield card
                card, label = _replica(card, steps, place, faults), ""
            continue
        if not first or first[0] in "+*":
            if card is None:
                Card("", place, faults).fault("a continuation line without a card")
                continue
            if first[1:] and label != first[1:] and (label or first[1:] in awaited):
                end = f", which ends in {label!r}" if label else ""
                card.fault(f"the continuation {first!r} at {place} does not follow its card{end}")
        else:
            awaited |= {label} - {""}
            if card is not None:
                yield card
            name = first.rstrip("*").rstrip().upper()
            if name == "ENDDATA":
                return
            card = Card(name, place, faults)
            if not re.fullmatch(r"[A-Z][A-Z0-9]{0,7}", name):
                card.fault("there is no card before it to repeat" if name[:1] == "=" else "invalid card name")
        if row == 8 and (len(card.fields) - 1) % 8:
            card.fields += [""] * 4
        label = ""
        if tail and (not tail[0] or tail[0][0] in "+*" or "," not in text):  # the tenth field
            label, tail = tail[0][1:] if tail[0][:1] in ("+", "*") else "", tail[1:]
            if any(tail):
                card.fault(f"{place} has data after its tenth field")
            tail = []
        data += tail  # a long line of free fields goes on without an end of line
        card.fields += data + [""] * (-len(data) % row if data else row)
    if card is not None:
        yield card


def _replica(card, steps, place, faults):
    """The card again: `=` keeps a field, `==` all that follow, `*(5)` adds to it; other fields are as they are."""
    made = Card(card.name, place, faults)
    keep = steps.index("==") if "==" in steps else len(steps)
    for k, step in enumerate(steps[:keep], start=1):
        given = _STEP.fullmatch(step)
        made.fields.append(card.text(k) if step == "=" else _plus(made, card.text(k), given[1]) if given else step)
    made.fields += card.fields[keep + 1 :] if keep < len(steps) else []
    if not steps or len(card) > 8:
        made.fault("cards of one line are repeated, by a line that says how")
    return made


def _plus(card, text, step):
    """The sum of two fields as text."""
    if _INTEGER.fullmatch(text or "0") and _INTEGER.fullmatch(step):
        return str(int(text or 0) + int(step))
    one, other = Card(card.name, card.place, card.faults), Card(card.name, card.place, card.faults)
    one.fields.append(text)
    other.fields.append(step)
    return repr(one.real(1, "a repeated field", 0.0) + other.real(1, "a step"))


def _split_fields(text):
    """First field, data, what stands after them, and how many data a row of this form has."""
    if "," in text:
        parts = [part.strip() for part in text.split(",")]
        row = 4 if "*" in parts[0] else 8
        return parts[0], parts[1 : 1 + row], parts[1 + row :], row
    row = 4 if "*" in text[:8] else 8
    width = 64 // row
    data = [text[k : k + width].strip() for k in range(8, min(len(text), 72), width)]
    return text[:8].strip(), data, [text[72:80].strip()] if text[72:80].strip() else [], row
