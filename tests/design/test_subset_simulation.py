"""Subset simulation against a closed form, over many seeds."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.design import reliability
from jaxmbs.probability import Normal


@pytest.mark.long
def test_a_probability_of_a_millionth_over_twenty_seeds():
    """Index within 0.1, and the intervals hold it as often as they say."""
    index, numbers = 4.753424, {f"x{k}": Normal(0.0, 1.0) for k in range(10)}
    plane = lambda x: index - sum(x.values()) / np.sqrt(10.0)
    found = [reliability(plane, numbers, "subset", seed=seed) for seed in range(20)]
    assert max(abs(one.index - index) for one in found) < 0.1
    inside = [one.confidence[0] < 1e-6 < one.confidence[1] for one in found]
    assert sum(inside) >= 15 and all(one.ok for one in found)
    slopes = [one.index_derivatives["x3"]["mean"] for one in found]
    np.testing.assert_allclose(np.mean(slopes), -1.0 / np.sqrt(10.0), rtol=0.1)


@pytest.mark.slow
def test_failures_that_the_chains_miss_are_told():
    """Two steps, of which the nearer one looks the safer one until it fails: 3.19e-5, of which chains find half."""

    def steps(x):
        first = jnp.where(x["a"] <= 3.5, 0.85 - 0.1 * x["a"], 4.0 - x["a"])
        return jnp.minimum(first, jnp.where(x["b"] <= 2.0, 2.3 - x["b"], 0.5 - 0.1 * x["b"]))

    found = reliability(steps, {"a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0)}, "subset")
    assert abs(found.probability / 3.19e-5 - 1.0) < 0.1 or not found.ok and "missed" in found.faults[0]
    other = reliability(lambda x: 4.0 - x["a"], {"a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0)}, "subset")
    assert other.ok
