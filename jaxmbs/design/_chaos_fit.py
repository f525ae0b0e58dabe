"""Sparse polynomial chaos: terms grow from those that matter, by least squares on values and gradients.

Source: Blatman and Sudret 2011, Adaptive sparse polynomial chaos expansion based on least angle regression (sparse
bases that grow; here by the neighbours of the terms that matter); Peng, Hampton and Doostan 2016, On polynomial
chaos expansion via gradient-enhanced l1-minimization (gradients as further equations).
"""

from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

from ..batching._batch import evaluate_batch
from ..batching._sampling import normal_points
from ..probability import RandomVariables
from ._chaos_basis import ChaosBasis, total_degree
from ._limit_state import LimitState

_EQUATIONS = 2.0  # for each unknown coefficient
_SHARE = 0.2  # of the evaluations that judge the polynomial and are not fitted
_FEWEST = 16  # points that judge it
_CUT = 0.3  # coefficient that matters, over the tolerance and the deviation
_ROUNDS = 40
_DISTINCT = 0.03  # distance of a term to those before it, root mean square, of one
_MOST = 1000  # terms: seconds of least squares


class ChaosFit(NamedTuple):
    """Polynomial chaos of m answers.

    Attributes:
        basis: its terms; the first is the constant.
        coefficients: (terms, m); their squares are parts of the variance.
        error: (m,) root mean square error at points that were not fitted, over the deviation.
        evaluations: of the function with its gradient; failed: those that gave no number.
    """

    basis: ChaosBasis
    coefficients: Float[np.ndarray, "terms m"]
    error: Float[np.ndarray, " m"]
    evaluations: int
    failed: int

    @property
    def deviation(self) -> Float[np.ndarray, " m"]:
        """Standard deviations (m,)."""
        return _deviation(self.coefficients)


