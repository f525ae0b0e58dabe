"""The distribution of measured numbers."""

import numpy as np
from scipy.stats import norm

from jaxmbs.probability import Empirical


def test_through_the_samples_and_straight_beyond():
    x = np.array([3.0, 1.0, 2.0, 5.0])
    own = Empirical(x)
    scores = norm.ppf((np.arange(4) + 0.5) / 4)
    np.testing.assert_allclose(own.from_normal(scores), np.sort(x), rtol=1e-14)
    beyond = np.asarray(own.from_normal(np.array([2.0, 3.0, 4.0])))
    np.testing.assert_allclose(beyond[2] - beyond[1], beyond[1] - beyond[0], rtol=1e-12)
    np.testing.assert_allclose(
        own.to_normal(own.from_normal(np.array([-2.0, 0.3, 2.5]))), [-2.0, 0.3, 2.5], atol=1e-9
    )


def test_many_normal_samples_are_normal():
    x = 2.0 + 0.5 * norm.ppf((np.arange(400) + 0.5) / 400)
    np.testing.assert_allclose(Empirical(x).from_normal(np.array([-2.0, 0.1, 2.0])), [1.0, 2.05, 3.0], rtol=1e-5)
    np.testing.assert_allclose(Empirical(x).with_moments(0.0, 1.0).from_normal(0.5), 0.5, atol=5e-3)
