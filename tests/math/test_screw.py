"""Screws: logarithm and exponential of poses against SciPy's matrix exponential, rates against differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.math._linalg import skew
from jaxmbs.math._rotation import rotation_matrix
from jaxmbs.math._screw import pose_of_screw, screw_of_pose, screw_rate, wrench_of_screw_gradient

VECTORS = ([0.0, 0.0, 0.0], [1e-9, 0.0, 2e-9], [0.1, -0.15, 0.05], [0.9, -0.4, 1.1], [-1.8, 1.9, 1.2])
SLIDE = np.array([1.0, -0.3, 0.6])


@pytest.mark.parametrize("vector", VECTORS)
def test_exponential_and_logarithm(vector):
    screw = np.concatenate([SLIDE, vector])
    four = np.zeros((4, 4))
    four[:3, :3], four[:3, 3] = np.asarray(skew(jnp.array(vector))), SLIDE
    exact = scipy.linalg.expm(four)
    R, d = jax.jit(pose_of_screw)(jnp.array(screw))
    np.testing.assert_allclose(R, exact[:3, :3], atol=1e-13)
    np.testing.assert_allclose(d, exact[:3, 3], atol=1e-13)
    np.testing.assert_allclose(jax.jit(screw_of_pose)(R, d), screw, atol=1e-12)


@jax.jit
def _moved(vector, displacement, twist, h):
    return screw_of_pose(rotation_matrix(h * twist[3:]) @ rotation_matrix(vector), displacement + h * twist[:3])


@pytest.mark.parametrize("vector", VECTORS)
def test_rate_against_differences_and_power(vector):
    vector, d, h = jnp.array(vector), jnp.array([0.7, 0.2, -0.4]), 1e-5
    twist, gradient = jnp.array([0.3, -1.0, 0.5, 0.8, 0.2, -0.6]), jnp.array([2.0, -1.0, 0.4, 0.7, 3.0, -2.0])
    screw = screw_of_pose(rotation_matrix(vector), d)
    rate = jax.jit(screw_rate)(screw, d, twist[:3], twist[3:])
    differences = (_moved(vector, d, twist, h) - _moved(vector, d, twist, -h)) / (2 * h)
    np.testing.assert_allclose(rate, differences, atol=2e-8)
    force, moment = jax.jit(wrench_of_screw_gradient)(screw, d, gradient)
    np.testing.assert_allclose(force @ twist[:3] + moment @ twist[3:], gradient @ rate, rtol=1e-12)


def test_derivatives_are_finite_at_zero_and_half_a_turn():
    for vector in ([0.0, 0.0, 0.0], [np.pi, 0.0, 0.0], [0.0, np.pi / 2**0.5, np.pi / 2**0.5]):
        R = rotation_matrix(jnp.array(vector))
        slopes = jax.jit(jax.jacfwd(screw_of_pose, (0, 1)))(R, jnp.array([0.7, 0.2, -0.4]))
        assert all(np.isfinite(s).all() for s in slopes)
