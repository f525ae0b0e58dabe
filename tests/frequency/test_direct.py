"""Direct frequency response of a chain of masses: closed forms, dense solves, gradients, chunks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import blocksparse as bs
from jaxmbs.frequency import direct_response

N = 30
PATTERN = bs.Pattern(N, 1, [(i, i + 1) for i in range(N - 1)])


def chain(k, m=1.0):
    """Stiffness and mass of N masses in a row between springs k (N,), the first one to a wall."""
    diagonal = k + jnp.append(k[1:], 0.0)
    K = bs.BlockMatrix(PATTERN, diagonal[:, None, None], -k[1:, None, None])
    M = bs.BlockMatrix(PATTERN, m * jnp.ones((N, 1, 1)), jnp.zeros((N - 1, 1, 1)))
    return K, M


@pytest.fixture(scope="module")
def response():
    K, M = chain(jnp.full(N, 40.0))
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    omega = jnp.linspace(0.05, 14.0, 37)
    solve = jax.jit(lambda K, M, chunk: direct_response(K, 0.01 * K, M, load, omega, chunk=chunk), static_argnums=2)
    return K, M, np.asarray(load), omega, solve


@pytest.mark.parametrize("chunk", [5, 37])
def test_every_frequency_against_a_dense_solve(response, chunk):
    K, M, load, omega, solve = response
    x = solve(K, M, chunk)
    k, m = np.asarray(K.dense()), np.asarray(M.dense())
    for i in (0, 11, 36):
        w = float(omega[i])
        np.testing.assert_allclose(x[i, :, 0], np.linalg.solve(k * (1 + 0.01j * w) - w**2 * m, load[:, 0]), rtol=1e-9)


def test_tip_receptance_in_closed_form():
    """A chain driven at its free end: sin and cosine of the phase per cell, `w = 2 sqrt(k/m) sin(theta/2)`."""
    K, M = chain(jnp.full(N, 40.0))
    theta = np.array([0.03, 0.4, 1.7])
    omega = 2 * np.sqrt(40.0) * np.sin(theta / 2)
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    tip = jax.jit(lambda K, M: direct_response(K, None, M, load, omega, select=lambda x: x[-1, 0]))(K, M)
    exact = np.sin(N * theta) / (2 * 40.0 * np.sin(theta / 2) * np.cos((N + 0.5) * theta))
    np.testing.assert_allclose(tip, exact, rtol=1e-10)


def test_gradient_of_a_response():
    """Sum of squared tip amplitudes by every spring, against differences; structural damping."""
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    omega = jnp.linspace(0.3, 2.0, 7)

    @jax.jit
    def level(k):
        K, M = chain(k)
        tip = direct_response(
            K.astype(complex) * (1 + 0.05j), None, M, load, omega, select=lambda x: x[-1, 0], chunk=3
        )
        return jnp.sum(jnp.abs(tip) ** 2)

    k = jnp.linspace(30.0, 50.0, N)
    slope = jax.jit(jax.grad(level))(k)
    for i in (0, 13, 29):
        step = 1e-3 * np.eye(N)[i]
        np.testing.assert_allclose(
            slope[i], (level(k + step) - level(k - step)) / 2e-3, atol=2e-6 * np.abs(slope).max()
        )
