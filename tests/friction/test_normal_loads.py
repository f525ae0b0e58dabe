"""Loads N that the map |R + G (N + preload)| takes to themselves, their verdict, and their derivative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import fsolve

from jaxmbs.friction._normal_loads import LoadMap, contracts, normal_loads, spectral_radius


def solved(R, G, preload, patches=None):
    """Loads of surfaces that each have one patch, of so many rows as `patches` (n, rows) tells."""
    n = len(preload)
    patches = np.eye(n) if patches is None else patches
    return normal_loads(LoadMap.of(jnp.asarray(R), jnp.asarray(G), jnp.asarray(preload), patches, np.eye(n)))


@pytest.mark.parametrize(
    ("gain", "wanted"),
    [(0.8, 5.0), (-0.9, 1 / 1.9), (1.2, None), (-1.5, None)],  # at 1.2 there is none, at -1.5 there are 0.4 and 2
)
def test_one_surface(gain, wanted):
    """`N = |1 + gain N|`: one solution where the gain is below one."""
    found = solved([1.0], [[gain]], [0.0])
    assert bool(found.unique) == (wanted is not None)
    np.testing.assert_allclose(found.load, [np.nan if wanted is None else wanted], rtol=1e-12)


def test_several_surfaces_and_their_derivatives():
    """Two rows for each of three surfaces, beside SciPy's solution and central differences."""
    rng = np.random.default_rng(5)
    R, G, preload = rng.normal(size=6) * 50.0, rng.normal(size=(6, 3)) * 0.2, np.array([0.0, 5.0, 1.0])
    patches = np.kron(np.eye(3), np.ones((1, 2)))
    size = lambda N, R: np.sqrt(patches @ (R + G @ (N + preload)) ** 2)
    true = fsolve(lambda N: size(N, R) - N, size(0 * preload, R), xtol=1e-13)
    ask = jax.jit(lambda R: solved(R, G, preload, patches).load)
    np.testing.assert_allclose(ask(R), true, rtol=1e-9)
    way, h = rng.normal(size=6), 1e-4
    slope = (ask(R + h * way) - ask(R - h * way)) / (2 * h)
    np.testing.assert_allclose(jax.jvp(ask, (jnp.asarray(R),), (jnp.asarray(way),))[1], slope, rtol=1e-7)
    np.testing.assert_allclose(jax.jit(jax.jacrev(ask))(jnp.asarray(R)) @ way, slope, rtol=1e-7)


@pytest.mark.parametrize("radius", [0.3, 0.95, 1.01, 1.7])
def test_a_matrix_contracts_by_its_eigenvalues(radius):
    """Not by its norm, of a matrix far from normal: to three per cent, from above."""
    C = np.array([[0.5, 80.0, 0.0], [0.0, -0.7, 9.0], [0.0, 0.0, 1.0]]) * radius
    assert bool(contracts(jnp.asarray(C))) == (radius < 1.0)
    np.testing.assert_allclose(spectral_radius(jnp.asarray(C)), radius, rtol=0.03)
    assert spectral_radius(jnp.asarray(C)) >= radius
    assert spectral_radius(jnp.zeros((2, 2))) == 0.0 == spectral_radius(jnp.array([[0.0, 3.0], [0.0, 0.0]]))
