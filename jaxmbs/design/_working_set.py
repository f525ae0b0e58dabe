"""Search subject to limits: working set of constraints, merit of points, and convergence."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ._kkt import LimitMultipliers, estimate_multipliers
from ._limit_result import limit_results
from ._optimum import Optimum
from ._problem import DesignProblem, select_working_set
from ._search import Point, Search
from ._variables import Variables

#: Violation of a constraint, relative to its limit, up to which the limit counts as satisfied: above the rounding of
#: a motion's peaks, and below what the table of limits shows.
FEASIBILITY = 1e-7
#: Violation outside of the working set at which an optimiser is stopped, to continue with these constraints: it would
#: spend its steps where they do not hold.
FAR_OUTSIDE = 0.1
#: Where an optimiser finds no further step, a residual of up to so many tolerances is attributed to rounding.
_STALLED = 100.0
#: Constraints that a search with forward derivatives takes from the start.
_FORWARD_ROWS = 300


def first_working_set(problem: DesignProblem, variables: Variables) -> np.ndarray:
    """Indices (k,) of the constraints that a search differentiates first.

    n constraints can be active at a vertex; four times as many and 16 spare most re-compilations for larger sets.
    Forward mode has the derivatives of all anyway; an optimiser is still to solve for them.
    """
    least = _FORWARD_ROWS if problem.gradient == "forward" else 16
    return np.arange(min(problem.num_constraints, max(least, 4 * len(variables.start) + 16)), dtype=np.int32)


class ConstrainedSearch(Search):
    """A search subject to limits.

    Of many constraints only a working set is differentiated: those that were active so far, and the largest.

    Attributes:
        problem: its functions.
        working_set: (k,) indices of these constraints.
    """

    def __init__(
        self, problem: DesignProblem, evaluate: Callable, variables: Variables, *args: Any, **options: Any
    ) -> None:
        self.problem, self._active = problem, np.zeros(0, np.int32)
        self._optimality_record: tuple[Point, np.ndarray, LimitMultipliers] | None = None
        self.working_set = first_working_set(problem, variables)
        super().__init__(lambda vector: evaluate(vector, self.working_set), variables, *args, **options)
        if not self.reason and len(self.working_set) < problem.num_constraints:
            self.update_working_set()

    def update_working_set(self) -> None:
        """Choose the working set at the current point: constraints that had multipliers so far, then the largest."""
        active = self.working_set[self.multipliers(self.current).limits > 0.0]
        self._active = np.union1d(self._active, active).astype(np.int32)
        violated = np.flatnonzero(self.current.constraints > FEASIBILITY)
        needed, size = len(np.union1d(self._active, violated)), len(self.working_set)
        while size < min(needed, self.problem.num_constraints):  # doubled: each size is another program
            size = min(2 * size, self.problem.num_constraints)
        self.working_set = select_working_set(size, self.current.constraints, self._active)
        self._last = self._last._replace(x=np.full_like(self._last.x, np.nan))  # its Jacobian has other rows
        self.current, self.reason = self.evaluate(self.current.x), ""

    @property
    def functions(self) -> tuple[tuple[str, ...], np.ndarray]:
        names = [one.limit.name for one in self.problem.constraints for _ in range(one.size)]
        return ("objective", *(names[row] for row in self.working_set)), self.working_set

    def is_working_set_insufficient(self, violation: float = FEASIBILITY) -> bool:
        """True if the current point violates constraints outside of the working set, by more than `violation`."""
        others = np.ones(len(self.current.constraints), bool)
        others[self.working_set] = False
        return bool(np.any(self.current.constraints[others] > violation))

    def multipliers(self, point: Point) -> LimitMultipliers:
        """Multipliers of the working set at a point."""
        return estimate_multipliers(point, self.variables, self.working_set)

    def active_rows(self, point: Point) -> tuple[np.ndarray, np.ndarray]:
        return self.multipliers(point).limits, self.working_set

    def is_optimal(self, tolerance: float) -> bool:
        return self.current.violation <= FEASIBILITY and super().is_optimal(tolerance)

    def is_working_set_optimal(self) -> bool:
        """True if the current point is optimal for the constraints of the working set alone."""
        violation = float(np.max(self.current.constraints[self.working_set], initial=0.0))
        return violation <= FEASIBILITY and super().is_optimal(self.tolerance)

    def restart_from_best(self) -> None:
        """Continue from the best point so far."""
        self.current, self.reason = self.evaluate(self.best.x), ""

    def describe_violations(self) -> str:
        """The limits that the best point violates, the worst first, for a message."""
        found = limit_results(
            self.problem.constraints,
            self._first.limit_values,
            self.best.limit_values,
            np.zeros(self.problem.num_constraints),
        )
        violated = sorted((limit for limit in found if not limit.ok), key=lambda limit: limit.margin)
        return ", ".join(f"{limit.name!r} by {-limit.margin:.3g} of it" for limit in violated)

    def is_best_optimal(self) -> bool:
        """True if the best point is optimal by its residual, as far as an optimiser that stalled there can tell."""
        allowed = _STALLED * self.tolerance * self.objective_scale(self.best)
        return self.best.violation <= FEASIBILITY and self.residual <= allowed

    def stationarity(self, point: Point) -> np.ndarray:
        return point.gradient + self.multipliers(point).limits @ point.jacobian

    @property
    def remaining_decrease(self) -> float:
        return self.residual

    @property
    def residual(self) -> float:
        """Residual of the KKT conditions at the best point, or at an accepted point as good as it.

        At the best point itself constraints may not be differentiable: frequencies that meet there, for example.
        """
        return self._best_multipliers(self.evaluate(self.best.x))[1].residual

    def _best_multipliers(self, best: Point) -> tuple[np.ndarray, LimitMultipliers]:
        """(working set, its multipliers) with the least residual, of the best point or one as good."""
        found = [(self.working_set, self.multipliers(best))]
        record = self._optimality_record
        if record is not None and abs(record[0].value - best.value) <= 1e-6 * abs(best.value):
            found.append(record[1:])
        return min(found, key=lambda pair: pair[1].residual)

    def optimum(self) -> Optimum:
        best = self.evaluate(self.best.x)
        rows, found = self._best_multipliers(best)
        every = np.zeros(self.problem.num_constraints)
        every[rows] = found.limits
        results = limit_results(self.problem.constraints, self._first.limit_values, best.limit_values, every)
        return dataclasses.replace(super().optimum(), limits=results, kkt=found.residual, bound_prices=found.bounds)

    def _is_better(self, point: Point, best: Point) -> bool:
        """Compare by violation, and feasible points by an exact penalty function.

        Its weight is twice the sum of the multipliers: an l1 penalty is exact for any weight above them (Nocedal and
        Wright, Numerical Optimization, theorem 17.3), so that no point wins by the tolerance of its constraints.
        """
        if max(point.violation, best.violation) > FEASIBILITY:
            return point.violation < best.violation
        record = self._optimality_record
        weight = 0.0 if record is None else 2.0 * float(np.sum(record[2].limits))
        return point.value + weight * point.violation < best.value + weight * best.violation

    def _optimality(self, point: Point) -> float:
        found, record = self.multipliers(point), self._optimality_record
        if point.violation <= 10 * FEASIBILITY and (record is None or found.residual <= record[2].residual):
            self._optimality_record = point, self.working_set, found
        return found.residual
