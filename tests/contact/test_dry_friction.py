"""Coefficient of friction over sliding speed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.contact import DryFriction


def test_coefficients_by_their_formulas():
    v = np.array([1e-5, 3e-4, 0.7e-2, 1e-2, 0.3, 2.0])
    along = jax.vmap(lambda v, f: f.resistance(v * jnp.array([0.6, 0.0, 0.8])) * v, (0, None))
    w = v / 1e-2
    plain = 0.3 * (1.0 + 0.5 * np.exp(-(w**2) / 100.0)) * np.tanh(w)
    np.testing.assert_allclose(along(v, DryFriction(0.3, 1.5, 1e-2)), plain, rtol=1e-13)
    brown = 0.3 * (np.tanh(4.0 * w) + 0.5 * w / (w**2 / 4 + 0.75) ** 2)
    found = along(v, DryFriction(0.3, 1.5, 1e-2, "brown-mcphee"))
    np.testing.assert_allclose(found, brown, rtol=1e-13)
    np.testing.assert_allclose(found[3], 0.45, rtol=1e-3)  # the top, at the transition speed


@pytest.mark.parametrize("model", ["coulomb", "brown-mcphee"])
def test_derivatives_at_rest_and_at_the_end_of_the_series(model):
    def force(v):
        return -DryFriction(0.3, 1.5, 1e-2, model).resistance(v) * v

    slope = jax.jacfwd(force)
    at_rest = slope(jnp.zeros(3))
    np.testing.assert_allclose(at_rest, at_rest[0, 0] * np.eye(3), rtol=1e-12)
    assert at_rest[0, 0] < -30.0
    for x in (np.sqrt(1e-3) * 1e-2, np.sqrt(1e-3) * 1e-2 / 4, 4e-3):
        v, h = jnp.array([0.6, 0.0, 0.8]) * x, 1e-8
        differences = np.stack([(force(v + h * e) - force(v - h * e)) / (2 * h) for e in np.eye(3)], 1)
        np.testing.assert_allclose(slope(v), differences, atol=1e-6 * abs(float(at_rest[0, 0])))


def test_model_names():
    with pytest.raises(ValueError, match="'coulomb' or 'brown-mcphee', not 'stribeck'"):
        DryFriction(0.3, model="stribeck")
