"""`identify`: unknowns of a model by weighted least squares, with exact Jacobians."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..checks import number_faults, refuse_complex
from ..design._starts import starting_points
from ..design._variables import AT_BOUND, Variables, read_variables
from ..errors import ModelError
from ..runtime import jit
from ._identification import Identification, _sizes
from ._measurements import Measurements, read_measurements
from ._verdict import spectrum, unseen_directions

#: Steps of Newton's method after the search, which ends where rounding of the sum of squares hides its slope.
POLISHING_STEPS = 60


class _Fit(NamedTuple):
    x: np.ndarray
    cost: float
    reason: str


def identify(
    predict: Callable[[PyTree], PyTree],
    data: PyTree,
    unknowns: PyTree,
    bounds: PyTree | None = None,
    deviations: PyTree | None = None,
    weights: PyTree | None = None,
    prior: PyTree | None = None,
    robust: float | None = None,
    starts: int | str | None = None,
    gradient: str = "forward",
    steps: int = 200,
    largest: float = 1.0,
    compile: str = "full",
) -> Identification:
    """Unknowns of a model from measurements, by weighted least squares; and a verdict on what the data can tell.

    Args:
        predict: function of unknowns like `unknowns` to a pytree like `data`; it is traced.
        data: measured numbers, real or complex, by name or as one array; NaN marks a gap.
        unknowns: first values, any pytree of numbers and arrays, typically a dict.
        bounds: None, or a pytree like `unknowns` with (lower, upper) or None for each leaf.
        deviations: standard deviations of the noise, like the data or one number: chi squared and standard errors are
            absolute.
        weights: relative weights, where deviations are not known; the noise is estimated from what remains.
        prior: None, or a pytree like `unknowns` with (mean, deviation) or None for each leaf; needs `deviations`.
        robust: differences beyond this many deviations count linearly, not squared (Huber); for outliers.
        starts: number of first values, `unknowns` and Sobol points between the bounds; or "stacked".
        gradient: "forward", or "reverse" for more unknowns than data; for motions the mode that `simulate` was given.
        steps: largest number of evaluations of the Jacobian from each start.
        largest: relative standard deviation from which on a direction of the unknowns counts as unseen.
        compile: "full" or "quick", as of `minimise`.

    Returns: values, standard errors, intervals, correlations, and the directions that the data cannot see.

    Raises: ModelError for data, noise or predictions that do not fit; ValueError naming the unknown at fault.
    Source: Bard, Nonlinear parameter estimation (1974).
    """
    measured = read_measurements(data, deviations, weights)
    points = [read_variables(unknowns, bounds)] if starts is None else starting_points(unknowns, bounds, starts)
    variables = points[0]
    priors = _read_prior(variables, prior, unknowns, bounds)
    _check(measured, priors, deviations, robust, gradient, steps, largest)
    residuals, jacobian = _functions(predict, measured, variables, priors, gradient, compile)
    problem = _Problem(residuals, jacobian, variables, np.inf if robust is None else float(robust), int(steps))
    fits = [problem.fit(point.start) for point in points]
    best = min(fits, key=lambda fit: fit.cost)
    if not np.isfinite(best.cost):
        raise ModelError(["the prediction is not finite at any of the first values"], "identify")
    return _identification(problem, measured, best, len(priors[0]), deviations is None, float(largest))


class _Problem(NamedTuple):
    residuals: Callable
    jacobian: Callable
    variables: Variables
    robust: float
    steps: int

    def fit(self, start, held: int | None = None) -> _Fit:
        """Least sum of squares from a start; `held`: an unknown that stays."""
        from scipy.optimize import least_squares

        free = np.array([k for k in range(len(start)) if k != held], int)
        whole = lambda x: _put(start, free, x)  # noqa: E731
        lower, upper = self.variables.lower[free], self.variables.upper[free]
        moving = upper > lower
        free, lower, upper = free[moving], lower[moving], upper[moving]
        first = self.residuals(start)
        if not np.all(np.isfinite(first)):
            return _Fit(start, np.inf, "the prediction is not finite")
        if not len(free):
            return _Fit(start, self.cost(first), "converged")
        options = {} if np.isinf(self.robust) else {"loss": "huber", "f_scale": self.robust}
        found = least_squares(
            lambda x: self.residuals(whole(x)),
            np.clip(start[free], lower, upper),
            lambda x: self.jacobian(whole(x))[:, free],
            bounds=(lower, upper),
            x_scale="jac",
            xtol=1e-14,
            ftol=1e-14,
            gtol=None,
            max_nfev=self.steps,
            **options,
        )
        x, sharp = self.polish(whole(found.x), free)
        reason = "converged" if found.status > 0 or sharp else f"step limit of {self.steps}"
        return _Fit(x, self.cost(self.residuals(x)), reason)

    def cost(self, r: np.ndarray) -> float:
        """Half of chi squared, or Huber's sum."""
        size = np.abs(r)
        near = size <= self.robust
        far = np.where(near, 0.0, size)
        threshold = 0.0 if np.isinf(self.robust) else self.robust
        return float(np.sum(np.where(near, 0.5 * size**2, threshold * (far - 0.5 * threshold))))

    def polish(self, x, free):
        """Newton's steps of the equations `J^T psi(r) = 0`; the point, and whether they ended at rounding."""
        last = np.inf
        for _ in range(POLISHING_STEPS):
            r, J = self.residuals(x), self.jacobian(x)[:, free]
            kept = np.abs(r) <= self.robust
            bent = np.clip(r, -self.robust, self.robust)
            rows = np.vstack([J * kept[:, None], np.zeros((0, len(free)))])
            size = np.linalg.norm(rows, axis=0)
            size = np.where(size > 0, size, 1.0)
            right = np.where(kept, bent, 0.0)
            extra = J[~kept].T @ bent[~kept]  # outliers pull with a constant force
            q, tri = np.linalg.qr(rows / size)
            if np.linalg.cond(tri) > 1e12:
                return x, False
            pull = np.linalg.solve(tri.T, extra / size) if np.any(~kept) else 0.0
            step = -np.linalg.solve(tri, q.T @ right + pull) / size
            trial = _put(x, free, x[free] + step)
            inside = np.all((trial >= self.variables.lower) & (trial <= self.variables.upper))
            length = np.max(np.abs(step) / np.maximum(np.abs(x[free]), 1e-300))
            if not inside or not length < 0.9 * last or not np.all(np.isfinite(self.residuals(trial))):
                return x, last < 1e-8
            x, last = trial, length
            if length < 1e-15:
                return x, True
        return x, last < 1e-8


