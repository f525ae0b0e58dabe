"""Axes of all plots in one style: distinct curves, labelled at their ends."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..palette import COLORS

_DASHES: tuple[Any, ...] = ("-", (0, (5, 1.6)), (0, (1.2, 1.2)), (0, (5, 1.2, 1.2, 1.2)))
_MOST_INSIDE = 6  # names that a legend within the axes may hold
_MOST_AT_ENDS = 7  # curves that are named where they end
_FEW_DECADES = 2.5  # of a logarithmic axis, between which there are numbers
_ROOM = {"x": 0.42, "y": 0.2}  # for a number along an axis [inch]
_COINCIDENT = 3e-3  # of the height of the axes: about a line's width, nearer curves hide one another


def get_axes(ax=None, size=None, **options):
    """The axes given, or new ones in a figure of this size [inch]; matplotlib is imported here and not before.

    Raises: ModuleNotFoundError without matplotlib; it is in the extra `viz`.
    """
    if ax is None:
        from matplotlib import pyplot

        _, ax = pyplot.subplots(figsize=size, layout="constrained", subplot_kw=options)
    return ax


def stack_axes(ax, heights) -> list:
    """Stack axes of relative heights in the place of `ax`, the first of them, with a common time axis."""
    panels = _split_axes(ax, heights, True, True)
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    return panels


def split_columns(ax, count: int) -> list:
    """Split the place of `ax`, the first of them, into columns of axes."""
    return _split_axes(ax, [1] * count, False, False)


def _split_axes(ax, parts, down, share):
    place, figure, count = ax.get_subplotspec(), ax.figure, len(parts)
    options = {"sharex": ax} if share else {}
    if place is not None:
        shape, ratio = ((count, 1), "height_ratios") if down else ((1, count), "width_ratios")
        rooms = place.subgridspec(*shape, **{ratio: parts})
        ax.set_subplotspec(rooms[0])
        return [ax, *(figure.add_subplot(rooms[k], **options) for k in range(1, count))]
    left, bottom, width, height = ax.get_position().bounds  # placed by hand
    whole = height if down else width
    gap = (0.1 if down else 0.25) * whole / max(count - 1, 1) * (count > 1)
    unit, at, panels = (whole - gap * (count - 1)) / sum(parts), 0.0, []
    for part in parts:
        size = unit * part
        box = (left, bottom + height - at - size, width, size) if down else (left + at, bottom, size, height)
        panels.append(figure.add_axes(box, **options) if panels else ax)
        panels[-1].set_position(box)
        at += size + gap
    return panels


def curve_style(i: int) -> dict:
    """Colour and dashes of curve i; they repeat after 24."""
    return {"color": COLORS[i % len(COLORS)], "linestyle": _DASHES[i // len(COLORS) % len(_DASHES)]}


def draw_curves(ax, x, curves: Mapping[str, Any], first: int = 0, **options) -> list:
    """Draw curves (T,) by name, one that would hide another dashed; returns the lines."""
    drawn: list = []
    data = {name: np.asarray(values, float) for name, values in curves.items()}
    finite = [v[np.isfinite(v)] for v in data.values()]
    height = max((float(np.ptp(np.concatenate(finite))) if any(map(len, finite)) else 0.0), 1e-300) if data else 1.0
    for k, (name, values) in enumerate(data.items()):
        style = curve_style(first + k)
        hidden = sum(_coincide(values, line.get_ydata(), height) for line in drawn)
        if hidden:
            style["linestyle"] = (3.0 * hidden, (4, 4 + 2 * hidden))
            style["zorder"] = 2.5 + hidden
        drawn += ax.plot(x, values, label=name, **{**style, **options})
    return drawn


def _coincide(values, others, height):
    apart = np.abs(values - others)
    return (
        bool(np.size(apart) and np.nanmedian(apart) < _COINCIDENT * height) if np.any(np.isfinite(apart)) else False
    )


def format_axes(ax, x_label, y_label, legend="inside"):
    """Add labels, a light grid, and a legend if there are several curves; returns the axes.

    Args:
        legend: "inside" the axes, unless there are many names, "beside" them, "ends" at the ends of curves, unless
            there are many or the figure has no layout that makes room for them; or None.
    """
    ax.set_xlabel(x_label)
    ax.set_ylabel(y_label)
    ax.grid(alpha=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    for axis in (ax.xaxis, ax.yaxis):
        if axis.get_scale() == "log":
            format_log_axis(axis)
    names = ax.get_legend_handles_labels()[1]
    if legend == "ends" and len(names) <= _MOST_AT_ENDS and ax.figure.get_layout_engine() is not None:
        _name_ends(ax)
    elif legend:
        _name_curves(ax, "beside" if legend == "ends" else legend)
    return ax


def format_log_axis(axis) -> None:
    """Number a logarithmic axis at 1, 2 and 5 of every decade, or at decades alone if it has many, or is short."""
    from matplotlib.ticker import LogLocator, NullFormatter

    class Locator(LogLocator):
        def __call__(self):  # when the axes have got their size
            low, high = axis.get_view_interval()
            decades = abs(np.log10(high / low))
            few = np.arange(1.0, 10.0) if decades < 0.5 else (1.0, 2.0, 5.0)
            self.set_params(subs=few if _has_room(axis, decades) else (1.0,))
            return super().__call__()

    axis.set_major_locator(Locator())
    axis.set_major_formatter(lambda x, _: log_number(x))
    axis.set_minor_formatter(NullFormatter())


def _has_room(axis, decades):
    """True if three numbers in every decade do not touch one another."""
    box, dpi = axis.axes.bbox, axis.axes.get_figure(root=True).dpi
    length = (box.width if axis.axis_name == "x" else box.height) / dpi
    return decades < min(_FEW_DECADES, length / (3 * _ROOM[axis.axis_name]))


def log_number(x: float) -> str:
    """A number as on an axis: plain, or times a power of ten where it is small or large."""
    if x == 0 or 1e-3 <= abs(x) < 1e5:
        return f"{x:g}"
    mantissa, exponent = f"{x:.0e}".split("e")
    return f"${'' if mantissa == '1' else mantissa + chr(183)}10^{{{int(exponent)}}}$"


def _name_ends(ax):
    """Write the name of every curve beside its end, moved apart where they would overlap."""
    lines, names = ax.get_legend_handles_labels()
    if len(names) < 2:
        return
    ends = np.array([_last_value(line) for line in lines])
    low, high = ax.get_ylim()
    ax.set_ylim(low, high)
    heights = spread_apart((ends - low) / (high - low), 0.075 * _text_scale(ax))
    for line, name, height in zip(lines, names, heights, strict=True):
        note = ax.annotate(
            name, (1.0, height), (6, 0), "axes fraction", "offset points", color=line.get_color(), va="center"
        )
        note.set_fontsize("small")


def _text_scale(ax):
    """Height of a line of text, relative to the axes, over that in axes of 3 inch."""
    return 3.0 / max(ax.get_position().height * ax.figure.get_size_inches()[1], 0.5)


def _last_value(line):
    y = np.asarray(line.get_ydata(), float)
    y = y[np.isfinite(y)]
    return y[-1] if len(y) else 0.0


def spread_apart(heights, gap) -> np.ndarray:
    """Move heights (n,) apart until they differ by at least a gap, keeping their order."""
    order = np.argsort(heights, kind="stable")
    placed = np.asarray(heights, float)[order]
    for _ in range(100):
        short = gap - np.diff(placed)
        if np.all(short <= 1e-9):
            break
        push = np.maximum(short, 0.0) / 2
        placed[:-1] -= push
        placed[1:] += push
    found = np.empty_like(placed)
    found[order] = placed
    return found


def _name_curves(ax, where):
    """Add a legend; beside the axes only where the figure's layout engine makes room for it."""
    count = len(ax.get_legend_handles_labels()[0])
    if count and (where == "beside" or count > _MOST_INSIDE) and ax.figure.get_layout_engine() is not None:
        beside_it = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.02), "borderaxespad": 0.0}
        rows = 8 if where == "beside" else 20
        ax.legend(frameon=False, fontsize="small", ncols=1 + (count - 1) // rows, **beside_it)
    elif count:
        size = "small" if where == "beside" or count > _MOST_INSIDE else None
        ax.legend(framealpha=0.6, edgecolor="none", fontsize=size, ncols=1 + (count - 1) // _MOST_INSIDE)
