"""The book of a search with limits: the rows it looks at, which point is better, and when it has converged."""

import dataclasses
from collections.abc import Callable

import numpy as np

from ._kkt import Multipliers, estimate_multipliers
from ._limit_result import limit_results
from ._optimum import Optimum
from ._problem import DesignProblem, select_working_set
from ._search import Point, Search
from ._variables import Variables

#: Excess, relative to the limit, that counts as kept.
FEASIBILITY = 1e-7
#: Where an optimiser finds no way on, a residual of so many tolerances is rounding.
_STALLED = 100.0


class ConstrainedSearch(Search):
    """A search whose points keep limits, or come near.

    Of many limits the search differentiates some rows only: those that held it so far, and the worst.

    Attributes:
        rows: (k,) which ones these are.
    """

    def __init__(self, program: DesignProblem, evaluate: Callable, variables: Variables, *args, **options):
        self._program, self._kept = program, np.zeros(0, np.int32)
        self._proven: tuple[Point, np.ndarray, Multipliers] | None = None
        self.rows = np.arange(min(program.size, 4 * len(variables.start) + 16), dtype=np.int32)
        super().__init__(lambda vector: evaluate(vector, self.rows), variables, *args, **options)
        if not self.reason and len(self.rows) < program.size:
            self.update_working_set()

    def update_working_set(self) -> None:
        """Choose the rows anew at the current point: those with multipliers so far, then the worst."""
        held = self.rows[self.multipliers(self.current).limits > 0.0]
        self._kept = np.union1d(self._kept, held).astype(np.int32)
        outside = self.current.excess > FEASIBILITY
        needed = len(np.union1d(self._kept, np.flatnonzero(outside)))
        size = len(self.rows)
        while size < min(needed, self._program.size):
            size = min(2 * size, self._program.size)
        self.rows = select_working_set(size, self.current.excess, self._kept)
        self._last = self._last._replace(x=np.full_like(self._last.x, np.nan))  # no gradients of these rows yet
        self.current, self.reason = self.evaluate(self.current.x), ""

    @property
    def functions(self) -> tuple[tuple[str, ...], np.ndarray]:
        names = [held.limit.name for held in self._program.limits for _ in range(held.size)]
        return ("objective", *(names[row] for row in self.rows)), self.rows

    def is_missing(self) -> bool:
        """Whether the current point exceeds limits that are not among the rows."""
        others = np.ones(len(self.current.excess), bool)
        others[self.rows] = False
        return bool(np.any(self.current.excess[others] > FEASIBILITY))

    def multipliers(self, point: Point) -> Multipliers:
        """Of the rows, at a point."""
        return estimate_multipliers(point, self.variables, self.rows)

    def is_optimal(self, tolerance: float) -> bool:
        return self.current.violation <= FEASIBILITY and super().is_optimal(tolerance)

    def is_at_rest(self) -> bool:
        """Whether the rows alone would let the search end."""
        among = float(np.max(self.current.excess[self.rows], initial=0.0))
        return among <= FEASIBILITY and super().is_optimal(self._tolerance)

    def continue_from_best(self) -> None:
        """Go on from the best point so far."""
        self.current, self.reason = self.evaluate(self._best.x), ""

    def worst(self) -> str:
        """The limits that the best point misses, the worst first, for a message."""
        found = limit_results(
            self._program.limits, self._first.values, self._best.values, np.zeros(self._program.size)
        )
        missed = sorted((limit for limit in found if not limit.ok), key=lambda limit: limit.margin)
        return ", ".join(f"{limit.name!r} by {-limit.margin:.3g} of it" for limit in missed)

    @property
    def best(self) -> Point:
        """The point that keeps the limits with the least objective, or else exceeds them least."""
        return self._best

    def is_proven(self) -> bool:
        """Whether the best point is optimal, by its residual, as far as an optimiser that ended there can tell."""
        return self._best.violation <= FEASIBILITY and self.residual <= _STALLED * self._tolerance * self.size_of(self._best)

    @property
    def residual(self) -> float:
        """Of the best point, or of an accepted one beside it.

        At the best point itself limits may have no single gradients: those of frequencies that meet there.
        """
        return self._proof(self.evaluate(self._best.x))[1].residual

    def _proof(self, best: Point):
        """(rows, their multipliers) with the least residual, of the best point or one as good."""
        proofs = [(self.rows, self.multipliers(best))]
        if self._proven is not None and abs(self._proven[0].value - best.value) <= 1e-6 * abs(best.value):
            proofs.append(self._proven[1:])
        return min(proofs, key=lambda proof: proof[1].residual)

    def optimum(self) -> Optimum:
        best = self.evaluate(self._best.x)
        rows, found = self._proof(best)
        every = np.zeros(self._program.size)
        every[rows] = found.limits
        results = limit_results(self._program.limits, self._first.values, best.values, every)
        return dataclasses.replace(super().optimum(), limits=results, kkt=found.residual, bound_prices=found.bounds)

    def _is_better(self, point: Point, best: Point) -> bool:
        """What two points that keep the limits gain by their slack is taken off again, twice to be on the safe side:
        an exact penalty, its weight above the multipliers."""
        if max(point.violation, best.violation) > FEASIBILITY:
            return point.violation < best.violation
        weight = 0.0 if self._proven is None else 2.0 * float(np.sum(self._proven[2].limits))
        return point.value + weight * point.violation < best.value + weight * best.violation

    def _norm(self, point: Point) -> float:
        found = self.multipliers(point)
        if point.violation <= 10 * FEASIBILITY and (self._proven is None or found.residual <= self._proven[2].residual):
            self._proven = point, self.rows, found
        return found.residual
