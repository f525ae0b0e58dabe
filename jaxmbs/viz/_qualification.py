"""Plots of qualification: spectra with their RMS, shock spectra, S-N curves with cycles, notched inputs,
margins."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..fatigue._cycles import Cycles
from ..fatigue._psd import STANDARD_GRAVITY
from ..fatigue._sn import SN
from ..palette import COLORS
from ..qualification._load_cases import Envelope
from ..qualification._random_response import RandomResponse
from ..qualification._shock_spectrum import ShockSpectrum
from ..qualification._sine_response import SineResponse
from ..typing import ArrayLike
from ._canvas import curve_style, format_axes, format_log_axis, get_axes, stack_axes

_LINE = {"color": "0.75", "linewidth": 0.6, "zorder": 0.5}


def plot_psd(
    response: RandomResponse,
    frequencies: ArrayLike,
    names: Iterable[str] | None = None,
    ax: Any = None,
    *,
    unit: str | None = None,
) -> Any:
    """Plot power spectral densities of outputs, RMS in the legend, and the cumulative RMS below them.

    Args:
        frequencies: (frequencies,) [Hz] to draw at.
        names: of outputs, default all; ax: matplotlib axes to draw into (default: new ones), the upper ones then.
        unit: of the outputs, for labels (default: that of each, as far as it is known).

    Raises: UnknownNameError.
    """
    names = response.names if names is None else tuple(names)
    places = [response.place(name) for name in names]
    f, rms = np.asarray(frequencies, float), np.asarray(response.rms)
    density, below = np.asarray(response.psd(f)), np.asarray(response.cumulative_rms(f))
    units = [response.units[place] if unit is None else unit for place in places]
    unit = units[0] if len(set(units)) == 1 and units[0] else "unit"
    rooms = stack_axes(get_axes(ax, (7.0, 4.8)), (3, 2))
    for k, (name, place) in enumerate(zip(names, places, strict=True)):
        rooms[0].loglog(
            f, density[:, place], label=f"{name}: RMS {rms[place]:.3g} {units[k]}".strip(), **curve_style(k)
        )
        rooms[1].semilogx(f, below[:, place], **curve_style(k))
    rooms[1].set_ylim(bottom=0.0)
    format_axes(rooms[0], "", f"PSD [{unit if unit.isalpha() else f'({unit})'}$^2$/Hz]", "beside")
    format_axes(rooms[1], "frequency [Hz]", f"cumulative RMS [{unit}]", None)
    return rooms[0]


def plot_shock_spectrum(spectrum: ShockSpectrum, ax: Any = None, *, gravity: float = STANDARD_GRAVITY) -> Any:
    """Plot a shock spectrum on four-coordinate paper: pseudo velocity, and lines of equal displacement and
    acceleration.

    Args:
        spectrum: of any kind, of a signal in m/s^2.
        ax: matplotlib axes to draw into (default: new ones).
        gravity: acceleration [m/s^2] of one g on the lines; 1 for lines in m/s^2 of a signal in g.
    """
    f = np.asarray(spectrum.frequencies)
    w = 2 * np.pi * f
    factor = {"absolute acceleration": 1 / w, "relative displacement": w, "pseudo velocity": np.ones_like(w)}
    ax = get_axes(ax, (5.8, 5.0))
    curves = {"maximax": spectrum.maximax, "primary": spectrum.primary, "residual": spectrum.residual}
    drawn = [np.asarray(values) * factor[spectrum.kind] for values in curves.values()]
    for k, (name, values) in enumerate(zip(curves, drawn, strict=True)):
        style = {"linewidth": 2.2} if k == 0 else {"linestyle": "--"}
        ax.loglog(f, np.where(values > 0, values, np.nan), label=name, **{**curve_style(k), **style})
    positive = np.concatenate([values[values > 0] for values in drawn])
    top = 3.0 * positive.max() if positive.size else 1.0
    ax.set_xlim(f.min(), f.max() if f.max() > f.min() else 2 * f.min())
    ax.set_ylim(max(positive.min() if positive.size else 0.1, top / 3e3) / 2, top)
    _draw_lines(ax, 2 * np.pi, 1.0, "m")
    _draw_lines(ax, gravity / (2 * np.pi), -1.0, "g")
    return format_axes(ax, "natural frequency [Hz]", "pseudo velocity [m/s]")


def _draw_lines(ax, scale, power, unit):
    """Lines `v = value scale f^power` for powers of ten, each named where it leaves the paper."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    ends = np.array([left, right])
    values = np.array([y / (scale * x**power) for x in ends for y in (bottom, top)])
    for exponent in range(int(np.ceil(np.log10(values.min()))), int(np.floor(np.log10(values.max()))) + 1):
        value = 10.0**exponent
        ax.plot(ends, value * scale * ends**power, **_LINE)
        edge = top / 1.25
        x = (edge / (value * scale)) ** (1 / power)
        if left * 1.05 < x < right / 1.35:
            ax.text(x, edge, f"$10^{{{exponent}}}$ {unit}", fontsize="x-small", color="0.45", ha="left", va="top")


