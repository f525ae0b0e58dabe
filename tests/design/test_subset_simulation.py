"""Subset simulation against a closed form, over many seeds."""

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
