"""Items of elements between two points that move: springs, dampers, cylinders, bushings and rods."""

import numpy as np

from ...palette import BRASS, COLORS, DARK, PALE, STEEL

_BARREL = 0.62  # of the largest length, unless the rod has to go in further
_WHOLE = (0.0, 1.0)
_SHORT = 1.5  # in bar radii: shorter ones are hidden in the bars, and a bushing becomes a ball

#: Solid, colour, thickness in bar radii, and its part of the span.
_PARTS = {
    "spring": [("coil", BRASS, 1.25, "whole")],
    "damper": [("cylinder", STEEL, 0.8, "barrel"), ("cylinder", PALE, 0.3, "rod")],
    "maxwell": [
        ("coil", BRASS, 1.25, "first half"),
        ("cylinder", STEEL, 0.8, "second barrel"),
        ("cylinder", PALE, 0.3, "second rod"),
    ],
    "actuator": [("cylinder", COLORS[1], 0.9, "barrel"), ("cylinder", PALE, 0.4, "rod")],
    "cylinder": [("cylinder", STEEL, 1.15, "barrel"), ("cylinder", PALE, 0.5, "rod")],
    "bushing": [("cylinder", DARK, 1.2, "whole")],
    "rod": [("cylinder", STEEL, 0.5, "whole")],
    "beam": [("cylinder", STEEL, 1.0, "whole")],
}


def span_items(kind: str, lengths: np.ndarray, radius: float, cylinder: int, coil) -> list[dict]:
    """Solid, thickness and place along a span of all its parts; a barrel and a rod keep their lengths.

    Args:
        kind: one of `drawings.SYMBOLS`; lengths: (T,) of the span [m]; radius: of bars [m].
        cylinder: number of the unit cylinder; coil: the number of a coil of a length and a radius.
    """
    least, most = float(np.min(lengths)), float(np.max(lengths))
    barrel = min(0.9 * least, _BARREL * most)
    places: dict[str, dict] = {
        "whole": {"part": _WHOLE},
        "first half": {"part": (0.0, 0.5)},
        "second barrel": {"part": (0.5, 0.8)},
        "second rod": {"part": (0.7, 1.0)},
        "barrel": {"part": (0.0, 0.62), "rigid": barrel},
        "rod": {"part": (0.4, 1.0), "rigid": min(most - 0.85 * barrel, least)},
    }
    found = []
    for solid, color, thick, place in _PARTS[kind]:
        number = cylinder if solid == "cylinder" else coil(most, thick * radius)
        found.append({"solid": number, "radius": thick * radius, "color": color, **places[place]})
    return found


def is_hidden(kind: str, lengths: np.ndarray, radius: float) -> bool:
    """True for a bushing between points that nearly coincide."""
    return kind == "bushing" and float(np.max(lengths)) < _SHORT * radius
