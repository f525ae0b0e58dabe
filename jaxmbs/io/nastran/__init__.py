"""Nastran bulk data: text to cards, cards to groups of elements, supports and ties, these to a `Deck`."""

from ._deck import Deck
from ._read_nastran import read_nastran

__all__ = ["Deck", "read_nastran"]
