"""What became of the limits of an optimisation: values, margins and prices."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ._limit import BoundConstraint


class LimitResult(NamedTuple):
    """One limit at the best design.

    Attributes:
        name: of the limit.
        before, after: its value at the first and at the best design, in the value's shape.
        worst: index of the entry with the least room.
        bound: what that entry may not pass; side: "<=" for an upper limit, ">=" for a lower one.
        margin: room that the entry has left, relative to the limit (or its `scale`); negative where it is missed.
        prices: in the value's shape: what one unit more of each limit would add to the objective, to first order.
        gap: distance of an aggregated limit beyond its worst entry, relative; the room it wastes.
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

    @property
    def price(self) -> float:
        """What the objective gains by one unit more of the whole limit."""
        return float(np.sum(self.prices))

    @property
    def active(self) -> bool:
        """Whether it holds the design where it is."""
        return bool(np.any(self.prices != 0.0))

    @property
    def ok(self) -> bool:
        """Whether it is kept, to 1e-6 of itself."""
        return self.margin >= -1e-6

    def row(self) -> tuple[str, ...]:
        """Cells of the table: name, before, after, limit, margin, price, mark."""
        index = f"[{','.join(map(str, self.worst))}]" if self.worst else ""
        mark = "missed" if not self.ok else "active" if self.active else ""
        price = f"{self.price:.5g}" if mark == "active" else ""  # where no design keeps it there is none
        numbers = [f"{x[self.worst]:.6g}" for x in (self.before, self.after)]
        return (self.name + index, *numbers, f"{self.side} {self.bound:.6g}", f"{self.margin:.3%}", price, mark)


def limit_results(
    limits: Sequence[BoundConstraint],
    before: Sequence[np.ndarray],
    after: Sequence[np.ndarray],
    multipliers: np.ndarray,
) -> tuple[LimitResult, ...]:
    """Of all limits, from their values; multipliers (m,) of every excess."""
    parts = np.split(multipliers, np.cumsum([held.size for held in limits])[:-1])
    return tuple(map(_result, limits, before, after, parts))


def _result(held: BoundConstraint, before: np.ndarray, after: np.ndarray, multipliers: np.ndarray) -> LimitResult:
    entries = np.concatenate([side.excess(np.ravel(after)) for side in held.sides], dtype=float)
    weights = multipliers
    if held.limit.sharpness:  # the slope of the aggregation shares the one multiplier out
        weights = np.exp(held.limit.sharpness * (entries - np.max(entries)))
        weights = multipliers * weights / np.sum(weights)
    sign, index, bound, size = (
        np.concatenate(parts)
        for parts in zip(*((np.full(len(s.places), s.sign), *s[1:]) for s in held.sides), strict=True)
    )
    prices = np.zeros(after.size)
    np.add.at(prices, index, -sign * weights / size)
    k = int(np.argmax(entries))
    return LimitResult(
        held.limit.name,
        before,
        after,
        tuple(int(i) for i in np.unravel_index(index[k], held.shape)),
        float(bound[k]),
        "<=" if sign[k] > 0 else ">=",
        -float(entries[k]),
        prices.reshape(held.shape),
        float(np.max(np.asarray(held.excess(after))) - entries[k]) if held.limit.sharpness else 0.0,
    )


def limits_table(limits: Sequence[LimitResult]) -> str:
    """The limits as text, the worst entry of each."""
    rows = [("limit", "before", "after", "", "margin", "price", ""), *(limit.row() for limit in limits)]
    widths = [max(len(row[k]) for row in rows) for k in range(7)]
    lines = []
    for row in rows:
        cells = [cell.rjust(width) for cell, width in zip(row[1:6], widths[1:6], strict=True)]
        lines.append("  ".join([row[0].ljust(widths[0]), *cells, row[6]]).rstrip())
    return "\n".join(lines)
