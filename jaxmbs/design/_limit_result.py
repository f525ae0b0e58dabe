"""Limits at the result of an optimisation: values, margins and prices (multipliers in the limits' units)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..quantities import Quantity, entries
from ..reports import Report, reported
from ._limit import BoundConstraint


@reported
class LimitResult(NamedTuple):
    """One limit at the best design.

    Attributes:
        name: of the limit.
        before, after: its value at the first and at the best design, in the value's shape.
        worst: index of the entry with the least margin.
        bound: bound of that entry; side: "<=" for an upper limit, ">=" for a lower one.
        margin: distance of that entry to its bound, relative to the bound (or `scale`); negative where it is
            violated.
        prices: shadow prices in the value's shape: change of the objective if the bound of the entry moves up by one
            unit, to first order.
        gap: relative distance of an aggregated limit beyond its worst entry; the margin that aggregation costs.
        unit: of the value and the bound, as the limit has it.
        probability: that the bound may be passed with; the values are then percentiles.
    """

    name: str
    before: np.ndarray
    after: np.ndarray
    worst: tuple[int, ...]
    bound: float
    side: str
    margin: float
    prices: np.ndarray
    gap: float
    unit: str = ""
    probability: float | None = None

    def report(self) -> Report:
        fault = "" if self.ok else "the limit is violated"
        numbers = {"margin": self.margin, "price": self.price, "gap": self.gap}
        found = [Quantity("bound", self.bound, self.unit), *(Quantity(*pair) for pair in numbers.items())]
        found += [entries("before", self.before, self.unit), entries("after", self.after, self.unit)]
        found.append(entries("price of", self.prices))
        mark = ", active" if self.active else ""
        return Report(found, f"{self.name} {self.side} {self._bound_text()}{self._chance_text()}{mark}", fault)

    def _bound_text(self):
        return f"{self.bound:.6g} {self.unit}".rstrip()

    def _chance_text(self):
        return "" if self.probability is None else f" but for {self.probability:g}"

    @property
    def price(self) -> float:
        """Change of the objective if the bounds of all entries move up by one unit."""
        return float(np.sum(self.prices))

    @property
    def active(self) -> bool:
        """True if the limit is active: it has a price."""
        return bool(np.any(self.prices != 0.0))

    @property
    def ok(self) -> bool:
        """True if the limit is satisfied, to 1e-6 of itself (what a table of six digits shows)."""
        return self.margin >= -1e-6

    def bounds_row(self) -> tuple[str, ...]:
        """Cells of a row among variables: name, before, after, lower and upper bound, and what the limit costs."""
        name, before, after, _, margin, price, mark = self.table_row()
        text = f"{mark}, price {price}" if price else f"{mark}, margin {margin}".removeprefix(", ")
        bounds = ("", f"{self.bound:.6g}") if self.side == "<=" else (f"{self.bound:.6g}", "")
        return (name, before, after, *bounds, text)

    def table_row(self) -> tuple[str, ...]:
        """Cells of the table: name, before, after, limit, margin, price, mark."""
        index = f"[{','.join(map(str, self.worst))}]" if self.worst else ""
        mark = "violated" if not self.ok else "active" if self.active else ""
        price = f"{self.price:.5g}" if mark == "active" else ""  # a violated limit has no price
        numbers = [f"{x[self.worst]:.6g}" for x in (self.before, self.after)]
        return (
            self.name + index,
            *numbers,
            f"{self.side} {self._bound_text()}{self._chance_text()}",
            f"{self.margin:.3%}",
            price,
            mark,
        )


def limit_results(
    limits: Sequence[BoundConstraint],
    before: Sequence[np.ndarray],
    after: Sequence[np.ndarray],
    multipliers: np.ndarray,
) -> tuple[LimitResult, ...]:
    """Results of all limits, from their values; multipliers (m,) of every constraint."""
    parts = np.split(multipliers, np.cumsum([constraint.size for constraint in limits])[:-1])
    return tuple(map(_result, limits, before, after, parts))


def _result(
    constraint: BoundConstraint, before: np.ndarray, after: np.ndarray, multipliers: np.ndarray
) -> LimitResult:
    limit = constraint.limit
    entries = np.concatenate([np.asarray(side.evaluate(np.ravel(after)), float) for side in constraint.sides])
    weights = multipliers
    if limit.sharpness:  # the gradient of log-sum-exp, a softmax, distributes the one multiplier to the entries
        weights = np.exp(limit.sharpness * (entries - np.max(entries)))
        weights = multipliers * weights / np.sum(weights)
    sign, index, bound, size = (
        np.concatenate(parts)
        for parts in zip(*((np.full(len(s.entries), s.sign), *s[1:]) for s in constraint.sides), strict=True)
    )
    prices = np.zeros(after.size)
    np.add.at(prices, index, -sign * weights / size)
    k = int(np.argmax(entries))
    return LimitResult(
        limit.name,
        before,
        after,
        tuple(int(i) for i in np.unravel_index(index[k], constraint.shape)),
        float(bound[k]),
        "<=" if sign[k] > 0 else ">=",
        -float(entries[k]),
        prices.reshape(constraint.shape),
        float(np.max(np.asarray(constraint.evaluate(after))) - entries[k]) if limit.sharpness else 0.0,
        limit.unit,
        limit.probability,
    )


def limits_table(limits: Sequence[LimitResult]) -> str:
    """Table of the limits, the worst entry of each."""
    rows = [("limit", "before", "after", "", "margin", "price", ""), *(limit.table_row() for limit in limits)]
    widths = [max(len(row[k]) for row in rows) for k in range(7)]
    lines = []
    for row in rows:
        cells = [cell.rjust(width) for cell, width in zip(row[1:6], widths[1:6], strict=True)]
        lines.append("  ".join([row[0].ljust(widths[0]), *cells, row[6]]).rstrip())
    return "\n".join(lines)
