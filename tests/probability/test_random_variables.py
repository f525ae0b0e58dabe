"""Correlation of random numbers by that of normal ones."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import ModelError
from jaxmbs.probability import Empirical, Gumbel, LogNormal, Normal, RandomVariables, Uniform


def normal_correlation(one, other, rho):
    return RandomVariables({"a": one, "b": other}, {("a", "b"): rho}).normal_correlation()[0, 1]


def of_lognormals(deviation):
    """Closed form, of means 1 and 2, deviations of one as given and 1 for the other, correlation 0.5."""
    return np.log1p(0.25 * deviation) / np.sqrt(np.log1p(deviation**2) * np.log1p(0.25))


@pytest.mark.slow
def test_closed_forms_and_a_published_ratio():
    found = normal_correlation(LogNormal(1.0, 0.3), LogNormal(2.0, 1.0), 0.5)
    np.testing.assert_allclose(found, of_lognormals(0.3), rtol=1e-12)
    found = normal_correlation(Uniform(0.0, 1.0), Uniform(2.0, 5.0), 0.5)
    np.testing.assert_allclose(found, 2.0 * np.sin(np.pi * 0.5 / 6.0), rtol=1e-11)
    # Liu and Der Kiureghian 1986, table 2: the ratio of a normal and a Gumbel number
    np.testing.assert_allclose(normal_correlation(Normal(0.0, 1.0), Gumbel(0.0, 1.0), 0.5), 0.5 * 1.031, atol=5e-4)


@pytest.mark.long
def test_derivatives():
    def correlation(deviation):
        return normal_correlation(LogNormal(1.0, deviation), LogNormal(2.0, 1.0), 0.5)

    h = 1e-5
    slope = (of_lognormals(0.3 + h) - of_lognormals(0.3 - h)) / (2.0 * h)
    np.testing.assert_allclose(jax.grad(correlation)(0.3), slope, rtol=1e-8)
    np.testing.assert_allclose(jax.jacfwd(correlation)(0.3), slope, rtol=1e-8)


@pytest.mark.long
def test_samples_have_the_correlation():
    variables = RandomVariables(
        {"b": Gumbel(1.0, 2.0), "a": LogNormal(1.0, 0.4), "c": Normal(0.0, 3.0)}, {("b", "a"): -0.6, ("a", "c"): 0.3}
    )
    u = np.random.default_rng(0).normal(size=(200_000, 3))
    drawn = jax.jit(jax.vmap(variables.from_normal))(jnp.asarray(u))
    found = np.corrcoef([drawn["a"], drawn["b"], drawn["c"]])
    np.testing.assert_allclose(found[[0, 0, 1], [1, 2, 2]], [-0.6, 0.3, 0.0], atol=0.01)
    np.testing.assert_allclose(np.std(drawn["b"]), 2.0, rtol=0.01)


@pytest.mark.long
def test_samples_of_two_measured_groups_have_the_correlation():
    """Numbers with a gap, which a few polynomials do not see, and with themselves."""
    two = Empirical(np.concatenate([np.linspace(-2.0, -1.8, 50), np.linspace(3.0, 3.1, 50)]))
    for other in (two, Uniform(0.0, 1.0)):
        variables = RandomVariables({"a": two, "b": other}, {("a", "b"): 0.7})
        u = np.random.default_rng(0).normal(size=(400_000, 2))
        drawn = jax.jit(jax.vmap(variables.from_normal))(jnp.asarray(u))
        np.testing.assert_allclose(np.corrcoef(drawn["a"], drawn["b"])[0, 1], 0.7, atol=0.004)
    RandomVariables({"a": two, "b": two}, {("a", "b"): 0.9999})


def test_what_cannot_be_is_refused_by_name():
    with pytest.raises(ModelError, match=r"'a' and 'b' cannot have the correlation -0.9.*between -0.3077 and 1"):
        RandomVariables({"a": LogNormal(1.0, 1.5), "b": LogNormal(2.0, 3.0)}, {("a", "b"): -0.9})
    three = {name: Normal(0.0, 1.0) for name in "abc"}
    with pytest.raises(ModelError, match="not positive definite"):
        RandomVariables(three, {("a", "b"): 0.9, ("a", "c"): 0.9, ("b", "c"): -0.9})
    with pytest.raises(ModelError) as error:
        RandomVariables({"a": 3.0, "b": three["b"]}, {("a", "mass"): 0.5, ("b", "a"): 2.0})
    for text in ("'a' has no distribution", "no variable 'mass'", "between -1 and 1"):
        assert text in str(error.value)
