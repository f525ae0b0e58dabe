"""The colours of all drawings, apart to colour-blind eyes too."""

BLUE, ORANGE, GREEN, VIOLET, RED, GREY = COLORS = ("#1b5a99", "#e0901f", "#35a577", "#b084c4", "#a3352a", "#4d5861")
