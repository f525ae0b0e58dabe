"""Shares of the scatter of an answer by the variables of a stored study, without its function."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.polynomial import hermite_e, legendre

from ..checks import distinct_names, place_of
from ..errors import ModelError
from ..quantities import Axis, Quantity
from ..reports import Report, Reported

_DEGREES = range(1, 9)  # of the polynomials that are tried
_POINTS_OF_A_TERM = 2  # designs that a coefficient needs, so that leaving one out says something


@dataclasses.dataclass(frozen=True, repr=False)
class SobolShares(Reported):
    """Shares of the variance of an answer.

    Attributes:
        first: by variable, what would vanish were it known; total: what would stay were only it unknown.
        explained: part of the variance that the polynomial predicts of designs that it was not fitted to: 1 for all
            of it; shares are as good as this is near 1.
        degree: of the polynomial; mean, deviation: of the answer.
    """

    first: Mapping[str, float]
    total: Mapping[str, float]
    explained: float
    degree: int
    mean: float
    deviation: float

    def report(self) -> Report:
        axis = (Axis("variable", tuple(self.first)),)
        found = [
            Quantity(f"{name} share of", np.array([*part.values()]), "", axis)
            for name, part in (("first", self.first), ("total", self.total))
        ]
        summary = f"polynomial of degree {self.degree}, which explains {self.explained:.4g} of the variance"
        return Report([*found, Quantity("mean", self.mean), Quantity("deviation", self.deviation)], summary)


def sobol_shares(
    found: Any, answer: str, variables: Sequence[str] | None = None, distribution: str = "uniform"
) -> SobolShares:
    """Sobol' shares of an answer of a study (`sweep`, `studies.open`): which variable makes it scatter.

    A polynomial in orthonormal polynomials of the variables is fitted to the designs that gave numbers; its squared
    coefficients are the shares.  Its degree is that which predicts each design best from all others.

    Args:
        found: an `xarray.Dataset` with one dimension of designs, or over a grid.
        answer: name of one number for each design.
        variables: names (default: all of the study that vary).
        distribution: "uniform" over the box of the designs (`grid`, `sobol`, `latin_hypercube`) or "normal"
            (`studies.normal`); variables are independent.

    Source: Sudret 2008, Global sensitivity analysis using polynomial chaos expansions, (38) to (44).

    Raises: UnknownNameError; ModelError for too few designs, an answer with several numbers or without scatter.
    """
    if not hasattr(found, "data_vars"):
        raise ModelError([f"found must be a data set of a study, as `sweep` returns it, not {found!r}"], "the shares")
    if distribution not in _BASES:
        raise ModelError([f"distribution = {distribution!r} is neither 'uniform' nor 'normal'"], "the shares")
    names, points, values = _table(found, answer, variables)
    Z = _BASES[distribution].standardised(points)
    fits = [fit for degree in _DEGREES for fit in _fit(Z, values, degree, distribution)]
    if not fits:
        needed = _POINTS_OF_A_TERM * (len(names) + 1)
        raise ModelError(
            [
                f"{len(values)} designs with numbers are too few for {len(names)} variables: "
                f"{needed} are needed at least"
            ],
            "the shares",
        )
    explained, degree, terms, coefficients = max(fits, key=lambda fit: fit[0])
    squares = coefficients[1:] ** 2
    variance = np.sum(squares)
    orders = np.array(terms[1:])
    alone = np.sum(orders > 0, axis=1) == 1
    first = {n: float(np.sum(squares[alone & (orders[:, k] > 0)]) / variance) for k, n in enumerate(names)}
    total = {n: float(np.sum(squares[orders[:, k] > 0]) / variance) for k, n in enumerate(names)}
    return SobolShares(first, total, float(explained), degree, float(coefficients[0]), float(np.sqrt(variance)))


def _table(found, answer, variables):
    """Names, designs (n, variables) and answers (n,) that are numbers."""
    chosen = found.data_vars[_name_of(found, answer)]
    dims = chosen.dims
    columns = {
        str(name): np.broadcast_to(_over(found[name], dims, chosen.shape), chosen.shape).reshape(-1)
        for name in _design_names(found)
        if found[name].dims and set(found[name].dims) <= set(dims) and found[name].dtype.kind in "iuf"
    }
    varying = {name: x for name, x in columns.items() if np.ptp(x) > 0}
    names = distinct_names("variables", tuple(varying) if variables is None else variables)
    for name in names:
        place_of("variable", name, tuple(varying))
    points, values = np.stack([varying[name] for name in names], axis=1).astype(float), chosen.values.reshape(-1)
    good = np.isfinite(values) & np.all(np.isfinite(points), axis=1)
    if not np.ptp(values[good], axis=0) > 0:
        raise ModelError([f"{answer!r} does not scatter over the designs"], "the shares")
    return names, points[good], values[good].astype(float)


def _name_of(found, answer):
    return tuple(found.data_vars)[place_of("answer", answer, tuple(map(str, found.data_vars)))]


def _design_names(found):
    """Names of the numbers of designs: coordinates of a grid, else the columns that `sweep` puts last."""
    columns = list(found.data_vars)
    return [n for n in found.coords if n != "design"] + columns[
        columns.index("reason") + 1 if "reason" in columns else 0 :
    ]


def _over(column, dims, shape):
    """A coordinate with the dimensions of the answer, of length one where it has none."""
    sizes = [shape[k] if dim in column.dims else 1 for k, dim in enumerate(dims)]
    return column.transpose(*(dim for dim in dims if dim in column.dims)).values.reshape(sizes)


class _Legendre:
    """Orthonormal polynomials over a box."""

    @staticmethod
    def standardised(points):
        low, high = points.min(axis=0), points.max(axis=0)
        return 2 * (points - low) / (high - low) - 1

    @staticmethod
    def values(z, degree):
        return legendre.legvander(z, degree) * np.sqrt(2 * np.arange(degree + 1) + 1)


class _Hermite:
    """Orthonormal polynomials of standard normal numbers."""

    @staticmethod
    def standardised(points):
        return (points - points.mean(axis=0)) / points.std(axis=0)

    @staticmethod
    def values(z, degree):
        factorials = np.cumprod(np.maximum(np.arange(degree + 1), 1.0))
        return hermite_e.hermevander(z, degree) / np.sqrt(factorials)


_BASES: dict[str, Any] = {"uniform": _Legendre, "normal": _Hermite}


def _fit(Z, values, degree, distribution):
    """(part explained of designs left out, degree, orders of the terms, coefficients), of enough designs."""
    variables = Z.shape[1]
    if _POINTS_OF_A_TERM * math.comb(variables + degree, degree) > len(values):
        return
    chosen = (
        c for size in range(degree + 1) for c in itertools.combinations_with_replacement(range(variables), size)
    )
    terms = [tuple(c.count(k) for k in range(variables)) for c in chosen]
    of_each = [_BASES[distribution].values(z, degree) for z in Z.T]
    A = np.prod([table[:, [term[k] for term in terms]] for k, table in enumerate(of_each)], axis=0)
    Q, R = np.linalg.qr(A)
    if np.min(np.abs(np.diag(R))) < 1e-10 * np.max(np.abs(np.diag(R))):  # a grid with fewer values than the degree
        return
    fitted = Q @ (Q.T @ values)
    left_out = (values - fitted) / np.maximum(1 - np.sum(Q**2, axis=1), 1e-12)
    explained = 1 - np.mean(left_out**2) / np.var(values)
    yield explained, degree, terms, np.linalg.solve(R, Q.T @ values)
