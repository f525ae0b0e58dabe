"""Colours of all drawings, distinct to colour-blind readers too."""

BLUE, ORANGE, GREEN, VIOLET, RED, GREY = COLORS = ("#1b5a99", "#e0901f", "#35a577", "#b084c4", "#a3352a", "#4d5861")