def fit_chaos(
    limit_state: LimitState, variables: RandomVariables, tolerance: float, evaluations: int, seed: int, compile: str
) -> ChaosFit:
    """Fit a polynomial of independent normal numbers until no further term matters, or the evaluations are spent."""
    n = len(variables.names)
    is_uniform = tuple(one.germ == "uniform" and not variables.pairs for one in variables.distributions.values())
    samples = _Samples(limit_state, variables, evaluations, seed, compile)
    fitted = max(int((1.0 - _SHARE) * evaluations), 2)
    most = min(max(int(fitted * (1 + n) / _EQUATIONS), 1), _MOST)
    orders = total_degree(n, 3 if n < 6 else 2)[:most]
    for _ in range(_ROUNDS):
        basis = ChaosBasis(orders, is_uniform)
        samples.extend(min(int(np.ceil(_EQUATIONS * len(orders) / (1 + n))) + 2, fitted))
        basis, coefficients, noise = _fitted(basis, *samples.rows)
        orders = basis.orders
        scale = np.maximum(_deviation(coefficients), 1e-300)
        sizes = np.max(np.abs(coefficients) / scale, axis=1)
        sizes[0] = np.inf
        grown = _grown(orders, sizes, max(_CUT * tolerance, float(np.max(noise / scale))), most)
        if {tuple(row) for row in grown.tolist()} <= {tuple(row) for row in orders.tolist()}:
            break
        orders = grown
    fresh = samples.fresh(max(len(samples.u) // 4, _FEWEST))
    error = np.sqrt(np.mean((fresh[1] - basis.values(fresh[0]) @ coefficients) ** 2, axis=0)) / scale
    return ChaosFit(basis, coefficients, error, samples.count, samples.failed)


def _deviation(coefficients):
    return np.sqrt(np.sum(coefficients[1:] ** 2, axis=0))


def _fitted(basis, u, values, slopes):
    """The terms that the points determine, their coefficients (terms, m) by least squares on values (k, m) and slopes
    (k, n, m), and how far (m,) what they cannot follow moves each of them.

    High orders are large where no point lies: a term that is nearly a sum of those before it at all points is left
    out.
    """
    A, by_u = basis.values_and_slopes(u)
    right = np.concatenate([values, slopes.reshape(-1, values.shape[1])])
    rows = np.concatenate([A, by_u.reshape(-1, A.shape[1])])
    Q, R = np.linalg.qr(rows)
    kept = np.abs(np.diagonal(R)) > _DISTINCT * np.sqrt(len(u))
    if not np.all(kept):
        basis, A, (Q, R) = basis._replace(orders=basis.orders[kept]), A[:, kept], np.linalg.qr(rows[:, kept])
    coefficients = solve_triangular(R, Q.T @ right, check_finite=False)
    left = np.sqrt(np.mean((values - A @ coefficients) ** 2, axis=0))
    spare = max(1.0 - A.shape[1] / len(Q), 0.1)
    return basis, coefficients, left / np.sqrt(spare * len(u))


def _grown(orders, sizes, cut, most):
    """Terms that matter, and neighbours of them: an order or two more in one number.

    Two, as even and odd functions lack every other order.
    """
    known = {tuple(row): size for row, size in zip(orders.tolist(), sizes, strict=True) if size > cut}
    near: dict[tuple, float] = {}
    for row, size in known.items():
        for k in range(len(row)):
            for step in (1, 2):
                other = (*row[:k], row[k] + step, *row[k + 1 :])
                if other not in known:
                    near[other] = max(near.get(other, 0.0), min(size, 1.0) / step)
    kept = sorted(known, key=lambda row: -known[row])[:most]
    new = sorted(near, key=lambda row: -near[row])[: most - len(kept)]
    return np.array([*kept, *new])


class _Samples:
    """Values and slopes at points of normal space, more of them when asked."""

    def __init__(self, limit_state, variables, most, seed, compile):
        self._function: Any = _WithSlopes(limit_state, variables)
        self._points = normal_points(len(variables.names), most, seed)
        self._compile, self.count, self.failed = compile, 0, 0
        self.u = np.zeros((0, self._points.shape[1]))
        self._values = np.zeros((0, limit_state.size))
        self._slopes = np.zeros((0, self._points.shape[1], limit_state.size))

    @property
    def rows(self):
        """Points (k, n), values (k, m) and slopes (k, n, m) that are fitted."""
        return self.u, self._values, self._slopes

    def extend(self, number):
        """Have so many points, less those that gave no number."""
        parts = self._evaluated(number - self.count)
        pairs = zip(self.rows, parts, strict=True)
        self.u, self._values, self._slopes = (np.concatenate(pair) for pair in pairs)

    def fresh(self, number):
        """Points and values that are not fitted."""
        return self._evaluated(number)[:2]

    def _evaluated(self, number):
        u = self._points[self.count : self.count + max(number, 0)]
        if not len(u):
            return u, np.zeros((0, self._values.shape[1])), np.zeros((0, *self._slopes.shape[1:]))
        self.count += len(u)
        found = evaluate_batch(self._function, u, None, False, compile=self._compile, total=len(self._points))
        values, slopes = (np.asarray(part, float) for part in found.values)
        good = np.asarray(found.ok) & np.all(np.isfinite(values), axis=1) & np.all(np.isfinite(slopes), axis=(1, 2))
        self.failed += int(np.sum(~good))
        return u[good], values[good], slopes[good]


class _WithSlopes(NamedTuple):
    """Values (m,) and slopes (n, m) of a limit state by a point of normal space."""

    limit_state: LimitState
    variables: RandomVariables

    def __call__(self, u: Any) -> tuple:
        function = lambda u: self.limit_state.at(u, self.variables, None)
        if self.limit_state.reverse:
            values, pull = jax.vjp(function, u)
            return values, jax.vmap(lambda seed: pull(seed)[0], out_axes=1)(np.eye(self.limit_state.size))
        rows, values = jax.jacfwd(lambda u: (function(u),) * 2, has_aux=True)(u)
        return values, rows.T
