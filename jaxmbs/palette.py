"""Colours of all drawings, distinct to colour-blind readers too."""

BLUE, ORANGE, GREEN, VIOLET, RED, GREY = COLORS = ("#1b5a99", "#e0901f", "#35a577", "#b084c4", "#a3352a", "#4d5861")

#: Of parts that belong to no body.
STEEL, DARK, PALE, BRASS = ("#8d99a6", "#3a444e", "#c3ccd4", "#b8863b")