def plot_sn(sn: SN, cycles: Cycles, ax: Any = None, *, unit: str = "MPa") -> Any:
    """Plot an S-N curve and the cycles of a history: how many have at least each amplitude.

    Args: ax: matplotlib axes to draw into (default: new ones); unit: of the stress, for labels.
    """
    counts, amplitudes = np.asarray(cycles.counts), np.asarray(cycles.amplitudes)
    kept = (counts > 0) & (amplitudes > 0)
    order = np.argsort(-amplitudes[kept])
    stress, number = amplitudes[kept][order], np.cumsum(counts[kept][order])
    ax = get_axes(ax)
    low, high = (stress.min(), stress.max()) if stress.size else (1.0, 10.0)
    line = np.geomspace(max(low, high / 50) / 2, 5 * high, 400)
    life = np.asarray(sn.cycles(line))
    ax.loglog(np.where(np.isfinite(life), life, np.nan), line, label="S-N curve", **curve_style(0))
    ax.step(number, stress, where="pre", label="cycles of the history", **curve_style(1))
    ax.set_ylim(bottom=line[0])
    return format_axes(ax, "number of cycles", f"stress amplitude [{unit}]")


def plot_rainflow_matrix(cycles: Cycles, bins: int = 24, ax: Any = None, *, unit: str = "MPa") -> Any:
    """Plot the rainflow matrix: number of cycles by range and mean as coloured squares.

    Args: ax: matplotlib axes to draw into (default: new ones); unit: of the history, for labels.

    Raises: ValueError for a history without cycles.
    """
    counts = np.asarray(cycles.counts)
    kept = counts > 0
    if not np.any(kept):
        raise ValueError("the history has no cycles to plot")
    mean, size = np.asarray(cycles.means)[kept], np.asarray(cycles.ranges)[kept]
    found, means, ranges = np.histogram2d(mean, size, bins, weights=counts[kept])
    ax = get_axes(ax, (5.4, 4.2))
    shown = ax.pcolormesh(means, ranges, np.where(found > 0, found, np.nan).T, cmap="Blues", norm="log")
    bar = ax.figure.colorbar(shown, ax=ax, label="cycles")
    format_log_axis(bar.ax.yaxis)
    return format_axes(ax, f"mean [{unit}]", f"range [{unit}]", None)


def plot_notches(response: SineResponse, ax: Any = None, *, unit: str = "m/s$^2$") -> Any:
    """Plot the specified and the notched input of a sine test; each limit's notches have a colour of their own.

    Args: ax: matplotlib axes to draw into (default: new ones); unit: of the input, for labels.
    """
    f, level, rest, limiting = (
        np.asarray(a) for a in (response.frequencies, response.levels, response.input, response.limiting)
    )
    ax = get_axes(ax)
    ax.loglog(f, level, color="0.5", linestyle="--", label="specified")
    ax.loglog(f, rest, label="input", **curve_style(0))
    for k, number in enumerate(number for number in np.unique(limiting) if number >= 0):
        own = np.where(limiting == number, rest, np.nan)
        style = {**curve_style(k + 1), "linewidth": 2.4}
        ax.loglog(f, own, label=f"limit of {response.limits[number]}", **style)
    return format_axes(ax, "frequency [Hz]", f"amplitude [{unit}]")


def plot_margins(envelope: Envelope, allowed: ArrayLike, most: int = 20, ax: Any = None) -> Any:
    """Plot margins of safety of the components of an envelope as bars, the least on top, each with its load case.

    Args:
        allowed: load that each component may have, one or (components,).
        most: number of bars; components with larger margins are left out.
        ax: matplotlib axes to draw into (default: new ones).
    """
    margins = np.asarray(envelope.margins(allowed))
    is_high = np.abs(np.asarray(envelope.highest)) >= np.abs(np.asarray(envelope.lowest))
    cases = np.where(is_high, np.asarray(envelope.case_highest), np.asarray(envelope.case_lowest))
    order = np.argsort(margins)[:most]
    ax = get_axes(ax, (6.4, 1.2 + 0.3 * len(order)))
    ax.barh(np.arange(len(order)), margins[order], color=[COLORS[cases[k] % len(COLORS)] for k in order], height=0.7)
    for place, k in enumerate(order):
        side, gap = ("left", 3) if margins[k] >= 0 else ("right", -3)
        text = f"{margins[k]:.2f}  {envelope.cases[cases[k]]}"
        style = {"textcoords": "offset points", "ha": side, "va": "center", "fontsize": "small"}
        ax.annotate(text, (margins[k], place), (gap, 0), **style)
    ax.axvline(0.0, color="0.3", linewidth=0.8)
    ax.set_yticks(np.arange(len(order)), [envelope.names[k] for k in order])
    ax.invert_yaxis()
    ax.margins(x=0.35)
    return format_axes(ax, "margin of safety", "", None)
