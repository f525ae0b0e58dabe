"""Directions of the unknowns that measurements see, and those that they do not."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.linalg

from ..quantities import Quantity
from ..reports import Report, reported

#: Relative size of a singular value below which a direction is not seen at all: rounding.
ROUNDING = 1e-10
#: Terms of a direction that are left out, relative to the largest.
SMALL = 1e-3
#: Terms of a direction that its text shows.
MOST_TERMS = 5


@reported
class Direction(NamedTuple):
    """Change of the unknowns that leaves the predictions within the noise.

    Attributes:
        text: the change in words, "boom.mass + 0.31 stick.mass"; coefficients: by name of unknown.
        deviation: standard deviation along it, relative to the unknowns' sizes; infinite where nothing changes.
        remedy: the unknown that shows the most of it: give it a prior, fix it, or measure what depends on it.
    """

    text: str
    coefficients: dict[str, float]
    deviation: float
    remedy: str

    def report(self) -> Report:
        found = [Quantity("deviation", self.deviation), *(Quantity(*pair) for pair in self.coefficients.items())]
        return Report(found, f"{self.text}; prior, value or measurement wanted of {self.remedy}")


class Spectrum(NamedTuple):
    """Singular values of the weighted Jacobian by relative changes of the unknowns.

    Attributes:
        values: (p,) falling, zero where rounding alone is left; shapes: (p, p) relative changes, a row for each.
        scale: (p,) sizes of the unknowns.
    """

    values: np.ndarray
    shapes: np.ndarray
    scale: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (p, p) of the unknowns; infinite on the diagonal where nothing is seen."""
        seen = self.values > 0
        inverse = np.where(seen, 1.0 / np.where(seen, self.values, 1.0), 0.0)
        root = self.scale[:, None] * (self.shapes.T * inverse)
        found = root @ root.T
        blind = np.any(np.abs(self.shapes[~seen]) > 1e-6, axis=0)
        found[blind, :] = found[:, blind] = np.nan
        found[blind, blind] = np.inf
        return found


def spectrum(jacobian: np.ndarray, scale: np.ndarray) -> Spectrum:
    """Singular values of a weighted Jacobian (n, p) at unknowns of the given sizes (p,)."""
    p = len(scale)
    padded = np.vstack([jacobian * scale, np.zeros((max(p - len(jacobian), 0), p))])
    _, values, shapes = np.linalg.svd(padded, full_matrices=False)
    values = np.where(values > ROUNDING * max(values[0], np.finfo(float).tiny), values, 0.0)
    return Spectrum(values, shapes, scale)


def unseen_directions(found: Spectrum, names: Sequence[str], largest: float) -> tuple[Direction, ...]:
    """Directions whose relative deviation exceeds the `largest`, the least visible first."""
    blind = _few_terms(found.shapes[found.values == 0])
    weak = [k for k in range(len(names)) if 0 < found.values[k] < 1 / largest]
    rows = [(np.inf, row) for row in blind] + [(1 / found.values[k], found.shapes[k]) for k in weak[::-1]]
    return tuple(_direction(row, deviation, found.scale, names) for deviation, row in rows)


def _few_terms(rows):
    """A basis of the space of the rows with a unit matrix in it: each names as few unknowns as can be told."""
    if not len(rows):
        return rows
    pivots = scipy.linalg.qr(rows, pivoting=True, mode="r")[1][: len(rows)]
    return np.linalg.solve(rows[:, pivots], rows)


def _direction(row, deviation, scale, names):
    largest = np.max(np.abs(row))
    order = [k for k in np.argsort(-np.abs(row), kind="stable") if abs(row[k]) > SMALL * largest]
    change = row * scale
    change = change / change[order[0]]
    terms = []
    for k in order[:MOST_TERMS]:
        size = "" if k == order[0] else f"{abs(change[k]):.3g} "
        sign = " - " if change[k] < 0 else " + " if terms else ""
        terms.append(f"{sign}{size}{names[k]}")
    coefficients = {names[k]: float(change[k]) for k in order}
    rest = order[MOST_TERMS:]
    more = f" and {len(rest)} more" if len(rest) else ""
    return Direction("".join(terms) + more, coefficients, float(deviation), names[order[0]])
