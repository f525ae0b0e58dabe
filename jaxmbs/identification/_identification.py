"""Result of an identification: values, their uncertainty, and what the data cannot tell."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import PyTree

from ..checks import place_of, require_reals
from ..design._variables import units_by_name
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..tables import format_number
from ..typing import ArrayLike
from ._measurements import Measurements
from ._verdict import Direction, spectrum, unseen_directions

#: Probability of a chi squared as large, below which the model does not fit.
MISFIT = 1e-6


def _table_rows(found):
    low, high = found.intervals().T
    rows = [
        (name, format_number(x), format_number(s), f"{format_number(a)} to {format_number(b)}", note)
        for name, x, s, a, b, note in zip(
            found.names, found.values, found.standard_errors, low, high, found.notes(), strict=True
        )
    ]
    rows = [("unknown", "value", "standard error", "95 % interval", ""), *rows]
    if any(found.units):
        rows = [(*row[:-1], unit or "-", row[-1]) for row, unit in zip(rows, ("unit", *found.units), strict=True)]
    return found.summary(), rows


class Identification(Reported, eqx.Module):
    """Unknowns from measurements, with a verdict.

    Attributes:
        unknowns: the values found, like the first ones.
        names, values: of the scalar unknowns (p,); lower, upper: their bounds.
        covariance: (p, p) of the unknowns, to first order; infinite where the data see nothing, NaN where a bound
            cuts one off and for a search that did not converge, zero for what equal bounds fix.
        unseen: directions that the data cannot tell from noise.
        prediction: at the values found, like the data; NaN at gaps.
        chi_squared: sum of squares of the weighted differences, priors included.
        freedom: degrees of freedom: numbers measured and priors, less the unknowns that are free.
        noise: standard deviation of weighted differences: 1 where deviations are given, else estimated.
        reason: "converged", or why the search ended.
        is_estimated: True where the noise is estimated (static).
        measurements: the data as one vector.
        jacobian: (n, p) of the weighted predictions by the unknowns.
        at_bound: (p,) true for unknowns at a bound, which count as known: the others' errors are as if they were.
        misfit: probability of a chi squared as large, if the deviations given are right; one where the noise is
            estimated, or outliers count less.
        largest: relative deviation from which on a direction counts as unseen (static).
        refit: least sum of squares with one unknown held (static).
        units: of the unknowns; empty where they are not known, see `with_units` (static).
    """

    unknowns: PyTree
    names: tuple[str, ...] = eqx.field(static=True)
    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    covariance: np.ndarray
    unseen: tuple[Direction, ...]
    prediction: PyTree
    chi_squared: float
    freedom: int = eqx.field(static=True)
    noise: float
    reason: str = eqx.field(static=True)
    is_estimated: bool = eqx.field(static=True)
    measurements: Measurements
    jacobian: np.ndarray
    at_bound: np.ndarray
    misfit: float
    largest: float = eqx.field(static=True)
    refit: Callable = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True, default=())

    def with_units(self, units: Mapping[str, str]) -> "Identification":
        """The same result with units in its tables, `with_units({"mass": "kg"})`, an array's for all of its entries.

        Raises: UnknownNameError; TypeError for a unit that is no word.
        """
        return dataclasses.replace(self, units=units_by_name(self.names, units))

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        unknown = (Axis("unknown", self.names),)
        columns = {"value": self.values, "standard error": self.standard_errors}
        columns |= {"lower": self.lower, "upper": self.upper}
        fit = {"chi squared": self.chi_squared, "freedom": self.freedom, "noise": self.noise}
        found = [Quantity(*pair, "", unknown) for pair in columns.items()]
        found += [Quantity(*pair) for pair in fit.items()]
        return Report(found, summary, self._fault(), table=rows)

    def _fault(self):
        """The gravest fault of a result that is not `ok`; empty for others."""
        if self.unseen:
            return "the unknowns are not determined"
        if self.reason != "converged":
            return "the search did not converge"
        if np.any(self.is_cut_off):
            return "a bound cuts an unknown off"
        return "" if self.ok else "the measurements are farther from the model than their deviations allow"

    @property
    def ok(self) -> bool:
        """True if the search converged, the data determine every unknown, no bound cuts one off, and chi squared is
        no larger than the deviations allow."""
        converged = self.reason == "converged" and not self.unseen
        return converged and not np.any(self.is_cut_off) and self.misfit >= MISFIT

    @property
    def is_cut_off(self) -> np.ndarray:
        """True (p,) for unknowns at a bound that could be moved: the least sum of squares may lie beyond it."""
        return np.asarray(self.at_bound & (self.lower < self.upper))

    @property
    def rank(self) -> int:
        """Number of directions that the data see."""
        return len(self.names) - int(np.sum(self.at_bound)) - len(self.unseen)

    @property
    def standard_errors(self) -> np.ndarray:
        """Standard errors (p,) of the unknowns; NaN for those that a bound cuts off."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def correlations(self) -> np.ndarray:
        """Correlations (p, p) of the unknowns; NaN where one is not determined."""
        size = self.standard_errors
        size = np.where((size > 0) & np.isfinite(size), size, np.nan)
        return self.covariance / np.outer(size, size)

    def standard_error(self, name: str) -> float:
        """Standard error of an unknown.  Raises: UnknownNameError."""
        return float(self.standard_errors[place_of("unknown", name, self.names)])

    def intervals(self, percent: float = 95.0) -> np.ndarray:
        """Confidence intervals (p, 2), to first order: Student's where the noise is estimated, else normal."""
        half = self._quantile(percent) * self.standard_errors
        return np.stack([self.values - half, self.values + half], axis=1)

    def prediction_band(self, percent: float = 95.0) -> PyTree:
        """Half widths of the band of the true prediction, like the data; of directions that are seen."""
        seen = np.where(np.isfinite(self.covariance), self.covariance, 0.0)
        rows = self.jacobian / self.measurements.weights[:, None]
        return self.measurements.unflatten(
            self._quantile(percent) * np.sqrt(np.einsum("np,pq,nq->n", rows, seen, rows))
        )

    def profile(self, name: str, values: ArrayLike) -> np.ndarray:
        """Profile of chi squared (k,): its least value with an unknown held at each value.

        Where it rises by 3.84 (times `noise` squared) over the least one lies the end of the 95 % interval, however
        crooked the model is.  Raises: UnknownNameError.
        """
        place = place_of("unknown", name, self.names)
        require_reals(values)
        return np.array([self.refit(place, float(value)) for value in np.asarray(values, float)])

    def with_experiment(self, jacobian: ArrayLike) -> tuple[Direction, ...]:
        """Directions that stay unseen if a further experiment is added.

        Args: jacobian: (m, p) of its predictions by the unknowns, over the deviation of its noise.
        """
        require_reals(jacobian)
        free = ~self.at_bound
        whole = np.vstack([self.jacobian / self.noise, np.asarray(jacobian, float)])[:, free]
        names = [name for name, one in zip(self.names, free, strict=True) if one]
        return unseen_directions(
            spectrum(whole, _sizes(self.values, self.lower, self.upper)[free]), names, self.largest
        )

    def notes(self) -> list[str]:
        """A word on every unknown: at a bound, fixed by equal ones, or less certain than its own size."""
        doubtful = self.standard_errors > self.largest * _sizes(self.values, self.lower, self.upper)
        marks = zip(self.at_bound, self.is_cut_off, doubtful, strict=True)
        words = ("at its bound, cut off", "at its bound, fixed", "not determined", "")
        return [words[0 if cut else 1 if bound else 2 if one else 3] for bound, cut, one in marks]

    def summary(self) -> str:
        """The verdict in sentences."""
        told = [f"{self.reason}; {self.rank} of {len(self.names)} directions seen"]
        over = f"over {self.freedom} degrees of freedom"
        if self.is_estimated:
            told.append(f"noise of {format_number(self.noise)} estimated by the residuals {over}")
        else:
            told.append(f"chi squared {format_number(self.chi_squared)} {over}")
        if np.any(self.is_cut_off):
            places = zip(self.names, self.values, self.is_cut_off, strict=True)
            cut = ", ".join(f"{name} = {format_number(x)}" for name, x, mark in places if mark)
            told.append(f"A bound cuts off {cut}: the best fit may lie beyond, widen the bound or fix the unknown")
        if self.misfit < MISFIT:
            told.append(
                "chi squared is far above its degrees of freedom: the model does not fit, or the deviations are too "
                "small; standard errors do not hold"
            )
        for one in self.unseen:
            seen = "not seen at all" if np.isinf(one.deviation) else f"seen to {100 * one.deviation:.3g} % only"
            told.append(f"{one.text} is {seen}: give {one.remedy} a prior or fix it")
        return ". ".join(told)

    def _quantile(self, percent: float) -> Any:
        from scipy import stats

        if not 0 < percent < 100:
            raise ValueError(f"percent must lie between 0 and 100, got {percent}")
        share = 0.5 + percent / 200
        return stats.t.ppf(share, self.freedom) if self.is_estimated else stats.norm.ppf(share)


def _sizes(values, lower, upper):
    """Sizes (p,) that relative changes of the unknowns refer to; of a zero its bounds' width, or one."""
    width = np.where(np.isfinite(upper - lower), upper - lower, 1.0)
    return np.where(values != 0, np.abs(values), np.where(width > 0, width, 1.0))
