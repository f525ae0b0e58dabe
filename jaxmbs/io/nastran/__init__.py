"""Nastran bulk data: text to cards, cards to groups of elements, supports and ties, these to a `Deck`."""

from .deck import Deck
from .reading import read_nastran

__all__ = ["Deck", "read_nastran"]
