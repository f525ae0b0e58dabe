"""Tables in words and for notebooks: what results show of themselves."""

import dataclasses
import textwrap
from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import Any

import equinox as eqx
import numpy as np

from .checks import is_concrete

Rows = Sequence[Sequence[str]]
_MOST = 12  # rows that are shown
_WIDTH = 110  # letters of a line
_FEW = 6  # numbers or entries of a field that are shown


def aligned(rows: Rows, left: int = 1) -> str:
    """Rows of text, their columns aligned: the first `left` to the left, the others to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [c.ljust(w) if k < left else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True))]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def fitted(rows: Rows) -> Rows:
    """The rows, the cells of the widest column cut short where a line would be longer than a page is wide."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    widest = max(range(len(widths)), key=widths.__getitem__)
    most = widths[widest] - max(0, sum(widths) + 2 * (len(widths) - 1) - _WIDTH)
    cut = [row[widest] if len(row[widest]) <= most else f"{row[widest][: most - 3]}..." for row in rows]
    return [(*row[:widest], cell, *row[widest + 1 :]) for row, cell in zip(rows, cut, strict=True)]


def as_html(summary: Iterable[str], rows: Rows) -> str:
    """Lines, then the rows as a table whose first row is its head."""
    tagged = [("td" if k else "th", row) for k, row in enumerate(rows)]
    cells = ["".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in row) for tag, row in tagged]
    table = "".join(f"<tr>{row}</tr>" for row in cells)
    return "<p>" + "<br>".join(map(escape, summary)) + f"</p><table>{table}</table>"


def shortened(rows: Rows) -> Rows:
    """The rows, of many the first and a line that says how many follow."""
    if len(rows) <= _MOST + 2:
        return rows
    more = (f"... {len(rows) - 1 - _MOST} more", *[""] * (len(rows[0]) - 1))
    return [*rows[: _MOST + 1], more]


def format_number(value: Any) -> str:
    """A number with four digits."""
    return f"{float(value) + 0.0:.4g}"  # minus zero is zero


def shapes(value: Any) -> str:
    """A result whose numbers are not known, or not those of one: the kinds and shapes of its arrays."""
    return eqx.tree_pformat(value, short_arrays=True)


def table_repr(parts: Callable[[Any], tuple[str, Rows]]) -> tuple[Callable[[Any], str], Callable[[Any], str]]:
    """`__repr__` and `_repr_html_` of a class from a summary and rows, the first of which is the head.

    What is traced, or has axes that the table does not know, shows its shapes: a debugger asks at any time, so this
    never raises.
    """

    def title(self, summary):
        return f"{type(self).__name__}: {summary}" if summary else type(self).__name__

    def found(self):
        try:
            if is_concrete(self):
                summary, rows = parts(self)
                return summary, shortened([[str(cell) for cell in row] for row in rows])
        except Exception:  # whatever a half-made or foreign value does
            pass
        return None

    def __repr__(self) -> str:
        shown = found(self)
        if shown is None:
            return shapes(self)
        summary, rows = shown
        lines = *textwrap.wrap(title(self, summary), _WIDTH), *([aligned(fitted(rows))] if len(rows) > 1 else [])
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        shown = found(self)
        if shown is None:
            return f"<pre>{escape(shapes(self))}</pre>"
        return as_html([title(self, shown[0])], shown[1])

    return __repr__, _repr_html_


def sentence_repr(words: Callable[[Any], str]) -> tuple[Callable[[Any], str], Callable[[Any], str]]:
    """`__repr__` and `_repr_html_` of a class from a sentence about it."""
    return table_repr(lambda value: (words(value), ()))


def span(values: Any) -> tuple[str, str, str, str]:
    """First, last, least and largest of a column (T,)."""
    values = np.asarray(values, float)
    kept = values[np.isfinite(values)]
    if len(kept) == 0:
        return ("nan",) * 4
    return format_number(values[0]), format_number(kept[-1]), format_number(kept.min()), format_number(kept.max())


def fields_repr(value: Any) -> str:
    """A module by its class and the numbers of its fields: "SpringDamper(stiffness=40, damping=0.7)".

    Fields without a value are left out; long arrays are counted, traced ones show their shapes.
    """
    if not is_concrete(value):
        return shapes(value)
    named = [(field.name, getattr(value, field.name, None)) for field in dataclasses.fields(value)]
    parts = [f"{name}={field_text(part)}" for name, part in named if part is not None]
    return textwrap.fill(f"{type(value).__name__}({', '.join(parts)})", _WIDTH, subsequent_indent="  ")


def field_text(value: Any) -> str:
    """A value of a field in a few words."""
    if isinstance(value, dict):
        return "{" + _listed([f"{name!r}: {field_text(part)}" for name, part in value.items()]) + "}"
    if isinstance(value, tuple | list):
        return "(" + _listed([field_text(part) for part in value]) + ")"
    if isinstance(value, str | bool | int) or value is None:
        return repr(value)
    if isinstance(value, eqx.Module) and type(value).__repr__ is eqx.Module.__repr__:
        return fields_repr(value)
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return _array_text(np.asarray(value))
    if isinstance(value, float | complex):
        return f"{value:.4g}"
    if callable(value) and hasattr(value, "__name__"):
        return value.__name__
    return " ".join(repr(value).split())


def _listed(texts):
    return ", ".join([*texts[:_FEW], *([f"... {len(texts) - _FEW} more"] if len(texts) > _FEW else [])])


def _array_text(values):
    if values.ndim == 0:
        return f"{values[()]:.4g}" if values.dtype.kind in "fc" else str(values[()])
    if values.size <= _FEW or (values.ndim == 2 and values.size <= 9):  # a rotation is shown
        return f"({', '.join(map(_array_text, values))})"
    return f"<{' x '.join(map(str, values.shape))} numbers>"
