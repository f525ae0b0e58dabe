"""Scatter of the parameters: what it does to an answer, and which of them matters."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from jaxmbs.checks import refuse_complex
from jaxmbs.design.batches import batch
from jaxmbs.design.variables import read_variables
from jaxmbs.math.jit import jit


class Scatter(NamedTuple):
    """An answer under scatter of the parameters.

    Attributes:
        mean, deviation: expected value and standard deviation, in the answer's shape.
        percentile: the value that so many per cent of the designs stay below.
        failed: how many samples gave no number; they are left out.
    """

    mean: np.ndarray
    deviation: np.ndarray
    percentile: np.ndarray
    failed: int


class Tolerance(NamedTuple):
    """What one parameter's tolerance does to an answer.

    Attributes:
        name: of the parameter; tolerance: its half width.
        change: of the answer, by its slope, if the parameter lies at the end of its tolerance.
        share: of the answer's variance, of all parameters one.
    """

    name: str
    tolerance: float
    change: float
    share: float


def scattered(
    function: Callable[[PyTree], Any],
    design: PyTree,
    deviations: PyTree,
    percent: float = 95.0,
    samples: int | None = None,
    seed: int = 0,
    compile: str = "full",
) -> Scatter:
    """An answer where every parameter scatters normally about the design, on its own.

    Args:
        function: of a design to a number or array; it is traced.
        deviations: standard deviations, like `design`; zero for what does not scatter.
        percent: of the percentile.
        samples: so many designs are drawn (Sobol's sequence); default: to first order, by the gradient.
        compile: "full", or "quick", as of `minimise`.

    Raises: ValueError for deviations that do not fit the design or are negative, or `percent` outside of 0 to 100.
    """
    from scipy.stats import norm, qmc

    x, sigma, unravel = _spread(design, deviations, "deviations")
    if not 0.0 < percent < 100.0:
        raise ValueError(f"percent lies between 0 and 100, got {percent}")
    flat = lambda x: function(unravel(x))  # noqa: E731
    if samples is None:
        value, slopes = jit(lambda x: (flat(x), jax.jacfwd(flat)(x)), compile=compile)(jnp.asarray(x, float))
        deviation = np.sqrt(np.sum((np.asarray(slopes) * sigma) ** 2, axis=-1))
        return Scatter(np.asarray(value), deviation, np.asarray(value) + norm.ppf(percent / 100.0) * deviation, 0)
    points = norm.ppf(np.clip(qmc.Sobol(len(x), seed=seed).random(samples), 1e-12, 1.0 - 1e-12))
    found = batch(flat, x + sigma * points, progress=False, compile=compile)
    values = np.asarray(found.values)[found.ok]
    spread = np.std(values, axis=0, ddof=1), np.percentile(values, percent, axis=0)
    return Scatter(np.mean(values, axis=0), *spread, int(np.sum(~found.ok)))


def tolerances(
    function: Callable[[PyTree], Any], design: PyTree, widths: PyTree, compile: str = "full"
) -> list[Tolerance]:
    """Which parameter's tolerance drives a number, the strongest first; to first order.

    Args: function: of a design to one number; widths: half widths of the tolerances, like `design`; compile: as of
    `minimise`.

    Raises: ValueError for widths that do not fit the design or are negative, or an answer that is no number.
    """
    x, width, unravel = _spread(design, widths, "widths")
    slopes = np.asarray(jit(jax.grad(lambda x: function(unravel(x))), compile=compile)(jnp.asarray(x, float)))
    changes = slopes * width
    whole = np.sum(changes**2) or 1.0
    names = read_variables(design, None).names
    rows = [Tolerance(*row) for row in zip(names, width, changes, changes**2 / whole, strict=True)]
    return sorted(rows, key=lambda row: -abs(row.change))


def sensitivities(
    function: Callable[[PyTree], Any],
    bounds: Mapping[str, tuple[float, float]],
    samples: int = 256,
    seed: int = 0,
    compile: str = "full",
) -> dict[str, float]:
    """Mean square of the slope by every parameter over a box, times the square of its width over pi^2 and over the
    answer's variance: above the share of the variance that the parameter takes part in (its total Sobol index).

    Args: compile: as of `minimise`.

    Source: Sobol and Kucherenko's derivative-based global sensitivity measures.

    Raises: ValueError for bounds that cross or are not finite.
    """
    from scipy.stats import qmc

    refuse_complex(dict(bounds))
    lower, upper = np.array(list(bounds.values()), float).reshape(-1, 2).T
    if not (bounds and np.all(np.isfinite(upper - lower)) and np.all(lower <= upper)):
        raise ValueError(f"bounds are finite, (lower, upper), for one parameter at least: {dict(bounds)}")
    points = lower + qmc.Sobol(len(lower), seed=seed).random(samples) * (upper - lower)
    columns = dict(zip(bounds, points.T, strict=True))
    found = batch(jax.value_and_grad(function), columns, progress=False, compile=compile)
    values, slopes = found.values
    good = found.ok
    variance = np.var(values[good], ddof=1) or 1.0
    means = {name: np.mean(np.asarray(slope)[good] ** 2) for name, slope in slopes.items()}
    width = dict(zip(bounds, upper - lower, strict=True))
    return {name: float(mean * width[name] ** 2 / (np.pi**2 * variance)) for name, mean in means.items()}


def _spread(design, widths, what):
    """(design (n,), widths (n,), the way back to a pytree)."""
    variables = read_variables(design, None)
    if jax.tree.structure(widths) != jax.tree.structure(design):
        raise ValueError(f"{what} must have the structure of the design")
    refuse_complex(widths)
    pairs = zip(jax.tree.leaves(widths), jax.tree.leaves(design), strict=True)
    flat = np.concatenate([np.broadcast_to(np.asarray(w, float), np.shape(leaf)).ravel() for w, leaf in pairs])
    if not np.all((flat >= 0.0) & np.isfinite(flat)):
        raise ValueError(f"{what} must not be negative or infinite: {widths}")
    return variables.start, flat, variables.unravel
