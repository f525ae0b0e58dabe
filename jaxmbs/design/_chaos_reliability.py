"""A polynomial in place of a limit state, for probabilities by samples of it."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import ndtr
from jaxtyping import Float

from ..probability import RandomVariables
from ..runtime import jit
from ._chaos_fit import ChaosFit, fit_chaos
from ._limit_state import LimitState

TOLERANCE = 1e-3  # of the polynomial, over the deviation of the limit state
_EVALUATIONS = 2000
_NEAR = 0.1  # distance in normal space from a design point of the polynomial to the failure of the limit state
_PART = 10_000  # points that are evaluated at a time


class ChaosLimit(NamedTuple):
    """A polynomial as a limit state, with the methods of `LimitState`."""

    fit: ChaosFit
    size: int
    reverse: bool = True

    def at(self, u: Float[Array, " n"], variables: RandomVariables, factor: Array | None) -> Array:
        """Values (m,) at a point of independent standard normal numbers."""
        basis = self.fit.basis
        product = jnp.ones(len(basis.orders))
        for k, uniform in enumerate(basis.is_uniform):
            column = basis.orders[:, k]
            product = product * _polynomials(u[k], int(np.max(column)), uniform)[column]
        return product @ self.fit.coefficients

    def sampled(self, points: np.ndarray, variables: RandomVariables, compile: str, total: int) -> np.ndarray:
        """Values (k, m) at points (k, n)."""
        parts = [points[i : i + _PART] for i in range(0, len(points), _PART)]
        return np.concatenate([self.fit.basis.values(part) @ self.fit.coefficients for part in parts])


def chaos_limit(traced: LimitState, variables: RandomVariables, question: Any) -> ChaosLimit:
    """The polynomial of a limit state."""
    fit = fit_chaos(traced, variables, TOLERANCE, _EVALUATIONS, question.seed, question.compile)
    return ChaosLimit(fit, traced.size)


def far_from_failure(
    traced: LimitState, surrogate: ChaosLimit, variables: RandomVariables, points: np.ndarray, question: Any
) -> tuple[str, ...]:
    """Sentences on design points (k, n) of the polynomial that are far from any failure of the limit state itself."""
    values = traced.sampled(points, variables, question.compile, len(points))
    slopes = jit(jax.vmap(jax.jacrev(lambda u: surrogate.at(u, variables, None))))(jnp.asarray(points))
    distances = np.min(np.abs(values) / np.linalg.norm(np.asarray(slopes), axis=2), axis=1)
    text = "at a design point of the polynomial the limit state is {:.2g} deviations from failure"
    return tuple(text.format(x) for x in distances if not x <= _NEAR)


def _polynomials(u, order, uniform):
    """Orthonormal polynomials (order + 1,) of one normal number, as `polynomials` of the basis."""
    x = 2.0 * ndtr(u) - 1.0 if uniform else u
    rows = [jnp.ones_like(u), x]
    for k in range(1, order):
        high, low = ((2 * k + 1) / (k + 1), k / (k + 1)) if uniform else (1.0, float(k))
        rows.append(high * x * rows[-1] - low * rows[-2])
    degrees = np.arange(order + 1)
    size = np.sqrt(2 * degrees + 1) if uniform else 1.0 / np.sqrt(np.cumprod(np.maximum(degrees, 1.0)))
    return jnp.stack(rows[: order + 1]) * size
