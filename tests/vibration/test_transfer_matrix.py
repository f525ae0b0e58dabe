"""The matrix of transfer functions at complex arguments: inverses, closed forms, sums over modes, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.vibration import Modes, complex_modes, modal_transfer_matrix, natural_modes, receptance, transfer_matrix
from tests.structural_matrices import beam, chain

POINTS = np.array([0.3 + 1.1j, -0.4 + 0.2j, 0.7j, 1.5])
K, M = (np.asarray(A) for A in chain(4, 3.0, 2.0, 1))
C = 0.1 * np.asarray(K) + np.diag([0.3, 0.0, 0.0, 0.7])


@jax.jit
def both(K, M, C, s):
    modes = complex_modes(K=K, C=C, M=M)
    return transfer_matrix(K=K, M=M, C=C, s=s), modal_transfer_matrix(modes, s), modes


def inverse(K, M, C, points=POINTS):
    return np.stack([np.linalg.inv(s * s * M + s * C + K) for s in points])


@pytest.mark.long
def test_inverse_and_sum_over_modes():
    """General damping and matrices that are not symmetric, off the axis of frequencies; some outputs and inputs."""
    uneven = K + np.triu(np.ones((4, 4)), 1) * 0.2
    for stiffness in (K, uneven):
        direct, summed, modes = both(stiffness, M, C, POINTS)
        np.testing.assert_allclose(direct, inverse(stiffness, M, C), rtol=1e-9)
        np.testing.assert_allclose(summed, inverse(stiffness, M, C), rtol=1e-8, atol=1e-11)
    few = transfer_matrix(
        K=jnp.asarray(uneven), M=jnp.asarray(M), C=C, s=POINTS, out=np.eye(4)[2:3], into=np.ones((4, 1))
    )
    np.testing.assert_allclose(few[:, 0, 0], inverse(uneven, M, C)[:, 2].sum(axis=1), rtol=1e-9)
    some = modal_transfer_matrix(modes, POINTS, out=[2], into=[0, 3])
    np.testing.assert_allclose(some, inverse(uneven, M, C)[:, 2:3, [0, 3]], rtol=1e-8, atol=1e-11)


def test_one_mass_in_closed_form():
    """`1 / (m (s - r1) (s - r2))`, and its residue at a root."""
    m, c, k = 2.0, 0.6, 5.0
    r = -c / (2 * m) + np.array([1j, -1j]) * np.sqrt(k / m - (c / (2 * m)) ** 2)
    one = np.ones((1, 1))
    direct, summed, modes = both(k * one, m * one, c * one, POINTS)
    expected = 1 / (m * (POINTS - r[0]) * (POINTS - r[1]))
    np.testing.assert_allclose(direct[:, 0, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(summed[:, 0, 0], expected, rtol=1e-10)
    alone = modal_transfer_matrix(modes.select(slice(0, 1)), POINTS)[:, 0, 0] * (POINTS - r[0])
    np.testing.assert_allclose(alone, 1 / (m * (r[0] - r[1])), rtol=1e-10)


@pytest.mark.long
def test_natural_modes_without_damping():
    """`sum shapes shapes^T / (s^2 + w^2)`, a free beam's rigid motions among them; at `s = i w` the receptance."""
    K, M = beam(3)
    modes = natural_modes(K=K, M=M)
    found = modal_transfer_matrix(modes, POINTS)
    expected = inverse(np.asarray(K), np.asarray(M), 0 * np.asarray(M))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
    w = jnp.array([0.4, 7.0])
    at_frequencies = receptance(K=K, M=M, omega=w, out=range(8), into=range(8))
    scale = np.abs(at_frequencies).max()
    np.testing.assert_allclose(
        transfer_matrix(K=K, M=M, s=1j * np.asarray(w)), at_frequencies, rtol=1e-7, atol=1e-9 * scale
    )


def test_derivatives_by_the_argument_and_by_the_matrices():
    """`dB/ds = -B (2 s M + C) B`, `dB/dk = -B K' B`."""

    def at(s, k):
        return transfer_matrix(K=k * jnp.asarray(K), M=jnp.asarray(M), C=jnp.asarray(C), s=s)

    one = jnp.ones(len(POINTS), complex)
    by_s = jax.jit(lambda s: jax.jvp(lambda s: at(s, 1.0), (s,), (one,))[1])(jnp.asarray(POINTS))
    by_k = jax.jit(jax.jacfwd(lambda k: at(POINTS, k)))(1.0)
    B = inverse(K, M, C)
    np.testing.assert_allclose(by_s, -B @ (2 * POINTS[:, None, None] * M + C) @ B, rtol=1e-8)
    np.testing.assert_allclose(by_k, -B @ K @ B, rtol=1e-8)


def test_bad_input():
    modes = Modes(jnp.ones(2), jnp.ones((1, 2), complex), jnp.zeros(2, bool), jnp.array([1j, -1j]))
    with pytest.raises(ValueError, match=r"shape \(\), not \(points,\)"):
        transfer_matrix(K=jnp.asarray(K), M=jnp.asarray(M), s=np.array(1j))
    with pytest.raises(ValueError, match="no left vectors"):
        modal_transfer_matrix(modes, POINTS)
