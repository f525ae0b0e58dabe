"""Power flow of a motion: stacked powers of all elements, and their energies since the start."""

from typing import Any

import numpy as np

from ..bondgraph._element_powers import ElementPowers
from ..bondgraph._power import BondPowers
from ..checks import place_of
from ..motion._motion import Motion
from ..palette import COLORS
from ..typing import WordedError
from ._canvas import format_axes, get_axes, stack_axes

_SHOWN = {"I": "kinetic", "GR": "kinetic", "C": "springs", "R": "dissipated", "Se": "sources", "Sf": "drives"}
_FAMILIES = ("kinetic", "springs", "dissipated", "sources", "drives", "others")
_HATCHES = (None, "////", "....", "xxxx")
_MAX_ELEMENTS = 11  # elements shown by themselves: as many as colours and hatches can distinguish


def plot_power(
    motion: WordedError[Motion], powers: WordedError[BondPowers], by: str = "element", ax: Any = None
) -> Any:
    """Plot the power [W] that every element feeds into the mechanism, stacked; storing and dissipating is negative.

    Below, the energies [J] that sources and drives fed in since the start and that motion, springs and resistors
    took, by trapezoids over the saved times, and what these miss of the motion's own kinetic energy.

    Args:
        motion: the simulated motion; powers: its `bond_powers`, of any view (gravity is a source).
        by: "element" for the eleven of the largest peaks, the others summed, a family in one colour; or
            "kind" to sum by what they do.
        ax: matplotlib axes to draw into (default: new ones); the energies take the lower part of their room.

    Raises: ValueError for another `by`.
    """
    if by not in ("element", "kind"):
        raise ValueError(f"by must be 'element' or 'kind', not {by!r}")
    ax, below = stack_axes(get_axes(ax, (8.0, 5.2)), (3, 2))
    ts = np.asarray(motion.ts)
    kinds = {e.name: _family(e) for e in powers.graph.elements if e.is_port}
    fed = {name: -np.asarray(power) for name, power in powers.ports().items()}
    by_kind = {}
    for name, power in fed.items():
        by_kind[kinds[name]] = by_kind.get(kinds[name], 0.0) + power
    parts = _largest_parts(fed) if by == "element" else by_kind
    _draw_stack(ax, ts, parts, {name: kinds.get(name, name if name in by_kind else "others") for name in parts})
    format_axes(ax, "", "power fed in [W]", "beside")
    energies = {kind: energy_since_start(ts, power) for kind, power in by_kind.items()}
    for kind, energy in energies.items():
        sign = 1.0 if kind in ("sources", "drives") else -1.0
        below.plot(ts, sign * energy, label=kind, color=COLORS[_FAMILIES.index(kind)])
    gained = np.asarray(motion.diagnostics.kinetic) - np.asarray(motion.diagnostics.kinetic)[0]
    others = sum((energy for kind, energy in energies.items() if kind != "kinetic"), np.zeros_like(ts))
    below.plot(ts, others - gained, label="missing", color="0.2", linestyle=":")
    format_axes(below, "time [s]", "energy [J]", "beside")
    return ax


def plot_element_power(
    motion: WordedError[Motion], powers: WordedError[ElementPowers], element: str, ax: Any = None
) -> Any:
    """Plot the powers [W] of one force element, stacked: its supply upwards, and where it goes downwards.

    Args:
        motion: the simulated motion; powers: its `bondgraph.element_powers`.
        element: name of the force element.
        ax: matplotlib axes to draw into (default: new ones).

    Raises: UnknownNameError for an element that has no powers.
    """
    place_of("force element", element, powers.names)
    ax = get_axes(ax, (8.0, 3.2))
    parts = {"supplied": 1.0, "exchanged": 1.0, "mechanical": -1.0, "stored": -1.0, "dissipated": -1.0}
    shown = {name: sign * np.asarray(getattr(powers, name)[element]) for name, sign in parts.items()}
    families = dict(zip(parts, ("sources", "drives", "kinetic", "springs", "dissipated"), strict=True))
    _draw_stack(ax, np.asarray(motion.ts), shown, families)
    format_axes(ax, "time [s]", f"power of {element} [W]", "beside")
    return ax


def _family(element):
    """Family of a one-port; what is inside of a force element does not hold the mechanism's momentum."""
    if element.kind == "port":
        return "sources"
    return "springs" if element.kind == "I" and element.within else _SHOWN[element.kind]


def energy_since_start(ts, power):
    """Integral of a power (T,) [W] over the times (T,) by trapezoids, (T,) [J]."""
    steps = np.diff(ts) * (power[1:] + power[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


def _largest_parts(parts):
    """The parts with the largest peaks in their order, and the sum of all others."""
    peaks = {name: np.max(np.abs(power)) for name, power in parts.items()}
    most = set(sorted(peaks, key=peaks.get, reverse=True)[:_MAX_ELEMENTS])
    shown = {name: power for name, power in parts.items() if name in most}
    rest = [power for name, power in parts.items() if name not in most]
    return shown | ({f"{len(rest)} others": sum(rest[1:], rest[0])} if rest else {})


def _draw_stack(ax, ts, parts, families):
    """Stack positive parts upwards and negative ones downwards; a family has one colour, its members hatches."""
    top, bottom = np.zeros_like(ts), np.zeros_like(ts)
    least = 1e-9 * max((np.max(np.abs(power)) for power in parts.values()), default=0.0)
    members = dict.fromkeys(_FAMILIES, 0)
    for name, power in sorted(parts.items(), key=lambda part: _FAMILIES.index(families[part[0]])):
        if np.max(np.abs(power)) <= least:
            continue
        family = families[name]
        number, color = members[family], COLORS[_FAMILIES.index(family)]
        members[family] += 1
        hatch, strength = _HATCHES[number % len(_HATCHES)], 0.9 - 0.16 * min(number, 4)
        style = {"facecolor": color, "edgecolor": "white", "hatch": hatch, "alpha": strength, "linewidth": 0}
        up, down = np.maximum(power, 0.0), np.minimum(power, 0.0)
        ax.fill_between(ts, top, top + up, label=name, **style)
        ax.fill_between(ts, bottom, bottom + down, **style)
        top, bottom = top + up, bottom + down
    ax.axhline(0.0, color="0.2", linewidth=0.8)
