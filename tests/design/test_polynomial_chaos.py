"""Polynomial chaos: moments and shares in closed form, their derivatives against differences, what is told."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import ModelError
from jaxmbs.design import polynomial_chaos
from jaxmbs.probability import LogNormal, Normal, RandomVariables, Uniform, Weibull


def wear(x):
    return jnp.exp(0.3 * x["load"]) * (1.0 + x["gap"] ** 2) + 0.2 * x["age"]


def variables(mean=1.0, upper=2.0, shape=3.0, age=None):
    return {"load": Normal(mean, 0.4), "gap": Uniform(-1.0, upper), "age": age or Weibull(2.0, shape)}


def numbers(found, name):
    return np.array([found.mean, found.deviation, found.first[name], found.total[name]])


@pytest.mark.long
def test_derivatives_against_differences():
    """Of mean, deviation and shares, by a mean, an end and a shape, whose tail no polynomial follows as well."""
    certain = LogNormal(2.0, 0.3)
    for name, of, by, base, h, age, rtol in (
        ("mean", "load", "mean", 1.0, 1e-3, certain, 1e-5),
        ("upper", "gap", "upper", 2.0, 1e-3, certain, 1e-5),
        ("shape", "age", "shape", 3.0, 1e-1, None, 2e-2),
    ):
        tolerance = 1e-6 if age else 1e-3
        found, *ends = (
            polynomial_chaos(wear, variables(**{name: base + s * h}, age=age), tolerance) for s in (0.0, 1.0, -1.0)
        )
        assert found.ok and found.failed == 0
        wanted = (numbers(ends[0], of) - numbers(ends[1], of)) / (2.0 * h)
        slopes = [found.derivatives[key][of][by] for key in ("mean", "deviation", f"first {of}", f"total {of}")]
        np.testing.assert_allclose(slopes, wanted, rtol=rtol, atol=1e-6)
    other = polynomial_chaos(wear, variables(), gradient="forward")
    np.testing.assert_allclose(numbers(other, "gap"), numbers(polynomial_chaos(wear, variables()), "gap"), rtol=1e-10)


@pytest.mark.slow
def test_a_polynomial_is_found_exactly():
    """Shares of `a + b c` with a normal and two uniform numbers in closed form; a pair acts only together."""
    spread = {"a": Normal(1.0, 0.5), "b": Uniform(-1.0, 1.0), "c": Uniform(-2.0, 2.0)}
    found = polynomial_chaos(lambda x: x["a"] + x["b"] * x["c"], spread)
    parts = np.array([0.25, (1.0 / 3.0) * (4.0 / 3.0)])
    assert found.ok and found.error < 1e-10
    np.testing.assert_allclose([found.mean, found.deviation**2], [1.0, np.sum(parts)], rtol=1e-10)
    np.testing.assert_allclose(found.pairs["b", "c"], parts[1] / np.sum(parts), rtol=1e-10)
    np.testing.assert_allclose([found.first["a"], found.total["c"]], parts / np.sum(parts), rtol=1e-10)
    np.testing.assert_allclose(found.derivatives["deviation"]["a"]["deviation"], 0.5 / found.deviation, rtol=1e-9)
    np.testing.assert_allclose(found.derivatives["mean"]["a"]["mean"], 1.0, rtol=1e-9)
    assert "share together of b, c" in repr(found)


@pytest.mark.slow
def test_what_a_polynomial_cannot_is_told():
    """A kink is not within the tolerance; points without a number are counted."""
    kink = polynomial_chaos(lambda x: jnp.abs(x["a"] - 0.3), {"a": Normal(0.0, 1.0)}, evaluations=40)
    assert not kink.ok and "too few evaluations" in kink.faults[0] and "FAILED" in repr(kink)
    lost = polynomial_chaos(lambda x: jnp.sqrt(x["a"]), {"a": Uniform(-0.2, 1.0)}, evaluations=40)
    assert lost.failed > 0 and any("gave no number" in fault for fault in lost.faults)


def test_correlated_numbers_have_no_shares():
    pair = RandomVariables({"a": LogNormal(1.0, 0.1), "b": Normal(0.0, 1.0)}, {("a", "b"): 0.3})
    with pytest.raises(ModelError, match="variables are correlated"):
        polynomial_chaos(lambda x: x["a"] + x["b"], pair)
    with pytest.raises(ModelError, match="must return one number"):
        polynomial_chaos(lambda x: jnp.stack([x["a"], x["a"]]), {"a": Normal(0.0, 1.0)})
