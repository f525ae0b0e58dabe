"""`identify`: unknowns of a model by weighted least squares, with exact Jacobians."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..batching._table import num_designs, read_designs
from ..checks import number_faults, require_reals
from ..design._starts import starting_points
from ..design._variables import AT_BOUND, read_variables
from ..errors import ModelError
from ..runtime import kept_tiers
from ._differences import Differences, Predictions, Prior
from ._fit import LeastSquares, with_entries
from ._identification import Identification, _sizes
from ._measurements import LeafLayout, read_measurements
from ._verdict import spectrum, unseen_directions


@kept_tiers()
def identify(
    predict: Callable[..., PyTree],
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
    compile: str = "auto",
    experiments: PyTree | None = None,
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
        compile: as of `minimise`.
        experiments: initial states, inputs and loads of several experiments, a pytree of arrays whose leading axis is
            that of all data; `predict` is then a function of the unknowns and one experiment, run by `batch`.

    Returns: values, standard errors, intervals, correlations, and the directions that the data cannot see.

    Raises: ModelError for data, noise or predictions that do not fit; ValueError naming the unknown at fault.
    Source: Bard, Nonlinear parameter estimation (1974).
    """
    count = None if experiments is None else num_designs(experiments := read_designs(experiments))
    measured = read_measurements(data, deviations, weights, count)
    points = [read_variables(unknowns, bounds)] if starts is None else starting_points(unknowns, bounds, starts)
    variables = points[0]
    layout = _layout(unknowns, starts)
    priors = _read_prior(variables, prior, layout)
    _check(measured, priors, deviations, robust, gradient, steps, largest)
    predictions = Predictions(predict, layout, measured.layout, experiments, gradient, compile)
    differences = Differences(predictions, measured, priors)
    problem = LeastSquares(differences, variables, np.inf if robust is None else float(robust), int(steps))
    fits = [problem.fit(point.start) for point in points]
    best = min(fits, key=lambda fit: fit.cost)
    if not np.isfinite(best.cost):
        raise ModelError(
            [f"the prediction is not finite at any of the first values{_failed(problem, points)}"], "identify"
        )
    return _identification(problem, measured, best, deviations is None, float(largest))


def _failed(problem, points):
    """Experiments that fail, in words."""
    measured = problem.differences.measured
    if measured.experiments is None:
        return ""
    found = problem.differences.predictions.at(points[0].start).reshape(measured.experiments, -1)
    bad = np.flatnonzero(~np.all(np.isfinite(found), axis=1))
    return f": experiments {', '.join(map(str, bad))} fail"


def _layout(unknowns, starts):
    """Layout of the unknowns, of one start where many are stacked."""
    leaves, structure = jax.tree.flatten(unknowns)
    shapes = tuple(np.shape(x)[1:] if starts == "stacked" else np.shape(x) for x in leaves)
    return LeafLayout(structure, ("",) * len(leaves), shapes, (False,) * len(leaves))


def _read_prior(variables, prior, layout):
    """Places (k,), means and deviations of the unknowns that have a prior."""
    if prior is None:
        return Prior(np.zeros(0, int), np.zeros(0), np.zeros(0))
    try:
        pairs = layout.structure.flatten_up_to(prior)
    except ValueError as error:
        raise ModelError(
            ["the prior must have the parts of the unknowns, with (mean, deviation) or None"], "identify"
        ) from error
    places, means, sigmas, start = [], [], [], 0
    for shape, pair in zip(layout.shapes, pairs, strict=True):
        size = int(np.prod(shape))
        if pair is not None:
            require_reals(pair)
            mean, sigma = (np.broadcast_to(np.asarray(part, float), shape).ravel() for part in pair)
            if not np.all(np.isfinite(mean) & np.isfinite(sigma) & (sigma > 0)):
                raise ModelError(
                    [f"{variables.names[start]}: a prior needs a mean and a positive deviation"], "identify"
                )
            places += range(start, start + size)
            means += list(mean)
            sigmas += list(sigma)
        start += size
    return Prior(np.array(places, int), np.array(means), np.array(sigmas))


def _check(measured, priors, deviations, robust, gradient, steps, largest):
    faults = [] if robust is None else number_faults("robust", robust, positive=True)
    faults += number_faults("largest", largest, positive=True)
    if gradient not in ("forward", "reverse"):
        faults.append(f"gradient must be 'forward' or 'reverse', not {gradient!r}")
    if isinstance(steps, bool) or not isinstance(steps, int | np.integer) or steps < 1:
        faults.append(f"steps must be a positive whole number, not {steps!r}")
    if len(priors.places) and deviations is None:
        faults.append("a prior needs the deviations of the data: they say how much each of both counts")
    if not len(measured.values):
        faults.append("there are no data but gaps")
    if faults:
        raise ModelError(faults, "identify")


def _identification(problem, measured, best, is_estimated, largest) -> Identification:
    from scipy.stats import chi2

    variables, x = problem.variables, best.x
    width = np.where(variables.is_bounded, variables.scale, np.maximum(np.abs(x), 1e-300))
    at_bound = (x - variables.lower <= AT_BOUND * width) | (variables.upper - x <= AT_BOUND * width)
    r, J = problem.differences.at(x), problem.differences.jacobian(x)
    free, n = ~at_bound, len(measured.values)
    freedom = len(r) - int(np.sum(free))
    spread = float(np.sqrt(_variance(r, problem.robust, freedom)))
    noise = spread if is_estimated else 1.0
    spread = spread if is_estimated or np.isfinite(problem.robust) else 1.0
    sizes = _sizes(x, variables.lower, variables.upper)
    found = spectrum(J[:, free] / max(spread, np.finfo(float).tiny), sizes[free])
    names = tuple(name for name, one in zip(variables.names, free, strict=True) if one)
    covariance = np.zeros((len(x), len(x)))
    covariance[np.ix_(free, free)] = found.covariance
    cut_off = at_bound & (variables.lower < variables.upper)
    covariance[cut_off, :] = covariance[:, cut_off] = np.nan
    if best.reason != "converged":
        covariance[:] = np.nan
    chi_squared = float(np.sum(r**2))
    is_judged = not is_estimated and np.isinf(problem.robust) and freedom > 0
    return Identification(
        unknowns=variables.unravel(jnp.asarray(x, float)),
        names=variables.names,
        values=x,
        lower=variables.lower,
        upper=variables.upper,
        covariance=covariance,
        unseen=unseen_directions(found, names, largest),
        prediction=measured.unflatten(r[:n] / measured.weights + measured.values),
        chi_squared=chi_squared,
        freedom=freedom,
        noise=noise,
        reason=best.reason,
        is_estimated=is_estimated,
        measurements=measured,
        jacobian=J[:n],
        at_bound=at_bound,
        misfit=float(chi2.sf(chi_squared, freedom)) if is_judged else 1.0,
        largest=largest,
        refit=lambda place, value: 2 * problem.fit(with_entries(x, place, value), place).cost,
    )


def _variance(r: np.ndarray, robust: float, freedom: int) -> Any:
    """Variance of the differences; of Huber's sum that of its estimate.  Source: Huber (1981)."""
    if freedom < 1:
        return np.nan
    bent, near = np.clip(r, -robust, robust), np.mean(np.abs(r) <= robust)
    return np.sum(bent**2) / freedom / max(near, 1e-300) ** 2
