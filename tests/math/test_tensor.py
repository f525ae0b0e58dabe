"""The tensor products against loops over planes."""

import numpy as np
import pytest
from jax import numpy as jnp

from jaxmbs.math import _tensor as tensor


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def _close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-14)


def test_plane_mix(rng):
    a, b = rng.normal(size=(3, 4)), rng.normal(size=(4, 2, 5))
    expected = [sum(a[i, j] * b[j] for j in range(4)) for i in range(3)]
    _close(tensor.plane_mix(jnp.array(a), jnp.array(b)), expected)


def test_quadratic(rng):
    v, b = rng.normal(size=3), rng.normal(size=(4, 3, 3))
    expected = [v @ plane @ v for plane in b]
    _close(tensor.quadratic(jnp.array(v), jnp.array(b)), expected)


def test_left_product(rng):
    a, b = rng.normal(size=(2, 3)), rng.normal(size=(4, 3, 5))
    expected = [a @ plane for plane in b]
    _close(tensor.left_product(jnp.array(a), jnp.array(b)), expected)


def test_right_product(rng):
    b, a = rng.normal(size=(4, 2, 3)), rng.normal(size=(3, 5))
    expected = [plane @ a for plane in b]
    _close(tensor.right_product(jnp.array(b), jnp.array(a)), expected)
