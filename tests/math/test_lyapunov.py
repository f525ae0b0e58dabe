"""Lyapunov equations against SciPy, defective ones too, and their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from jaxmbs.math._lyapunov import lyapunov


@pytest.mark.slow
def test_against_scipy_and_differences():
    random = np.random.default_rng(1)
    A = random.normal(size=(6, 6)) - 4.0 * np.eye(6)
    Q = random.normal(size=(6, 6))
    Q = Q @ Q.T
    np.testing.assert_allclose(lyapunov(jnp.array(A), jnp.array(Q)), solve_continuous_lyapunov(A, -Q), rtol=1e-10)
    turn = random.normal(size=(6, 6))

    def f(t):
        return jnp.sum(lyapunov(jnp.array(A) + t * turn, jnp.array(Q)))

    found = [float(f(h)) for h in (1e-5, -1e-5)]
    np.testing.assert_allclose(jax.grad(f)(0.0), (found[0] - found[1]) / 2e-5, rtol=1e-7)


@pytest.mark.slow
def test_defective_and_lightly_damped():
    critical = np.array([[0.0, 1.0], [-9.0, -6.0]])
    light = np.array([[0.0, 1.0], [-9e4, -6e-3]])
    Q = np.diag([0.0, 2.0])
    for A in (critical, light):
        found = lyapunov(jnp.array(A), jnp.array(Q))
        rate, square = -A[1, 1], -A[1, 0]
        np.testing.assert_allclose(np.diag(found), [1.0 / (rate * square), 1.0 / rate], rtol=1e-9)
    assert np.all(np.isnan(lyapunov(jnp.array(-critical), jnp.array(Q))))
