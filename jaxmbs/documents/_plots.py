"""Curves of the numbers of a report, by matplotlib, as addresses of pictures that hold their data."""

import base64
import functools
import importlib.util
import io
from collections.abc import Callable
from typing import Any

import numpy as np

from ..quantities import columns
from ..reports import Report

_CURVES, _PICTURES = 6, 8  # of a picture, and of a section: who wants more draws them
_POINTS = 1200  # of a curve, of which least and largest values stay


def curves(report: Report) -> list[tuple[str, str]]:
    """Pictures of what a report has along times, frequencies or another axis of numbers, those of a unit together."""
    found: dict = {}
    for quantity, axes in report.named():
        swept = [axis for axis in axes if axis.is_swept]
        if len(swept) != 1 or len(swept[0].labels) < 3 or not quantity.in_table:
            continue
        x, own = (
            np.asarray(swept[0].labels, float),
            found.setdefault((_label(swept[0].name, swept[0].unit), quantity.unit), []),
        )
        for name, y in columns(quantity, axes):
            if y.dtype.kind in "iufc" and np.any(np.isfinite(y)) and np.all(np.diff(x) > 0):
                own.append((name, x, np.abs(y) if y.dtype.kind == "c" else y.astype(float)))
    pictures = [
        (axis, unit, rows[k : k + _CURVES])
        for (axis, unit), rows in found.items()
        for k in range(0, len(rows), _CURVES)
    ]
    drawn = [(picture(functools.partial(_draw, part)), _caption(*part)) for part in pictures[:_PICTURES]]
    return [(source, words) for source, words in drawn if source]


def _label(name, unit):
    return f"{name} [{unit}]" if unit else name


def _caption(axis, unit, rows):
    return f"{', '.join(name for name, _, _ in rows)} [{unit or '-'}] over {axis}"


def _draw(part, ax):
    from ..viz._canvas import curve_style, format_axes

    axis, unit, rows = part
    for k, (name, x, y) in enumerate(rows):
        ax.plot(*_thinned(x, y), label=name, **curve_style(k))
    if axis.startswith("frequency") and rows[0][1][0] > 0:
        ax.set_xscale("log")
        if all(np.nanmin(y) > 0 and np.nanmax(y) > 30 * np.nanmin(y) for _, _, y in rows):
            ax.set_yscale("log")
    several = len(rows) > 1
    format_axes(ax, axis, f"{'' if several else rows[0][0]} [{unit or '-'}]".strip(), "beside" if several else None)


def _thinned(x, y):
    """Of a long curve the places of the least and the largest value in each of its pieces."""
    if len(x) <= _POINTS:
        return x, y
    pieces = np.array_split(np.arange(len(x)), _POINTS // 2)
    filled = np.where(np.isfinite(y), y, 0.0)
    kept = sorted(
        {int(k) for piece in pieces for k in (piece[np.argmin(filled[piece])], piece[np.argmax(filled[piece])])}
    )
    return x[kept], y[kept]


def picture(draw: Callable[[Any], Any], size: tuple[float, float] = (6.4, 3.2)) -> str:
    """The address of a picture that holds its data; empty without matplotlib."""
    if importlib.util.find_spec("matplotlib") is None:
        return ""
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasSVG(figure)
    draw(figure.subplots())
    file = io.BytesIO()
    with rc_context({"svg.hashsalt": "jaxmbs"}):  # the same file from the same numbers
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return "data:image/svg+xml;base64," + base64.b64encode(file.getvalue()).decode()
