"""Minimum of one variable where the slope jumps: a search by slopes is slow there, where tangents meet at once."""

import numpy as np

from ._search import Point, Search

#: A slope jumps where its change keeps this share while the bracket becomes so many times shorter: a smooth one would
#: lose seven eighths of it.
_KEPT, _SHORTER = 0.7, 8.0
#: As many times shorter, the slope jumps beyond doubt.
_PROOF = 1e4
#: Evaluations where tangents meet; ten reach rounding at kinks between parabolas.
_MOST = 30
#: Share of the objective's scale that stands in for an objective near zero.
_SMALL = 1e-3
#: A trial goes so many times beyond a meeting point as that has moved since the last one.
_BEYOND = 2.0


class AtKink(Exception):
    """The slope of an objective of one variable jumps between two points."""


class Bracket:
    """Two points of one variable: the objective falls at the left one and rises at the right one, so that it is least
    between them."""

    def __init__(self) -> None:
        self.left: Point | None = None
        self.right: Point | None = None
        self._seen: list[tuple[float, float]] = []

    def add(self, point: Point) -> bool:
        """Take a point that lies between them, gives the first pair or is lower than both; True if it is one of them
        now."""
        if not (point.finite and point.has_slopes and point.gradient[0]):
            return False
        x, left, right = point.x[0], self.left, self.right
        if left is not None and right is not None and not left.x[0] < x < right.x[0]:
            if point.value >= min(left.value, right.value):
                return False
            left = right = None
            self._seen.clear()
        if point.gradient[0] < 0:
            self.left, self.right = point, right if right is not None and right.x[0] > x else None
        else:
            self.left, self.right = left if left is not None and left.x[0] < x else None, point
        if self.is_closed:
            self._seen.append((self.length, self.jump))
        return True

    def holds(self, point: Point) -> bool:
        """True for one of the two points."""
        return point is self.left or point is self.right

    @property
    def ends(self) -> tuple[Point, Point]:
        """Both points."""
        assert self.left is not None and self.right is not None
        return self.left, self.right

    @property
    def is_closed(self) -> bool:
        """True if both points are known."""
        return self.left is not None and self.right is not None

    @property
    def length(self) -> float:
        """Distance of both points."""
        left, right = self.ends
        return float(right.x[0] - left.x[0])

    @property
    def jump(self) -> float:
        """Change of the slope between them."""
        left, right = self.ends
        return float(right.gradient[0] - left.gradient[0])

    def has_kink(self, shorter: float = _SHORTER) -> bool:
        """True if the slope changes by as much as in a bracket that was so many times longer."""
        if not self.is_closed:
            return False
        return any(long >= shorter * self.length and self.jump >= _KEPT * jump for long, jump in self._seen)

    def crossing(self) -> tuple[float, float]:
        """The place where the tangents at both points meet, and the value there: none between is less if convex."""
        left, right = self.ends
        span, fall, rise = self.length, -float(left.gradient[0]), float(right.gradient[0])
        share = (left.value - right.value + rise * span) / (fall + rise) / span
        # tangents of bent sides may meet beyond an end: then the minimum is as near to it within
        if share <= 0.0:
            share = min(-2.0 * share, 0.5)
        elif share >= 1.0:
            share = max(3.0 - 2.0 * share, 0.5)
        return float(left.x[0] + share * span), float(left.value - fall * share * span)


def close_bracket(search: Search, bracket: Bracket) -> None:
    """Evaluate where tangents meet, or a little beyond, until no lower value is to be found, and note the kink.

    A meeting point of two parabolas errs by the squares of both sides, to the side of the same end each time: a trial
    goes beyond it into the longer side, so that this becomes short too.
    """
    before, reason = None, ""
    for _ in range(_MOST):
        middle, least = bracket.crossing()
        left, right = bracket.ends
        best = min(left.value, right.value)
        if abs(best - least) <= search.tolerance * max(abs(best), _SMALL * search.objective_scale(left)):
            reason = "converged"
            break
        a, b = middle - left.x[0], right.x[0] - middle
        beyond = 0.0 if before is None else min(_BEYOND * abs(middle - before), 0.5 * max(a, b))
        x, before = middle + (beyond if b > a else -beyond), middle
        if not (left.x[0] < x < right.x[0] and bracket.add(search.evaluate(np.array([x])))):
            break
    left, right = bracket.ends
    if bracket.has_kink(_PROOF):
        search.kink = float(left.gradient[0]), float(right.gradient[0])
    lower = left if left.value < right.value else right
    if lower.value < search.current.value:
        search.accept(lower, by_decrease=False)
    search.reason = search.reason or reason or search.failure_reason()
