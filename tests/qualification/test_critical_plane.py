"""Critical planes: closed forms of covariances, a search over directions, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize

from jaxmbs.errors import ModelError
from jaxmbs.qualification import critical_plane
from jaxmbs.qualification._critical_plane import _greatest, _row

from .test_stress_spectrum import NAMES, SPRINGS, response


def covariance(*stresses):
    """Covariance of uncorrelated stress states."""
    return sum(jnp.outer(s, s) for s in map(jnp.asarray, stresses))


@pytest.mark.long
def test_principal_stress_of_one_state():
    """One plane stress that grows and falls: principal stress and greatest shear stress."""
    x, y, xy = 3.0, -1.0, 1.5
    P = covariance(np.array([x, y, xy]))
    normal, along = _greatest(P, True)
    half, radius = (x + y) / 2, np.hypot((x - y) / 2, xy)
    row = _row(normal, along, True)
    np.testing.assert_allclose(row @ P @ row, (half + radius) ** 2, rtol=1e-12)
    np.testing.assert_allclose(np.abs(normal[1] / normal[0]), np.tan(0.5 * np.arctan2(2 * xy, x - y)), rtol=1e-9)
    row = _row(*_greatest(P, False), True)
    np.testing.assert_allclose(row @ P @ row, radius**2, rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("is_normal", [True, False])
def test_planes_of_a_solid_against_a_search(is_normal):
    rng = np.random.default_rng(4)
    for _ in range(3):
        P = covariance(*rng.normal(size=(3, 6)))
        n, s = _greatest(P, is_normal)
        np.testing.assert_allclose([n @ n, s @ s], 1.0, rtol=1e-12)
        np.testing.assert_allclose(n @ s, float(is_normal), atol=1e-12)

        C = np.asarray(P)

        def other(x, P=C):
            Q = np.linalg.qr(x.reshape(3, 2))[0].T
            c = np.asarray(_row(Q[0], Q[0] if is_normal else Q[1], False))
            return -c @ P @ c

        best = min(minimize(other, rng.normal(size=6), method="BFGS", tol=1e-10).fun for _ in range(8))
        row = _row(n, s, False)
        np.testing.assert_allclose(row @ P @ row, -best, rtol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["normal", "shear"])
def test_derivatives_of_plane_and_moments(kind):
    @jax.jit
    def values(k):
        found = critical_plane(response(k), NAMES, kind)
        return jnp.concatenate([found.normal[:2] ** 2, found.spectrum.moments((0, 2)) * jnp.array([1.0, 1e-4])])

    slope = jax.jacrev(values)(SPRINGS)
    for k in range(3):
        h = 30.0 * np.eye(3)[k]
        d = (
            8 * (values(SPRINGS + h) - values(SPRINGS - h)) - (values(SPRINGS + 2 * h) - values(SPRINGS - 2 * h))
        ) / 360
        np.testing.assert_allclose(slope[:, k], d, rtol=1e-6, atol=1e-12)
    with pytest.raises(ModelError, match="shear"):
        critical_plane(response(), NAMES, "tangential")
