"""Least squares by SciPy, and Newton's steps that bring the result to rounding."""

from typing import NamedTuple

import numpy as np

from ..design._variables import Variables
from ._differences import Differences

#: Steps of Newton's method after the search, which ends where rounding of the sum of squares hides its slope.
POLISHING_STEPS = 60
#: Distance from a bound, relative to the unknown's scale, at which one that is driven there is put on it.
NEAR_BOUND = 1e-5
#: Condition of the scaled Jacobian above which no step is taken: some direction is not seen.
BLIND = 1e12


class Fit(NamedTuple):
    """Unknowns (p,), half of chi squared or Huber's sum, and why the search ended."""

    x: np.ndarray
    cost: float
    reason: str


class LeastSquares(NamedTuple):
    """Differences whose squares are to be small.

    Attributes: variables: bounds; robust: size from which on differences count linearly; steps: most Jacobians.
    """

    differences: Differences
    variables: Variables
    robust: float
    steps: int

    def fit(self, start: np.ndarray, held: int | None = None) -> Fit:
        """Least sum of squares from a start (p,); `held`: an unknown that stays."""
        from scipy.optimize import least_squares

        lower, upper = self.variables.lower, self.variables.upper
        free = np.array([k for k in range(len(start)) if k != held and upper[k] > lower[k]], int)
        first = self.differences.at(start)
        if not np.all(np.isfinite(first)):
            return Fit(start, np.inf, "the prediction is not finite")
        if not len(free):
            return Fit(start, self.cost(first), "converged")
        options = {} if np.isinf(self.robust) else {"loss": "huber", "f_scale": self.robust}
        with np.errstate(invalid="ignore", divide="ignore"):  # SciPy divides by zero where nothing is seen
            found = least_squares(
                lambda x: self.differences.at(with_entries(start, free, x)),
                start[free],
                lambda x: self.differences.jacobian(with_entries(start, free, x))[:, free],
                bounds=(lower[free], upper[free]),
                x_scale="jac",
                xtol=1e-14,
                ftol=1e-14,
                gtol=None,
                max_nfev=self.steps,
                **options,
            )
        x, free = self._at_bounds(with_entries(start, free, found.x), free)
        x, is_sharp = self._polish(x, free)
        reason = "converged" if found.status > 0 or is_sharp else f"step limit of {self.steps}"
        return Fit(x, self.cost(self.differences.at(x)), reason)

    def cost(self, r: np.ndarray) -> float:
        """Half of chi squared, or Huber's sum."""
        near = np.minimum(np.abs(r), self.robust)
        return float(np.sum(near * np.abs(r) - 0.5 * near**2))

    def _at_bounds(self, x, free):
        """Unknowns that are driven to their bounds put on them, and those that stay free: SciPy keeps off bounds."""
        v = self.variables
        r, J = self.differences.at(x), self.differences.jacobian(x)
        slope = J.T @ np.clip(r, -self.robust, self.robust)
        reach = NEAR_BOUND * v.move_scale(x)
        low, high = (x - v.lower < reach) & (slope > 0), (v.upper - x < reach) & (slope < 0)
        on = np.where(low, v.lower, np.where(high, v.upper, x))
        return with_entries(x, free, on[free]), free[~(low | high)[free]]

    def _polish(self, x, free):
        """Newton's steps to `J^T psi(r) = 0` while they shrink; the point, and whether they ended at rounding."""
        last = np.inf
        if not len(free):
            return x, True
        for _ in range(POLISHING_STEPS):
            step = self._newton_step(x, free)
            trial = with_entries(x, free, x[free] + step)
            length = np.max(np.abs(step) / np.maximum(np.abs(x[free]), np.finfo(float).tiny))
            inside = np.all((trial >= self.variables.lower) & (trial <= self.variables.upper))
            if not inside or not length < 0.9 * last or not np.all(np.isfinite(self.differences.at(trial))):
                break
            x, last = trial, length
            if length < 4 * np.finfo(float).eps:
                break
        return x, last < 1e-8

    def _newton_step(self, x, free):
        r, J = self.differences.at(x), self.differences.jacobian(x)[:, free]
        near = np.abs(r) <= self.robust
        size = np.linalg.norm(J[near], axis=0)
        size = np.where(size > 0, size, 1.0)
        q, upper = np.linalg.qr(J[near] / size)
        if len(upper) < len(free) or not np.linalg.cond(upper) < BLIND:
            return np.full(len(free), np.nan)
        far = (J[~near] / size).T @ np.clip(r[~near], -self.robust, self.robust)  # pulls with a constant force
        return -np.linalg.solve(upper, q.T @ r[near] + np.linalg.solve(upper.T, far)) / size


def with_entries(x: np.ndarray, places: np.ndarray | int, values: np.ndarray | float) -> np.ndarray:
    """A copy of x with other values at some places."""
    found = np.array(x, float)
    found[places] = values
    return found
