"""Inertias by unknowns without bounds: round trips, bodies that can exist, the published formula, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxmbs.errors import ModelError
from jaxmbs.identification import from_log_cholesky, log_cholesky

NUMBERS = st.lists(st.floats(-1.5, 1.5), min_size=10, max_size=10)


@pytest.mark.long
@settings(deadline=None)
@given(NUMBERS)
def test_every_value_is_a_body_that_can_exist(numbers):
    """Mass positive, principal moments with A + B > C, and the way back."""
    body = {name: np.asarray(x) for name, x in from_log_cholesky(numbers).items()}
    a, b, c = np.linalg.eigvalsh(body["inertia"])
    assert body["mass"] > 0 and 0 < a and a + b > c
    np.testing.assert_allclose(log_cholesky(**body), numbers, atol=1e-7)


def test_the_pseudo_inertia_of_the_paper():
    """`J = U U^T` with the upper triangle of Rucker and Wensing: its entries are the moments of the mass."""
    alpha, d, (s12, s23, s13), t = 0.3, np.array([-0.2, 0.1, 0.4]), (0.2, -0.1, 0.3), np.array([0.5, -0.3, 0.2])
    U = np.eye(4)
    U[:3, :3] = np.diag(np.exp(d))
    U[0, 1], U[1, 2], U[0, 2], U[:3, 3] = s12, s23, s13, t
    J = np.exp(2 * alpha) * U @ U.T
    body = from_log_cholesky([alpha, *d, s12, s23, s13, *t])
    m, c = J[3, 3], J[:3, 3] / J[3, 3]
    about = J[:3, :3] - m * np.outer(c, c)
    np.testing.assert_allclose(body["mass"], m, rtol=1e-14)
    np.testing.assert_allclose(body["com"], c, rtol=1e-14)
    np.testing.assert_allclose(body["inertia"], np.trace(about) * np.eye(3) - about, rtol=1e-13, atol=1e-15)


@pytest.mark.long
def test_derivatives():
    x, h = np.linspace(-0.5, 0.7, 10), 1e-6
    flat = lambda x: jnp.concatenate([jnp.ravel(part) for part in from_log_cholesky(x).values()])
    J = jax.jacfwd(flat)(x)
    for k in range(10):
        step = h * np.eye(10)[k]
        np.testing.assert_allclose(J[:, k], (flat(x + step) - flat(x - step)) / (2 * h), atol=1e-8)


@pytest.mark.parametrize(
    ("args", "message"),
    [
        ((1.0, (0, 0, 0), (1.0, 1.0, 2.0)), "no body with volume"),
        ((-1.0, (0, 0, 0), (1.0, 1.0, 1.0)), "no body with volume"),
        ((1.0, (0, 0), (1.0, 1.0, 1.0)), "centre"),
        ((1.0, (0, 0, 0), np.arange(9.0).reshape(3, 3)), "symmetric"),
    ],
)
def test_faults(args, message):
    with pytest.raises(ModelError, match=message):
        log_cholesky(*args)
    with pytest.raises(ModelError, match="shape"):
        from_log_cholesky(np.zeros(6))