def _put(x, places, values):
    found = np.array(x, float)
    found[places] = values
    return found


def _functions(predict, measured: Measurements, variables, priors, gradient, compile):
    """Weighted differences (n + priors,) and their Jacobian, of vectors of NumPy."""
    places, means, sigmas = priors

    def differences(x):
        found = measured.flatten(predict(variables.unravel(x)))
        own = (found - measured.values) * measured.weights
        return jnp.concatenate([own, (x[places] - means) / sigmas]) if len(places) else own

    derive = jax.jacfwd if gradient == "forward" else jax.jacrev
    value, slope = jit(differences, compile=compile), jit(derive(differences), compile=compile)
    as_floats = lambda function: lambda x: np.asarray(function(jnp.asarray(x, float)), float)  # noqa: E731
    return as_floats(value), as_floats(slope)


def _read_prior(variables, prior, unknowns, bounds):
    """Places (k,), means and deviations of the unknowns that have a prior."""
    if prior is None:
        return np.zeros(0, int), np.zeros(0), np.zeros(0)
    structure = jax.tree.structure(unknowns)
    try:
        pairs = structure.flatten_up_to(prior)
    except ValueError as error:
        raise ModelError(
            ["the prior must have the parts of the unknowns, with (mean, deviation) or None"], "identify"
        ) from error
    places, means, sigmas, start = [], [], [], 0
    for leaf, pair in zip(jax.tree.leaves(unknowns), pairs, strict=True):
        size = np.size(leaf)
        if pair is not None:
            refuse_complex(pair)
            mean, sigma = (np.broadcast_to(np.asarray(part, float), np.shape(leaf)).ravel() for part in pair)
            if not np.all(np.isfinite(mean) & np.isfinite(sigma) & (sigma > 0)):
                raise ModelError(
                    [f"{variables.names[start]}: a prior needs a mean and a positive deviation"], "identify"
                )
            places += range(start, start + size)
            means += list(mean)
            sigmas += list(sigma)
        start += size
    return np.array(places, int), np.array(means), np.array(sigmas)


