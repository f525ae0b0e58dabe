"""Uncertain parameters: propagation to an answer, tolerances, and global sensitivities."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..batching._batch import batch
from ..batching._sampling import normal_points, sobol_points
from ..checks import require_reals
from ..errors import warn
from ..quantities import Axis, Quantity, entries
from ..reports import Report, reported
from ..runtime import TracedFunction, jit
from ..typing import AnyArray, ArrayLike
from ._deviations import read_deviations
from ._variables import read_variables


@reported
class Uncertainty(NamedTuple):
    """An answer under uncertain parameters.

    Attributes:
        mean, deviation: expected value and standard deviation, in the answer's shape.
        percentile: the value that `percent` per cent of the designs lie below.
        failed: number of samples that gave no number; they are left out of the other results.
        samples: (samples, ...) the answers of the samples; None to first order.
    """

    mean: np.ndarray
    deviation: np.ndarray
    percentile: np.ndarray
    failed: int
    samples: np.ndarray | None = None

    def report(self) -> Report:
        arrays = {"mean": self.mean, "standard deviation": self.deviation, "percentile": self.percentile}
        parts = [*(entries(name, values) for name, values in arrays.items()), Quantity("failed samples", self.failed)]
        if self.samples is None:
            return Report(parts, "to first order")
        sample = Axis("sample", np.arange(len(self.samples)))
        return Report([entries("answer", self.samples, "", (sample,)), *parts], f"{len(self.samples)} samples")

    def fraction_within(self, lower: ArrayLike = -np.inf, upper: ArrayLike = np.inf) -> np.ndarray:
        """The yield: the fraction of designs whose answer lies between limits, each entry by itself.

        Samples are counted, failed ones as outside; to first order the answer is taken as normal.
        """
        from scipy.stats import norm

        require_reals((lower, upper))
        low, high = np.asarray(lower, float), np.asarray(upper, float)
        if not np.all(low <= high):
            raise ValueError(f"the limits cross or are not numbers: {lower}, {upper}")
        if self.samples is not None:
            inside = np.sum((low <= self.samples) & (self.samples <= high), axis=0)
            return np.asarray(inside / (len(self.samples) + self.failed))
        certain = (low <= self.mean) & (self.mean <= high)  # for answers without deviation
        sigma = np.where(self.deviation > 0.0, self.deviation, np.nan)
        share = norm.cdf((high - self.mean) / sigma) - norm.cdf((low - self.mean) / sigma)
        return np.where(self.deviation > 0.0, share, certain)


@reported
class Tolerance(NamedTuple):
    """Contribution of one parameter's tolerance to an answer.

    Attributes:
        name: of the parameter; tolerance: its half width.
        change: of the answer, to first order, if the parameter lies at the end of its tolerance.
        share: fraction of the answer's variance; over all parameters the sum is one.
    """

    name: str
    tolerance: float
    change: float
    share: float

    def report(self) -> Report:
        numbers = {
            "tolerance": self.tolerance,
            "change of the answer": self.change,
            "share of the variance": self.share,
        }
        return Report([Quantity(name, value) for name, value in numbers.items()], self.name)


def propagate_uncertainty(
    function: Callable[[PyTree], Any],
    design: PyTree,
    deviations: PyTree,
    percent: float = 95.0,
    samples: int | None = None,
    seed: int = 0,
    compile: str = "auto",
    gradient: str = "forward",
) -> Uncertainty:
    """Distribution of an answer whose parameters are normal and independent about a design.

    Args:
        function: of a design to a number or array; it is traced.
        deviations: standard deviations, like `design`; zero for what is certain.
        percent: of the percentile.
        samples: number of designs drawn, as by `mbs.studies.normal`; default: to first order, by the gradient.
        compile: as of `minimise`.
        gradient: "forward" for few parameters, or "reverse"; for motions the mode that `simulate` was given.

    Returns: an `Uncertainty`; nan for what fewer than two samples with numbers cannot give.

    Raises: ValueError for deviations that do not fit the design or are negative, `percent` outside of 0 to 100, fewer
    than two samples; TypeError for an answer that is no number or array.
    """
    from scipy.stats import norm

    x, sigma, unravel = read_deviations(design, deviations, "deviations")
    _check_gradient(gradient)
    if not 0.0 < percent < 100.0:
        raise ValueError(f"percent must lie between 0 and 100, got {percent}")
    flat = lambda x: _as_real_array(function(unravel(x)))
    if samples is None:
        derive = jax.jacfwd if gradient == "forward" else jax.jacrev
        with_value = derive(lambda x: (flat(x),) * 2, has_aux=True)  # one trace for both
        slopes, value = jit(with_value, compile=compile)(jnp.asarray(x, float))
        deviation = np.sqrt(np.sum((np.asarray(slopes) * sigma) ** 2, axis=-1))
        return Uncertainty(np.asarray(value), deviation, np.asarray(value) + norm.ppf(percent / 100.0) * deviation, 0)
    _check_samples(samples)
    answers = batch(flat, x + sigma * normal_points(len(x), samples, seed), progress=False, compile=compile)
    values = np.asarray(answers.values)[answers.ok]
    unknown = np.full(values.shape[1:], np.nan)
    deviation = np.std(values, axis=0, ddof=1) if len(values) > 1 else unknown
    mean, percentile = (
        (np.mean(values, axis=0), np.percentile(values, percent, axis=0)) if len(values) else (unknown, unknown)
    )
    return Uncertainty(mean, deviation, percentile, int(np.sum(~answers.ok)), values)


def tolerances(
    function: Callable[[PyTree], Any],
    design: PyTree,
    widths: PyTree,
    compile: str = "auto",
    gradient: str = "reverse",
) -> list[Tolerance]:
    """Contributions of the parameters' tolerances to a number, the largest first; to first order.

    Args:
        function: of a design to one number.
        widths: half widths of the tolerances, like `design`.
        compile, gradient: as of `minimise`.

    Raises: ValueError for widths that do not fit the design or are negative, an answer that is no single number or
    not finite, with its gradient, at the design.
    """
    x, width, unravel = read_deviations(design, widths, "widths")
    x = jnp.asarray(x, float)
    program = TracedFunction(lambda x: _as_number(function(unravel(x))), x, compile=compile)
    slope = _value_and_gradient(lambda x: program(x)[0], gradient)
    value, slopes = (np.asarray(part) for part in jit(slope, compile=compile)(x))
    names = read_variables(design, None).names
    bad = [name for name, slope in zip(names, slopes, strict=True) if not np.isfinite(slope)]
    if bad or not np.isfinite(value):
        raise ValueError(f"the answer is {value:g} at the design, its gradient is not finite for: {', '.join(bad)}")
    changes = slopes * width
    whole = np.sum(changes**2) or 1.0
    rows = [Tolerance(*row) for row in zip(names, width, changes, changes**2 / whole, strict=True)]
    return sorted(rows, key=lambda row: -abs(row.change))


def sensitivities(
    function: Callable[[PyTree], Any],
    bounds: Mapping[str, tuple[float, float]],
    samples: int = 256,
    seed: int = 0,
    compile: str = "auto",
    gradient: str = "reverse",
) -> dict[str, float]:
    """Derivative-based global sensitivity of every parameter over a box: an upper bound of its total Sobol index.

    That is the mean square of the derivative, times the square of the width over pi^2 and over the answer's variance.

    Args: compile, gradient: as of `minimise`.

    Source: Sobol and Kucherenko's derivative-based global sensitivity measures.

    Raises: ValueError for bounds that cross or are not finite, fewer than two samples (or than two that gave
    numbers), or an answer that is no single number.  Warns of samples without numbers, which are left out.
    """
    require_reals(dict(bounds))
    _check_samples(samples)
    lower, upper = np.array(list(bounds.values()), float).reshape(-1, 2).T
    if not (bounds and np.all(np.isfinite(upper - lower)) and np.all(lower <= upper)):
        raise ValueError(f"bounds must be finite (lower, upper), for at least one parameter: {dict(bounds)}")
    points = lower + sobol_points(len(lower), samples, seed) * (upper - lower)
    columns = dict(zip(bounds, points.T, strict=True))
    answers = batch(_value_and_gradient(function, gradient), columns, progress=False, compile=compile)
    values, slopes = answers.values
    good = answers.ok
    if np.sum(good) < 2:
        raise ValueError(
            f"{np.sum(good)} of {samples} designs gave numbers, at least two are needed\n{answers.summary()}"
        )
    if not np.all(good):
        warn(f"{np.sum(~good)} of {samples} designs gave no numbers and are left out")
    variance = np.var(values[good], ddof=1) or 1.0
    means = {name: np.mean(np.asarray(slope)[good] ** 2) for name, slope in slopes.items()}
    width = dict(zip(bounds, upper - lower, strict=True))
    return {name: float(mean * width[name] ** 2 / (np.pi**2 * variance)) for name, mean in means.items()}


def _value_and_gradient(function, gradient) -> Callable:
    """A function of a design that returns (its number, its gradient)."""
    _check_gradient(gradient)

    def number(design):
        return _as_number(function(design))

    if gradient == "reverse":
        return jax.value_and_grad(number)
    slopes_and_value = jax.jacfwd(lambda design: (number(design),) * 2, has_aux=True)  # one trace for both
    return lambda design: slopes_and_value(design)[::-1]


def _as_number(value):
    number = _as_real_array(value)
    if number.ndim:
        raise ValueError(f"the function returned an array of shape {number.shape}: return one number")
    return number


def _as_real_array(value):
    """The return value of a function as an array of real numbers."""
    if not isinstance(value, AnyArray | float | int) or jnp.iscomplexobj(value):
        raise TypeError(f"the function returned a {type(value).__name__}: return one real number or array")
    return jnp.asarray(value, float)


def _check_gradient(gradient):
    if gradient not in ("reverse", "forward"):
        raise ValueError(f"gradient must be 'reverse' or 'forward', not {gradient!r}")


def _check_samples(samples):
    if isinstance(samples, bool) or not isinstance(samples, int | np.integer) or samples < 2:
        raise ValueError(f"samples must be a whole number of at least two, got {samples!r}")
