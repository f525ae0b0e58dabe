"""Saddle systems with rows that say the same, in both precisions and in both ways of a round."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.math._linalg import saddle_solve
from jaxmbs.runtime import jit, tuning

TOLERANCE = {np.float32: 2e-4, np.float64: 1e-12}
SIZES = {"inverse of the whole": 4, "eliminated": 20}  # unknowns; rows are half of them, and half of those again


def system(n, dtype):
    """M, A, b, c with each row twice, a turned round."""
    rng = np.random.default_rng(n)
    half = rng.normal(size=(n, n))
    rows, values = rng.normal(size=(n // 2, n)), rng.normal(size=n // 2)
    M, A = half @ half.T + n * np.eye(n), np.concatenate([rows, -2.0 * rows[: n // 4]])
    return tuple(x.astype(dtype) for x in (M, A, rng.normal(size=n), np.r_[values, -2.0 * values[: n // 4]]))


@pytest.mark.parametrize("n", SIZES.values(), ids=SIZES)
@pytest.mark.parametrize("dtype", TOLERANCE, ids=lambda dtype: dtype.__name__)
def test_precision_and_derivatives(n, dtype):
    M, A, b, c = system(n, dtype)
    assert (n + len(A) <= tuning.WHOLE_SADDLE) == (n == SIZES["inverse of the whole"])
    K = np.block([[M, A.T], [A, np.zeros((len(A), len(A)))]]).astype(float)

    def expected(b, c):
        return np.linalg.lstsq(K, np.concatenate([b, c]).astype(float), rcond=1e-6)[0][:n]

    x, y = jit(saddle_solve)(M, A, b, c)
    assert x.dtype == y.dtype == dtype
    np.testing.assert_allclose(x, expected(b, c), atol=TOLERANCE[dtype])
    np.testing.assert_allclose(M @ x + A.T @ y, b, atol=20.0 * TOLERANCE[dtype])

    by_mass, by_load = jit(jax.grad(lambda M, b: jnp.sum(saddle_solve(M, A, b, c)[0]), argnums=(0, 1)))(M, b)
    assert by_mass.dtype == by_load.dtype == dtype
    adjoint = expected(np.ones(n), 0.0 * c)
    np.testing.assert_allclose(by_load, adjoint, atol=TOLERANCE[dtype])
    np.testing.assert_allclose(by_mass, -np.outer(adjoint, expected(b, c)), atol=TOLERANCE[dtype])
