"""Distributions in closed form against SciPy's, far into both tails."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from jaxmbs import ModelError
from jaxmbs.probability import Beta, Empirical, Gumbel, LogNormal, Normal, Triangular, Uniform, Weibull

U = np.array([-7.5, -3.0, -1.0, 0.0, 0.5, 2.0, 5.0, 7.5])
SCALE = 0.5 * np.sqrt(6.0) / np.pi  # of Gumbel's distribution with a deviation of 0.5
FAMILIES = {
    "normal": (Normal(3.0, 0.5), stats.norm(3.0, 0.5)),
    "lognormal": (LogNormal(2e5, 2e4), stats.lognorm(np.sqrt(np.log(1.01)), scale=2e5 / np.sqrt(1.01))),
    "uniform": (Uniform(1.0, 4.0), stats.uniform(1.0, 3.0)),
    "Weibull": (Weibull(2.0, 1.7, 0.5), stats.weibull_min(1.7, 0.5, 2.0)),
    "largest": (Gumbel(3.0, 0.5), stats.gumbel_r(3.0 - np.euler_gamma * SCALE, SCALE)),
    "smallest": (Gumbel(3.0, 0.5, of="smallest"), stats.gumbel_l(3.0 + np.euler_gamma * SCALE, SCALE)),
    "triangular": (Triangular(1.0, 2.0, 4.0), stats.triang(1.0 / 3.0, 1.0, 3.0)),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_quantiles_moments_and_densities_of_scipy(name):
    own, known = FAMILIES[name]
    x = np.where(U < 0.0, known.ppf(stats.norm.cdf(U)), known.isf(stats.norm.sf(U)))
    np.testing.assert_allclose(own.from_normal(U), x, rtol=1e-10)
    np.testing.assert_allclose(own.moments(), [known.mean(), known.std()], rtol=1e-12)
    inner = slice(1, 6)  # at the ends of a distribution x has lost the digits of its distance to them
    np.testing.assert_allclose(own.to_normal(x)[inner], U[inner], atol=1e-8)
    np.testing.assert_allclose(own.density(x[inner]), known.pdf(x[inner]), rtol=1e-8)
    np.testing.assert_allclose(own.cumulative(x[inner]), known.cdf(x[inner]), rtol=1e-8)
    wanted = (1.1 * known.mean(), 0.8 * known.std())
    np.testing.assert_allclose(own.with_moments(*wanted).moments(), wanted, rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(
    "made",
    [
        lambda a, b: LogNormal(a, b),
        lambda a, b: Uniform(a - b, a + b),
        lambda a, b: Gumbel(a, b, of="smallest"),
        lambda a, b: Weibull(a, b, 0.1 * b),
        lambda a, b: Weibull(1.0, 2.0, 0.1).with_moments(a, b),
        lambda a, b: Triangular(0.0, b, a + 1.0),
        lambda a, b: Beta(a, 0.3 * b, 0.0, 3.0),
        lambda a, b: Empirical(jnp.stack([a, b, a * b, a - b, 0.1 * a])),
    ],
)
def test_slopes_against_differences(made):
    """By the number, at the median too where both tails meet, and by the parameters; second ones as well."""

    @jax.jit
    def value(x):
        return made(x[0], x[1]).from_normal(x[2])

    slopes, curvatures = jax.jit(jax.grad(value)), jax.jit(jax.hessian(value))
    for u in (-2.0, 0.0, 1.5):
        x, h = jnp.array([1.3, 0.7, u]), 1e-6
        differences = [(value(x.at[k].add(h)) - value(x.at[k].add(-h))) / (2.0 * h) for k in range(3)]
        np.testing.assert_allclose(slopes(x), differences, rtol=1e-6, atol=1e-8)
        if not isinstance(made(1.3, 0.7), Empirical | Triangular):  # whose curvatures have steps
            bent = [(slopes(x.at[k].add(h)) - slopes(x.at[k].add(-h))) / (2.0 * h) for k in range(3)]
            np.testing.assert_allclose(curvatures(x), bent, rtol=1e-5, atol=1e-6)


def test_what_is_no_distribution_is_refused():
    for made, text in (
        (lambda: Normal(0.0, 0.0), "deviation must be positive"),
        (lambda: LogNormal(-1.0, 0.1), "mean must be positive"),
        (lambda: Uniform(2.0, 1.0), "must ascend"),
        (lambda: Triangular(0.0, 3.0, 2.0), "must ascend"),
        (lambda: Gumbel(1.0, 1.0, of="middle"), "of must be"),
        (lambda: Weibull(np.ones(2), 1.0), "scale must be one number"),
        (lambda: Beta(0.5, 0.6, 0.0, 1.0), "more than numbers between these ends"),
        (lambda: Empirical([1.0, 1.0, 1.0]), "not all equal"),
    ):
        with pytest.raises(ModelError, match=text):
            made()
