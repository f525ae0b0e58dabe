"""Limits and curves against SciPy and by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from jaxmbs import blocks


def test_a_saturation_clips_and_has_a_slope_between_its_limits():
    block = blocks.Saturation(-1.0, 2.0)
    u = jnp.array([-3.0, 0.5, 4.0])
    np.testing.assert_allclose(block.output(u, {}, 0.0), [-1.0, 0.5, 2.0])
    assert jax.vmap(jax.grad(lambda u: block.output(u, {}, 0.0)))(u).tolist() == [0.0, 1.0, 0.0]


def test_a_curve_is_that_of_scipy():
    x, y = np.array([0.0, 1.0, 2.5, 4.0]), np.array([0.0, 2.0, 2.2, 5.0])
    block = blocks.LookUp(x, y)
    u = np.linspace(0.1, 3.9, 7)
    found = jax.vmap(lambda u: block.output(u, {}, 0.0))(jnp.asarray(u))
    np.testing.assert_allclose(found, PchipInterpolator(x, y)(u), rtol=1e-12)
    np.testing.assert_allclose([block.output(jnp.asarray(v), {}, 0.0) for v in x], y, atol=1e-12)


def test_a_rate_limit_follows_within_its_rates():
    block, s = blocks.RateLimit(2.0, 1.0, 0.1), {"value": jnp.asarray(1.0)}
    for u, rate in ((1.05, 0.5), (9.0, 2.0), (-9.0, -1.0)):
        np.testing.assert_allclose(block.rate(jnp.asarray(u), s, 0.0)["value"], rate)
    assert block.start(jnp.asarray(3.0), 0.0) == {"value": 3.0} and not block.is_feedthrough


@pytest.mark.parametrize(
    ("block", "fault"),
    [
        (blocks.Saturation(2.0, 1.0), "lower must be below upper"),
        (blocks.LookUp([0.0, 1.0, 1.0], [0.0, 1.0, 2.0]), "x must increase"),
        (blocks.LookUp([0.0], [0.0]), "two or more points"),
        (blocks.RateLimit(0.0), "rising must be positive"),
        (blocks.RateLimit(1.0, -1.0), "falling must be positive"),
        (blocks.RateLimit(1.0, 1.0, 0.0), "time_constant must be positive"),
    ],
)
def test_faults(block, fault):
    assert any(fault in text for text in block.faults())
