"""Bookkeeping shared by all optimisers: evaluations, best design so far, history, and when to stop."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from ._optimum import History, Optimum
from ._variables import Variables

#: A variable without bounds that has grown to so many times its scale, while the objective fell, has no minimum.
_UNBOUNDED = 1e10


class Point(NamedTuple):
    """An evaluated design.

    Attributes:
        x: variables (n,).
        value: objective f.
        gradient: (n,) of the objective; empty, as `jacobian` is, where the values alone were asked.
        constraints: c (m,), of which none is positive where the limits are satisfied.
        jacobian: (k, n) of the constraints in the working set.
        limit_values: values of the limits, in their own shapes and units.
        is_outside: True where a motion or equilibrium of the design has the status VALIDITY.
    """

    x: np.ndarray
    value: float
    gradient: np.ndarray
    constraints: np.ndarray
    jacobian: np.ndarray
    limit_values: tuple
    is_outside: bool

    @property
    def finite(self) -> bool:
        """True if objective, constraints and their gradients are finite."""
        return all(bool(np.all(np.isfinite(part))) for part in self[1:5])

    @property
    def has_slopes(self) -> bool:
        """True if the gradients were evaluated too."""
        return self.gradient.size > 0

    @property
    def violation(self) -> float:
        """Largest constraint, zero where all limits are satisfied."""
        return float(np.max(self.constraints, initial=0.0))


class Search:
    """One optimisation on the host; optimisers call `evaluate` at trial points and `accept` after each step.

    Attributes:
        variables: the variables and their bounds.
        current: the point accepted last.
        reason: why the search has ended, empty while it goes on.
        tolerance: as of `minimise`.
        kink: slopes of the objective on both sides of a kink that the search has found, else None.
        points: vectors (n,) of the points that it accepted.

    Args:
        evaluate: of a vector to (value, gradient, constraints, Jacobian, values of the limits and `is_outside`).
        may_fail: end the search at a start without finite values, in place of an error.
        evaluate_values: of a vector to (value, constraints, values of the limits), for trials of line searches.
    """

    def __init__(
        self,
        evaluate: Callable,
        variables: Variables,
        tolerance: float,
        callback: Callable[[int, PyTree, float], Any] | None,
        progress: tqdm,
        may_fail: bool = False,
        evaluate_values: Callable | None = None,
    ) -> None:
        self.variables, self.reason = variables, ""
        self.kink: tuple[float, float] | None = None
        self._evaluate, self._evaluate_values, self.tolerance = evaluate, evaluate_values, tolerance
        self._backtracks = False
        self._callback, self._progress = callback, progress
        self._evaluations, self._history, self.points = 0, [], []
        self.current = self._last = self._best = self._proven = self._first = self.evaluate(variables.start)
        if not self.current.finite:
            self.reason = self._start_error()
            if not may_fail:
                raise ValueError(self.reason)
        self._record()
        if not self.reason and self.is_optimal(0.0):
            self.reason = "converged"

    @property
    def functions(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Names of the functions that points have gradients of, and the indices of the constraints among them."""
        return ("objective",), np.zeros(0, int)

    @property
    def gradient_norm(self) -> float:
        """Size of the projected gradient at the current point, as in `History`."""
        return self._history[-1][1]

    def evaluate(self, x: np.ndarray, slopes: bool = True) -> Point:
        """Evaluate a trial point, clipped to the bounds; the best one is remembered.

        Args: slopes: False where the values are enough.
        """
        vector = self.variables.clip(x)
        x = np.asarray(vector, float)
        is_last = self._evaluations > 0 and np.array_equal(x, self._last.x)
        if is_last and (self._last.has_slopes or not slopes):
            return self._last
        by_values = not slopes and self._is_backtracking()
        self._last = self._values_at(vector, x) if by_values else self._slopes_at(vector, x)
        self._evaluations += not is_last
        if self._evaluations > 1 and self._last.finite:
            self._remember(self._last)
        return self._last

    def _remember(self, point: Point) -> None:
        """Keep a finite point if it is the best, or has the gradients of the best."""
        if np.array_equal(point.x, self._best.x) or self._is_better(point, self._best):
            self._best = point
            self._proven = point if point.has_slopes else self._proven

    @property
    def best(self) -> Point:
        """The best point so far, one with finite gradients."""
        if not self._best.has_slopes:
            point = self.evaluate(self._best.x)
            self._best = point if point.finite else self._proven
        return self._best

    def _is_backtracking(self) -> bool:
        """True once a trial was not taken: a motion's value takes a tenth of the time of its gradient, but is one
        more program to compile, which a search does without whose first trials are taken."""
        self._backtracks |= not np.array_equal(self._last.x, self.current.x)
        return self._backtracks and self._evaluate_values is not None

    def _slopes_at(self, vector: Any, x: np.ndarray) -> Point:
        value, *arrays, values = self._evaluate(vector)
        gradient, constraints, jacobian = (np.asarray(part, float) for part in arrays)
        return Point(x, float(value), gradient, constraints, jacobian, *_of_design(values))

    def _values_at(self, vector: Any, x: np.ndarray) -> Point:
        assert self._evaluate_values is not None
        (value, constraints, values), none = self._evaluate_values(vector), np.zeros(0)
        return Point(x, float(value), none, np.asarray(constraints, float), none, *_of_design(values))

    def _is_better(self, point: Point, best: Point) -> bool:
        return point.value < best.value

    def accept(self, point: Point, by_decrease: bool) -> bool:
        """Take a step to a finite point; returns True to stop, by its gradient or also by its decrease."""
        decrease = self.current.value - point.value
        self.current = point
        self._record()
        self._progress.set_postfix_str(f"objective {point.value:.6g}", refresh=False)
        self._progress.update()
        flat = by_decrease and 0 <= decrease <= self.tolerance * abs(point.value)
        if flat or self.is_optimal(self.tolerance):
            self.reason = "converged"
        elif unbounded := self._unbounded_variables(point):
            self.reason = f"unbounded: the objective falls without end along {unbounded}; give it bounds"
        if self._callback is not None and self._callback(self.steps, self._design(point), point.value):
            self.reason = "stopped by callback"
        return bool(self.reason)

    def count(self, evaluations: int) -> None:
        """Count evaluations that a program of its own has made."""
        self._evaluations += evaluations

    @property
    def steps(self) -> int:
        """Number of steps taken."""
        return len(self._history) - 1

    def is_optimal(self, tolerance: float) -> bool:
        """True if the gradient at the current point is below `tolerance` times the objective's scale."""
        return self.gradient_norm <= tolerance * self.objective_scale(self.current)

    def stationarity(self, point: Point) -> np.ndarray:
        """Gradient (n,) that vanishes at an optimum between the bounds."""
        return point.gradient

    @property
    def remaining_decrease(self) -> float:
        """Decrease of the objective from the best point, to first order, as in `History`."""
        return float(np.max(self.variables.predicted_decrease(self.best.x, self.best.gradient)))

    def objective_scale(self, point: Point) -> float:
        """The objective at a point, or the decrease that its gradient predicted at the first design, if larger."""
        first = self.variables.predicted_decrease(self._first.x, self._first.gradient)
        return max(abs(point.value), float(np.max(first)))

    def failure_reason(self) -> str:
        """The reason to report when a line search finds no lower value."""
        return "no further descent" if self._last.finite else "non-finite"

    def optimum(self) -> Optimum:
        """The best point so far as a result."""
        columns = (np.array(column) for column in zip(*self._history, strict=True))
        first, best, variables = self._first, self.best, self.variables
        return Optimum(
            design=self._design(best),
            value=best.value if first.finite else float("nan"),
            initial_design=self._design(first),
            initial_value=first.value,
            history=History(*columns),
            lower=variables.lower,
            upper=variables.upper,
            names=variables.names,
            reason=self.reason or "step limit",
        )

    def _design(self, point: Point) -> PyTree:
        return self.variables.unravel(self.variables.clip(point.x))

    def begin_at(self, point: Point) -> None:
        """Go on from a point, as a step that no optimiser made."""
        self.current, self.reason = point, ""
        self.variables = self.variables._replace(start=point.x)
        self._record()

    def active_rows(self, point: Point) -> tuple[np.ndarray, np.ndarray]:
        """Multipliers (k,) of the rows of the Jacobian at a point, and the constraints (k,) that these are."""
        return np.zeros(0), np.zeros(0, int)

    def _record(self) -> None:
        self.points.append(self.current.x)
        self._history.append((self.current.value, self._optimality(self.current), self._evaluations))

    def _unbounded_variables(self, point: Point) -> str:
        """Names of the variables without bounds that diverge."""
        far = ~self.variables.is_bounded & (np.abs(point.x) > _UNBOUNDED * self.variables.scale)
        return ", ".join(np.array(self.variables.names)[far])

    def _optimality(self, point: Point) -> float:
        return float(np.max(self.variables.predicted_decrease(point.x, point.gradient)))

    def _start_error(self) -> str:
        slopes = zip(self.variables.names, self.current.gradient, strict=True)
        bad = [name for name, slope in slopes if not np.isfinite(slope)]
        also = f", its gradient is not finite for {', '.join(bad)}" if bad else ""
        return f"no search can start at design0: the objective is {self.current.value:g}{also}"


def _of_design(values: tuple) -> tuple[tuple, bool]:
    """Values of the limits, and whether the design is outside of a model's validity."""
    return tuple(np.asarray(v, float) for v in values[:-1]), bool(values[-1])
