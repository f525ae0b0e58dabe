"""Quantities: named numbers with a unit and axes, of which reports are made."""

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from .tables import format_number


class Axis(NamedTuple):
    """An axis of an array: its name, its labels and the unit of these.

    Numbers are swept, as times and frequencies: a table has the extremes along them.  Names are listed: a table has a
    row for each.
    """

    name: str
    labels: Any
    unit: str = ""

    @property
    def is_swept(self) -> bool:
        """True if the labels are numbers."""
        return len(self.labels) > 0 and np.asarray(self.labels).dtype.kind in "iuf"

    def place(self, index: int) -> str:
        """A label in words: "0.25 s", or "design 3" where it is the number of an entry."""
        label = np.asarray(self.labels)[index]
        return f"{format_number(label)} {self.unit}" if self.unit else f"{self.name} {format_number(label)}"


XYZ = Axis("component", ("x", "y", "z"))


def numbered(name: str, count: int) -> Axis:
    """An axis whose entries have numbers alone, which are listed: "0", "1", ..."""
    return Axis(name, tuple(map(str, range(count))))


class Quantity(NamedTuple):
    """A named result: values with the given axes last; those in front of them are the times or designs of the report.

    `in_table`: false for what is too much to read, as shapes of modes: it is in the data sets alone.
    """

    name: str
    values: Any
    unit: str = ""
    axes: tuple[Axis, ...] = ()
    in_table: bool = True


def entries(name: str, values: Any, unit: str = "", axes: tuple[Axis, ...] = ()) -> Quantity:
    """An array of any shape over some first axes; every entry of the others is listed, one alone without a label."""
    values, own = np.asarray(values), np.shape(values)[len(axes) :]
    if math.prod(own) == 1:
        return Quantity(name, values.reshape(values.shape[: len(axes)]), unit, axes)
    names = ["entry"] if len(own) == 1 else [f"entry {k}" for k in range(len(own))]
    return Quantity(name, values, unit, (*axes, *(numbered(*pair) for pair in zip(names, own, strict=True))))


def along_freedoms(name: str, values: Any, unit: str = "N or N m", axis: str = "freedom") -> Quantity:
    """Values (..., n) of the n freedoms of a joint; of one freedom without a label."""
    values = np.asarray(values)
    if values.shape[-1] == 1:
        return Quantity(name, values[..., 0], unit)
    return Quantity(name, values, unit, (numbered(axis, values.shape[-1]),))


def matrix(name: str, values: Any, unit: str, rows: Iterable[str] = (), columns: Iterable[str] = ()) -> Quantity:
    """A matrix (..., r, c) by names of its rows and columns, or by their numbers."""
    axes = []
    for kind, names, size in zip(("row", "column"), (rows, columns), np.shape(values)[-2:], strict=True):
        names = tuple(names)
        axes.append(Axis(kind, names) if names else numbered(kind, size))
    return Quantity(name, values, unit, tuple(axes))


def columns(quantity: Quantity, axes: tuple[Axis, ...]) -> Iterator[tuple[str, np.ndarray]]:
    """Name and values, flat along the swept axes, of every entry of a quantity along its listed axes."""
    values = np.asarray(quantity.values)
    listed = [k for k, axis in enumerate(axes) if not axis.is_swept]
    rest = [k for k in range(len(axes)) if k not in listed]
    values = values.transpose(*listed, *rest)
    for index in np.ndindex(values.shape[: len(listed)]):
        labels = (str(axes[k].labels[i]) for k, i in zip(listed, index, strict=True))
        yield " ".join(filter(None, (quantity.name, *labels))), values[index].reshape(-1)
