"""Probabilities by a polynomial and by plain samples, against closed forms; a polynomial that is not good enough."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.design import reliability
from jaxmbs.probability import LogNormal, Normal, RandomVariables

PRODUCT = {"a": LogNormal(3.0, 0.3), "b": LogNormal(2.0, 0.2)}


@pytest.mark.long
def test_a_product_by_every_method():
    """Closed form by the second order, which is exact here, with a correlation too."""
    for variables in (PRODUCT, RandomVariables(PRODUCT, {("a", "b"): 0.4})):
        margin = lambda x: 8.0 - x["a"] * x["b"]
        exact = reliability(margin, variables, "sorm")
        for method, width in (("pce", 0.02), ("samples", 0.05)):
            found = reliability(margin, variables, method)
            assert found.ok and found.confidence[0] * 0.98 < exact.probability < found.confidence[1] * 1.02
            np.testing.assert_allclose(found.probability, exact.probability, rtol=width)
            slopes = [x.derivatives["a"]["mean"] for x in (found, exact)]
            np.testing.assert_allclose(slopes[0], slopes[1], rtol=0.05)


@pytest.mark.long
def test_a_rough_polynomial_and_too_few_failures_are_told():
    margin = lambda x: 3.0 - x["a"] - 2.0 * jnp.abs(x["b"])
    found = reliability(margin, {"a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0)}, "pce", samples=1000)
    assert not found.ok and "the polynomial is" in found.faults[0]
    few = reliability(lambda x: 4.0 - x["a"], {"a": Normal(0.0, 1.0)}, "samples", samples=200)
    assert not few.ok and "says little" in few.faults[0]
