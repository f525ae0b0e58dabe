"""Decks give Nastran's own answers; cards are read as pyNastran and pyYeti do; the rest is named."""