def _check(measured, priors, deviations, robust, gradient, steps, largest):
    faults = [] if robust is None else number_faults("robust", robust, positive=True)
    faults += number_faults("largest", largest, positive=True)
    if gradient not in ("forward", "reverse"):
        faults.append(f"gradient must be 'forward' or 'reverse', not {gradient!r}")
    if isinstance(steps, bool) or not isinstance(steps, int | np.integer) or steps < 1:
        faults.append(f"steps must be a positive whole number, not {steps!r}")
    if len(priors[0]) and deviations is None:
        faults.append("a prior needs the deviations of the data: they say how much each of both counts")
    if not len(measured.values):
        faults.append("there are no data but gaps")
    if faults:
        raise ModelError(faults, "identify")


def _identification(problem, measured, best: _Fit, num_priors, is_estimated, largest) -> Identification:
    variables, x = problem.variables, best.x
    width = np.where(variables.is_bounded, variables.scale, np.maximum(np.abs(x), 1e-300))
    at_bound = (x - variables.lower <= AT_BOUND * width) | (variables.upper - x <= AT_BOUND * width)
    r, J = problem.residuals(x), problem.jacobian(x)
    free, n = ~at_bound, len(measured.values)
    freedom = len(r) - int(np.sum(free))
    noise = float(np.sqrt(_variance(r, problem.robust, freedom))) if is_estimated else 1.0
    spread = (
        noise if is_estimated or np.isinf(problem.robust) else float(np.sqrt(_variance(r, problem.robust, freedom)))
    )
    sizes = _sizes(x, variables.lower, variables.upper)
    found = spectrum(J[:, free] / max(spread, np.finfo(float).tiny), sizes[free])
    names = tuple(name for name, one in zip(variables.names, free, strict=True) if one)
    covariance = np.zeros((len(x), len(x)))
    covariance[np.ix_(free, free)] = found.covariance
    return Identification(
        unknowns=variables.unravel(jnp.asarray(x, float)),
        names=variables.names,
        values=x,
        lower=variables.lower,
        upper=variables.upper,
        covariance=covariance,
        unseen=unseen_directions(found, names, largest),
        prediction=measured.unflatten(r[:n] / measured.weights + measured.values),
        chi_squared=float(np.sum(r**2)),
        freedom=freedom,
        noise=noise,
        reason=best.reason,
        is_estimated=is_estimated,
        measurements=measured,
        jacobian=J[:n],
        at_bound=at_bound,
        largest=largest,
        refit=lambda place, value, start: 2 * problem.fit(_put(start, place, value), place).cost,
    )


def _variance(r: np.ndarray, robust: float, freedom: int) -> Any:
    """Variance of the differences; of Huber's sum that of its estimate.  Source: Huber (1981)."""
    if freedom < 1:
        return np.nan
    bent, near = np.clip(r, -robust, robust), np.mean(np.abs(r) <= robust)
    return np.sum(bent**2) / freedom / max(near, 1e-300) ** 2
