"""Free motion and base excitation of one and two masses, by hand and by the matrix exponential."""

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.vibration import complex_modes, transmissibility


@pytest.mark.long
def test_free_motion_of_two_masses_from_complex_modes():
    """Equation (42): accelerations from a displacement and a velocity, at the start and later."""
    K, C = np.array([[7.0, -3.0], [-3.0, 4.0]]), np.array([[0.5, -0.1], [-0.1, 0.2]])
    M = np.array([[2.0, 0.3], [0.3, 1.0]])
    x, v = np.array([0.2, -0.5]), np.array([1.0, 0.4])
    modes = complex_modes(K=jnp.asarray(K), C=jnp.asarray(C), M=jnp.asarray(M))
    amplitudes = modes.amplitudes(M=M, C=C, displacement=x, velocity=v)
    np.testing.assert_allclose(np.asarray(modes.shapes) @ np.asarray(amplitudes), x, atol=1e-12)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    for t in (0.0, 0.6, 2.9):
        moved = A @ scipy.linalg.expm(A * t) @ np.r_[x, v]
        np.testing.assert_allclose(modes.acceleration(amplitudes, t), moved[2:], rtol=1e-9, atol=1e-12)


@pytest.mark.long
def test_transmissibility_of_a_mass_on_a_spring_and_damper():
    """`(k + i w c) / (k + i w c - m w^2)`, above and below the resonance."""
    k, c, m, w = 5.0, 0.3, 2.0, np.array([0.5, 1.6, 4.0])
    K, C = (jnp.array([[a, -a], [-a, a]]) for a in (k, c))
    M = jnp.diag(jnp.array([0.1, m]))
    found = transmissibility(K=K, M=M, omega=jnp.asarray(w), base=(0,), out=(1,), C=C)
    np.testing.assert_allclose(found[:, 0, 0], (k + 1j * w * c) / (k + 1j * w * c - m * w**2), rtol=1e-10)
