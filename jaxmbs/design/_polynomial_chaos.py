"""`polynomial_chaos`: mean, deviation and Sobol' shares of an answer under random numbers, with derivatives."""

import dataclasses
import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..checks import count_faults, number_faults
from ..errors import ModelError
from ..probability import RandomVariables
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import kept_tiers
from ._chaos_basis import ChaosBasis
from ._chaos_fit import ChaosFit, fit_chaos
from ._chaos_slopes import coefficient_slopes
from ._limit_state import read_variables, trace_limit_state


@dataclasses.dataclass(frozen=True, repr=False)
class PolynomialChaos(Reported):
    """An answer as a polynomial of independent random numbers, and what follows from it.

    Attributes:
        mean, deviation: of the answer.
        first: by variable, the share of the variance that would vanish were it known; total: what would stay were
            only it unknown; pairs: by pair of names, the share of both together beyond those of each.
        derivatives: of "mean", "deviation" and of "first a", "total a" of each variable a, by variable: by "mean",
            "deviation" and each parameter of its distribution.
        error: root mean square error of the polynomial at points that it was not fitted to, over the deviation.
        evaluations: of the function with its gradient; failed: those that gave no number, which are left out.
        terms: of the polynomial, which is `fit`.
        faults: what makes the result doubtful, in sentences.
    """

    mean: float
    deviation: float
    first: Mapping[str, float]
    total: Mapping[str, float]
    pairs: Mapping[tuple[str, str], float]
    derivatives: Mapping[str, Mapping[str, Mapping[str, float]]]
    error: float
    evaluations: int
    failed: int
    terms: int
    fit: ChaosFit
    faults: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """True if nothing makes the result doubtful."""
        return not self.faults

    def report(self) -> Report:
        axis = (Axis("variable", tuple(self.first)),)
        found = [Quantity("mean", self.mean), Quantity("deviation", self.deviation)]
        for name, part in (("first", self.first), ("total", self.total)):
            found.append(Quantity(f"{name} share of", np.array([*part.values()]), "", axis))
        if self.pairs:
            labels = Axis("pair", tuple(", ".join(pair) for pair in self.pairs))
            found.append(Quantity("share together of", np.array([*self.pairs.values()]), "", (labels,)))
        found.append(Quantity("error", self.error))
        summary = f"polynomial of {self.terms} terms, {self.evaluations} gradients"
        return Report(found, summary, "; ".join(self.faults))


@kept_tiers()
def polynomial_chaos(
    function: Callable[[dict], Any],
    variables: Mapping[str, Any] | RandomVariables,
    tolerance: float = 1e-3,
    evaluations: int = 2000,
    seed: int = 0,
    gradient: str = "reverse",
    compile: str = "auto",
) -> PolynomialChaos:
    """Mean, deviation and Sobol' shares of a function of independent random numbers, by a sparse polynomial.

    The polynomial is fitted to values and gradients at Sobol' points, and grows from the terms that matter; points
    that it was not fitted to say how good it is.  Derivatives by parameters of distributions are those of the
    polynomial and cost no further evaluation.

    Args:
        function: of a dict of the variables to a number; it is traced.
        variables: distributions by name (`mbs.probability`), without correlations.
        tolerance: root mean square error that is allowed, over the deviation.
        evaluations: of the function with its gradient, at most.
        seed: of the points.
        gradient, compile: as of `minimise`.

    Raises: ModelError, TypeError, ValueError for what is none of these.

    Source: Sudret 2008, Global sensitivity analysis using polynomial chaos expansions, (38) to (44); `fit_chaos`.
    """
    variables = read_variables(variables)
    faults = number_faults("tolerance", tolerance, positive=True)
    faults += count_faults("evaluations", evaluations, 2 * len(variables.names) + 2)
    if variables.pairs:
        faults.append("the variables are correlated: shares of a variance are those of independent numbers")
    if faults:
        raise ModelError(faults, "the question")
    traced = trace_limit_state(function, variables, gradient, compile)
    if traced.size != 1:
        raise ModelError([f"the function must return one number, it returns {traced.size}"], "the question")
    fit = fit_chaos(traced, variables, tolerance, evaluations, seed, compile)
    return _result(fit, variables, tolerance)


def _result(fit: ChaosFit, variables: RandomVariables, tolerance: float) -> PolynomialChaos:
    names, c = variables.names, fit.coefficients[:, 0]
    shares = _share_matrices(fit.basis, names)
    variance = float(np.sum(c[1:] ** 2))
    values = {key: float(mask @ c**2) / variance if variance > 0.0 else np.nan for key, mask in shares.items()}
    pairs = {key: values[key] for key in values if isinstance(key, tuple) and values[key] > 0.0}
    derivatives: dict = {"mean": {}, "deviation": {}}
    for name, row in coefficient_slopes(fit.basis, c, variables).items():
        for parameter, change in row.items():
            for key, slope in _answer_slopes(c, change, shares, variance).items():
                derivatives.setdefault(key, {}).setdefault(name, {})[parameter] = slope
    error = float(fit.error[0])
    return PolynomialChaos(
        mean=float(c[0]), deviation=float(np.sqrt(variance)),
        first={name: values[f"first {name}"] for name in names},
        total={name: values[f"total {name}"] for name in names},
        pairs=pairs, derivatives=derivatives, error=error, evaluations=fit.evaluations, failed=fit.failed,
        terms=len(c), fit=fit, faults=chaos_faults(fit, tolerance),
    )  # fmt: skip


def chaos_faults(fit: ChaosFit, tolerance: float) -> tuple[str, ...]:
    """Sentences on a polynomial that is not as good as asked, or that left points out."""
    worst = float(np.max(fit.error))
    faults = [] if worst <= tolerance else [
        f"the polynomial is {worst:.2g} of the deviation off, not {tolerance:.2g}: a kink, or too few evaluations"
    ]  # fmt: skip
    if fit.failed:
        faults.append(f"{fit.failed} of {fit.evaluations} points gave no number and are left out")
    return tuple(faults)


def _share_matrices(basis: ChaosBasis, names: tuple[str, ...]) -> dict[Any, np.ndarray]:
    """Marks (terms,) of the terms whose squares are a share of the variance, by name of the share."""
    has = basis.orders > 0
    count = np.sum(has, axis=1)
    found: dict[Any, np.ndarray] = {}
    for k, name in enumerate(names):
        found[f"first {name}"] = has[:, k] & (count == 1)
        found[f"total {name}"] = has[:, k]
    for (i, one), (j, other) in itertools.combinations(enumerate(names), 2):
        found[one, other] = has[:, i] & has[:, j] & (count == 2)
    return {key: mask.astype(float) for key, mask in found.items()}


def _answer_slopes(c, change, shares, variance):
    """Derivatives of mean, deviation and shares for a change (terms,) of the coefficients."""
    if not variance > 0.0:
        return {"mean": float(change[0]), "deviation": np.nan}
    whole = 2.0 * float(c[1:] @ change[1:])
    found = {"mean": float(change[0]), "deviation": float(0.5 * whole / np.sqrt(variance))}
    for key, mask in shares.items():
        if isinstance(key, str):
            part, by = float(mask @ c**2), 2.0 * float(mask @ (c * change))
            found[key] = by / variance - part * whole / variance**2
    return found
