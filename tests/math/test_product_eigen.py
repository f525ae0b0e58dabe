"""Eigenvalues of products: each to rounding of its own size, as exact arithmetic has them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from jaxmbs.math._product_eigen import product_eigenvalues

RNG = np.random.default_rng(3)
FRAMES = [np.linalg.qr(RNG.normal(size=(4, 4)))[0] for _ in range(5)]
#: A pair beside values of very different size; its blocks are multiplied, the frames between cancel.
ROOTS = np.array([[0.3, -2.0, 0, 0], [2.0, 0.3, 0, 0], [0, 0, -3.0, 0.5], [0, 0, 0, -11.0]])


def factors(rates=ROOTS):
    step = expm(0.5 * rates)
    return jnp.stack([FRAMES[(k + 1) % 5] @ step @ FRAMES[k].T for k in range(5)])


def test_small_values_keep_their_digits():
    found = np.asarray(product_eigenvalues(factors()))
    wanted = np.exp(2.5 * np.array([0.3 + 2.0j, 0.3 - 2.0j, -3.0, -11.0]))
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(wanted), rtol=1e-11)
    assert abs(found[0]) >= abs(found[-1]) and abs(wanted[-1]) < 2e-12
    plain = np.linalg.eigvals(np.linalg.multi_dot([np.asarray(f) for f in factors()[::-1]]))
    assert np.min(np.abs(plain - wanted[-1])) > 1e-8 * abs(wanted[-1])  # what the product itself has lost


@pytest.mark.slow
def test_values_have_derivatives():
    change = RNG.normal(size=(5, 4, 4))
    slope = lambda f: jax.jacfwd(lambda s: f(product_eigenvalues(factors() + s * change)))(0.0)
    both = [product_eigenvalues(factors() + s * change) for s in (1e-6, -1e-6)]
    for part in (jnp.real, lambda x: jnp.abs(jnp.imag(x))):
        found, wanted = slope(part), (part(both[0]) - part(both[1])) / 2e-6
        np.testing.assert_allclose(found[:3], wanted[:3], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("n", [0, 1])
def test_of_no_freedom_and_one(n):
    found = product_eigenvalues(jnp.full((3, n, n), 0.5))
    np.testing.assert_allclose(found, np.full(n, 0.125))
