"""Reports: the named numbers of a result with their units, from which print, notebook, pandas and xarray follow.

A result over `Reported` says once, in `report()`, what its numbers are called, their units and their axes.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from .quantities import Axis, Quantity, columns
from .tables import Rows, format_number, table_repr

_MOST = 12  # rows of numbers that are shown
_LEADING = ("design", "instant")
_T = TypeVar("_T", bound=type)


class Report(NamedTuple):
    """Named numbers of a result, with a line of words and what failed.

    Attributes:
        quantities: the named results.
        summary: a line of words above the table.
        fault: what failed, which stands first; empty where nothing did.
        t: (...) times [s] of the leading axes that the quantities do not name; None where they are unknown.
        table: head and rows that are shown in place of those of the quantities.
    """

    quantities: Sequence[Quantity]
    summary: str = ""
    fault: str = ""
    t: Any = None
    table: Rows | None = None

    def axes(self, quantity: Quantity) -> tuple[Axis, ...]:
        """All axes of a quantity, those of times or designs first."""
        shape = np.shape(quantity.values)
        return (*_leading(shape[: len(shape) - len(quantity.axes)], self.t), *quantity.axes)

    def named(self) -> Iterator[tuple[Quantity, tuple[Axis, ...]]]:
        """Quantities with their axes; times of several motions are one of them."""
        times = [Quantity("t", self.t, "s")] if np.ndim(self.t) > 1 else []
        return ((quantity, self.axes(quantity)) for quantity in (*times, *self.quantities))

    def parts(self, most: int = _MOST) -> tuple[str, Rows]:
        """The line of words, and head and rows of the table, of the numbers at most so many."""
        fault = f"FAILED: {self.fault}" if self.fault else ""
        return "; ".join(filter(None, (fault, self.summary or self._extent()))), self.table or self._rows(most)

    def _extent(self):
        """The number of times or designs, in words."""
        leads = [axes[: len(axes) - len(q.axes)] for q in self.quantities for axes in (self.axes(q),)]
        longest = max(leads, key=len, default=())
        return ", ".join(f"{len(axis.labels)} {axis.name}s" for axis in longest)

    def _rows(self, most):
        """Head and rows; of many entries each quantity has its share, and a last line counts the others."""
        quantities = [q for q in self.quantities if q.in_table and np.size(q.values)]
        counts = [_count(self.axes(q)) for q in quantities]
        share = 1
        while share < max(counts, default=1) and sum(min(n, share + 1) for n in counts) <= most:
            share += 1
        shown = [row for q in quantities for row, _ in zip(self._entries(q), range(share), strict=False)][:most]
        is_wide = any(row[2] for row in shown)
        head = ("", "value or least", "at", "largest", "at", "unit") if is_wide else ("", "value", "unit")
        rows = [row if is_wide else (row[0], row[1], row[5]) for row in shown]
        if len(shown) < sum(counts):
            rows.append((f"... {sum(counts) - len(shown)} more", *[""] * (len(head) - 1)))
        return [head, *rows]

    def _entries(self, quantity) -> Iterator[tuple[str, ...]]:
        axes = self.axes(quantity)
        swept = [axis for axis in axes if axis.is_swept]
        for name, values in columns(quantity, axes):
            cells = _cells(values, swept)
            name = f"|{name}|" if values.dtype.kind == "c" else name
            yield (name, *cells, quantity.unit or "-")


def _leading(shape, t):
    """Axes of times or designs of this shape."""
    if len(shape) == 1 and np.shape(t) == tuple(shape):
        return (Axis("time", np.asarray(t), "s"),)
    names = _LEADING[-len(shape) :] if len(shape) <= len(_LEADING) else [f"axis {k}" for k in range(len(shape))]
    return tuple(Axis(name, np.arange(size)) for name, size in zip(names, shape, strict=False))


def _count(axes):
    return math.prod(len(axis.labels) for axis in axes if not axis.is_swept)


def _cells(values, swept):
    """A value, or the least and the largest with their places, as four texts."""
    if values.dtype.kind == "b" and len(values) > 1:
        return f"{np.count_nonzero(values)} of {len(values)}", "", "", ""
    if len(values) == 1 or values.dtype.kind not in "iufc":
        return _text(values[0]), "", "", ""
    sizes = np.abs(values) if values.dtype.kind == "c" else values
    known = np.flatnonzero(np.isfinite(sizes))
    if not len(known):
        return _text(sizes[0]), "", "", ""
    found = known[[np.argmin(sizes[known]), np.argmax(sizes[known])]]
    return tuple(text for k in found for text in (_text(sizes[k]), _place(k, swept)))


def _place(index, swept):
    shape = [len(axis.labels) for axis in swept]
    return ", ".join(axis.place(int(i)) for axis, i in zip(swept, np.unravel_index(index, shape), strict=True))


def _text(value):
    kind = np.asarray(value).dtype.kind
    if kind == "b":
        return "yes" if value else "no"
    return str(value) if kind in "iuUSO" else format_number(abs(value) if kind == "c" else value)


def failures(ok: Any, what: str = "not ok") -> str:
    """Words for a verdict (...) that is no somewhere, otherwise none."""
    ok = np.asarray(ok)
    if ok.all():
        return ""
    return f"{np.count_nonzero(~ok)} of {ok.size} {what}" if ok.ndim else what


def faults_in_short(faults: Iterable[str]) -> str:
    """The first of some sentences, and the number of the others."""
    first, *others = list(faults) or [""]
    return first + (f" (and {len(others)} more)" if others else "")


class Reported:
    """Print, notebook, pandas and xarray of a result from its `report`.

    What is traced, or half made, shows its shapes.
    """

    _computes = True  # its methods and properties are public calls, see `explain_arguments`

    def report(self) -> Report:
        """The named numbers of the result, with their units."""
        raise NotImplementedError

    __repr__, _repr_html_ = table_repr(lambda result: result.report().parts())

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` of the named numbers, over times [s], frequencies, designs and names."""
        from .datasets import as_xarray

        return as_xarray(self.report())

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` over times [s], frequencies or designs, a column for each number; of a result without
        these, a row for each number with its value and unit.  The units of columns are in its `attrs["units"]`.

        What has other axes than the first of the numbers is in `to_xarray` alone.
        """
        from .datasets import as_pandas

        return as_pandas(self.report())


def reported(cls: _T) -> _T:
    """The methods of `Reported` for a NamedTuple, which derives from nothing else; it has a `report`."""
    for name in ("__repr__", "_repr_html_", "to_xarray", "to_pandas"):
        setattr(cls, name, getattr(Reported, name))
    return cls


class Note(str):
    """Words that are no part of a structure: motions by other tolerances are pytrees of one kind, and
    what is compiled for one serves the other."""

    def __eq__(self, other: object) -> bool:
        return True if isinstance(other, Note) else str.__eq__(self, other)

    def __hash__(self) -> int:
        return 0
