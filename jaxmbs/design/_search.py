"""The book that every optimiser keeps: evaluations, the best design so far, history, and when to stop."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from ._optimum import History, Optimum
from ._variables import Variables

#: A variable without bounds that has grown by so much, while the objective fell, is not looking for a minimum.
_UNBOUNDED = 1e10


class Point(NamedTuple):
    """Objective and gradient (n,) at the variables x (n,); with limits their excess (m,), its gradients (k, n) for
    the rows that the search looks at, and the limits' values."""

    x: np.ndarray
    value: float
    gradient: np.ndarray
    excess: np.ndarray
    slopes: np.ndarray
    values: tuple

    @property
    def finite(self) -> bool:
        """Whether objective, limits and gradients are finite."""
        return all(bool(np.all(np.isfinite(part))) for part in self[1:5])

    @property
    def violation(self) -> float:
        """The largest excess of a limit, zero where all are kept."""
        return float(np.max(self.excess, initial=0.0))


class Search:
    """One optimisation on the host; optimisers call `evaluate` at trial points and `accept` after each step.

    Attributes:
        variables: the variables and their bounds.
        current: the point accepted last.
        reason: why the search has ended, empty while it goes on.

    Args: may_fail: whether a start without finite values ends the search at once, in place of an error.
    """

    def __init__(
        self,
        evaluate: Callable,
        variables: Variables,
        tolerance: float,
        callback: Callable[[int, PyTree, float], Any] | None,
        progress: tqdm,
        may_fail: bool = False,
    ):
        self.variables, self.reason = variables, ""
        self._evaluate, self._tolerance = evaluate, tolerance
        self._callback, self._progress = callback, progress
        self._evaluations, self._history = 0, []
        self.current = self._last = self._best = self._first = self.evaluate(variables.start)
        if not self.current.finite:
            self.reason = self._complaint()
            if not may_fail:
                raise ValueError(self.reason)
        self._note()
        if not self.reason and self.is_optimal(0.0):
            self.reason = "converged"

    @property
    def functions(self) -> tuple[tuple[str, ...], np.ndarray]:
        """Names of what the points have gradients of, and which entries of their excess these are."""
        return ("objective",), np.zeros(0, int)

    @property
    def gradient_norm(self) -> float:
        """Size of the projected gradient at the current point, as in `History`."""
        return self._history[-1][1]

    def evaluate(self, x: np.ndarray) -> Point:
        """Objective and gradient at a trial point, brought within the bounds; the best one is kept."""
        vector = self.variables.vector(x)
        x = np.asarray(vector, float)
        if self._evaluations and np.array_equal(x, self._last.x):
            return self._last
        value, gradient, excess, slopes, values = self._evaluate(vector)
        gradient, excess, slopes = (np.asarray(part, float) for part in (gradient, excess, slopes))
        self._last = Point(x, float(value), gradient, excess, slopes, tuple(np.asarray(v, float) for v in values))
        self._evaluations += 1
        if self._evaluations > 1 and self._last.finite and self._is_better(self._last, self._best):
            self._best = self._last
        return self._last

    def _is_better(self, point: Point, best: Point) -> bool:
        return point.value < best.value

    def accept(self, point: Point, by_decrease: bool) -> bool:
        """Take a step to a finite point; whether to stop, by its gradient or also by its decrease."""
        decrease = self.current.value - point.value
        self.current = point
        self._note()
        self._progress.set_postfix_str(f"objective {point.value:.6g}", refresh=False)
        self._progress.update()
        flat = by_decrease and 0 <= decrease <= self._tolerance * abs(point.value)
        if flat or self.is_optimal(self._tolerance):
            self.reason = "converged"
        elif endless := self._endless(point):
            self.reason = f"unbounded: the objective falls without end along {endless}; give it bounds"
        if self._callback is not None and self._callback(self.steps, self._tree(point), point.value):
            self.reason = "stopped by callback"
        return bool(self.reason)

    @property
    def steps(self) -> int:
        """How many were taken."""
        return len(self._history) - 1

    def is_optimal(self, tolerance: float) -> bool:
        """Whether the gradient has vanished at the current point, but for `tolerance` of the objective."""
        return self.gradient_norm <= tolerance * self.size_of(self.current)

    def size_of(self, point: Point) -> float:
        """The objective at a point, or the fall that its slope promised at the first design where that is larger."""
        return max(
            abs(point.value), float(np.max(self.variables.predicted_decrease(self._first.x, self._first.gradient)))
        )

    def stuck(self) -> str:
        """The reason when a line search finds no lower value."""
        return "no further descent" if self._last.finite else "non-finite"

    def optimum(self) -> Optimum:
        """The best point so far as a result."""
        columns = (np.array(column) for column in zip(*self._history, strict=True))
        first, best, variables = self._first, self._best, self.variables
        return Optimum(
            design=self._tree(best),
            value=best.value if first.finite else float("nan"),
            initial_design=self._tree(first),
            initial_value=first.value,
            history=History(*columns),
            lower=variables.lower,
            upper=variables.upper,
            names=variables.names,
            reason=self.reason or "step limit",
        )

    def _tree(self, point: Point) -> PyTree:
        return self.variables.unravel(self.variables.vector(point.x))

    def _note(self) -> None:
        self._history.append((self.current.value, self._norm(self.current), self._evaluations))

    def _endless(self, point: Point) -> str:
        """Names of the variables without bounds that run away."""
        far = ~self.variables.is_closed & (np.abs(point.x) > _UNBOUNDED * self.variables.scale)
        return ", ".join(np.array(self.variables.names)[far])

    def _norm(self, point: Point) -> float:
        return float(np.max(self.variables.predicted_decrease(point.x, point.gradient)))

    def _complaint(self) -> str:
        slopes = zip(self.variables.names, self.current.gradient, strict=True)
        bad = [name for name, slope in slopes if not np.isfinite(slope)]
        also = f", its gradient is not finite for {', '.join(bad)}" if bad else ""
        return f"no search can start at design0: the objective is {self.current.value:g}{also}"
