"""`moments` and `Robust`: mean and deviation of an answer under random numbers as functions of a design."""

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..batching._sampling import normal_points
from ..checks import any_concrete, count_faults, is_concrete, number_faults
from ..errors import ModelError
from ..probability import RandomVariables
from ..runtime import jit, not_tracing
from ..typing import WordedError
from ._chaos_basis import ChaosBasis, total_degree
from ._limit_state import read_variables, variables_of
from ._percentile import percentile

_OVERSAMPLING = 2  # evaluations for each term
_MOST_TERMS = 5000  # of a polynomial: seconds of least squares


def moments(
    function: Callable[[dict], Any],
    variables: Mapping[str, Any] | RandomVariables,
    degree: int = 2,
    seed: int = 0,
    compile: str = "auto",
) -> tuple[Array, Array]:
    """Mean and standard deviation, both (), of a function of random numbers, by a polynomial of a fixed degree.

    It is fitted to values at fixed points of normal space, two for each of its terms: a pure function with
    derivatives by all that the function and the distributions close over, smooth, its deviation never negative.
    `polynomial_chaos` says how good such a polynomial is.

    Args:
        function: of a dict of the variables to a number.
        variables: as of `reliability`.
        degree: of the polynomial of normal numbers, or of probabilities of uniform ones; 2 for narrow tolerances.
        seed: of the points.
        compile: as of `minimise`.

    Raises: ModelError, TypeError for what is none of these.

    Source: Sudret 2008, Global sensitivity analysis using polynomial chaos expansions.
    """
    variables = read_variables(variables)
    faults = count_faults("degree", degree, 1)
    terms = 0 if faults else math.comb(len(variables.names) + degree, degree)
    if terms > _MOST_TERMS:
        faults = [f"degree={degree} makes {terms} terms, more than {_MOST_TERMS}"]
    if faults:
        raise ModelError(faults, "the question")

    def solve(variables):
        is_uniform = tuple(one.germ == "uniform" and not variables.pairs for one in variables.distributions.values())
        points, fit = _fit(is_uniform, degree, seed)
        factor = variables.factor()
        values = jax.vmap(lambda u: _number(function(variables.from_normal(u, factor))))(jnp.asarray(points))
        c = jnp.asarray(fit) @ values
        squares = jnp.sum(c[1:] ** 2)
        has = squares > 0.0  # the root of zero has no derivative
        return c[0], jnp.where(has, jnp.sqrt(jnp.where(has, squares, 1.0)), 0.0)

    if not_tracing() and is_concrete(variables):
        solve = jit(solve, compile=compile)
    return solve(variables)


def _number(value):
    value = jnp.asarray(value, float)
    if value.ndim:
        raise TypeError(f"moments are those of one real number, the function returned shape {value.shape}")
    return value


@functools.cache
def _fit(is_uniform, degree, seed):
    """Points (k, n) of normal space, and the matrix (terms, k) from values there to coefficients."""
    n = len(is_uniform)
    basis = ChaosBasis(total_degree(n, degree), is_uniform)
    points = normal_points(n, _OVERSAMPLING * len(basis.orders), seed)
    return points, np.linalg.pinv(basis.values(points))


@dataclasses.dataclass(frozen=True)
class Robust:
    """An objective of `minimise` that sees the scatter of an answer: its mean, deviation or percentile.

    `minimise(design.Robust(load, spread, deviation=3.0), design0)` makes the mean and three deviations least.

    Attributes:
        function: of a design and a dict of random numbers to a number.
        variables: distributions by name, `RandomVariables`, or a function of a design to these, where a number that
            scatters is a variable of the design.
        mean, deviation: weights of both, as of `moments`.
        percent: the `percentile` in place of these.
        degree: as of `moments`.
    """

    function: WordedError[Callable[[PyTree, dict], Any]]
    variables: Mapping[str, Any] | RandomVariables | Callable[[PyTree], Any]
    mean: float = 1.0
    deviation: float = 0.0
    percent: float | None = None
    degree: int = 2

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise TypeError(f"Robust takes a function of a design and random numbers, not {self.function!r}")
        if not callable(self.variables):
            read_variables(self.variables)
        faults = number_faults("mean", self.mean) + number_faults("deviation", self.deviation)
        faults += count_faults("degree", self.degree, 1)
        if self.percent is not None:
            faults += number_faults("percent", self.percent, positive=True)
            if any_concrete(lambda x: x >= 100.0, self.percent):
                faults.append(f"percent must lie between 0 and 100, got {self.percent}")
        if faults:
            raise ModelError(faults, "the objective Robust")

    def __call__(self, design: PyTree) -> Array:
        """The objective of a design."""
        variables = variables_of(self.variables, design)
        of_numbers = functools.partial(self.function, design)
        if self.percent is not None:
            return percentile(of_numbers, variables, self.percent)
        mean, deviation = moments(of_numbers, variables, self.degree)
        return self.mean * mean + self.deviation * deviation
