"""The beta distribution against SciPy's incomplete beta function."""

import numpy as np
import pytest
from scipy import special, stats

from jaxmbs.probability import Beta


@pytest.mark.parametrize(("a", "b"), [(2.0, 3.0), (0.5, 0.7), (30.0, 5.0), (0.3, 8.0)])
def test_tails(a, b):
    """Probabilities at the quantiles, down to 1e-12 from either end."""
    mean, deviation = a / (a + b), np.sqrt(a * b / (a + b + 1.0)) / (a + b)
    own = Beta(mean, deviation, 0.0, 1.0)
    np.testing.assert_allclose(own.exponents(), [a, b], rtol=1e-12)
    u = np.array([-7.0, -1.0, 2.0])
    x = np.asarray(own.from_normal(u))
    np.testing.assert_allclose(special.betainc(a, b, x), stats.norm.cdf(u), rtol=1e-11)
    np.testing.assert_allclose(own.to_normal(x), u, rtol=1e-9)
