"""The colours of all drawings."""

BLUE, ORANGE, GREEN, VIOLET, RED, GREY = COLORS = ("#1f5f8b", "#c7752b", "#3f8f5b", "#7a4d8f", "#b0413e", "#5b6770")
