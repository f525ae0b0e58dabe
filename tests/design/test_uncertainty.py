"""Scatter, tolerances and sensitivities against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import norm

from jaxmbs.design import propagate_uncertainty, sensitivities, tolerances
from jaxmbs.studies import normal


def product(design):
    return design["a"] * design["b"]


def test_scatter():
    """a b of independent normal numbers: mean and variance in closed form, first order leaves the last term out."""
    design, sigma = {"a": 3.0, "b": 2.0}, {"a": 0.3, "b": 0.1}
    first = propagate_uncertainty(product, design, sigma)
    variance = (2.0 * 0.3) ** 2 + (3.0 * 0.1) ** 2
    np.testing.assert_allclose([first.mean, first.deviation], [6.0, np.sqrt(variance)], rtol=1e-12)
    np.testing.assert_allclose(first.percentile, 6.0 + 1.6448536 * np.sqrt(variance), rtol=1e-6)
    drawn = propagate_uncertainty(product, design, sigma, samples=4096)
    np.testing.assert_allclose(drawn.mean, 6.0, rtol=1e-3)
    np.testing.assert_allclose(drawn.deviation, np.sqrt(variance + (0.3 * 0.1) ** 2), rtol=1e-2)
    assert drawn.failed == 0
    lost = propagate_uncertainty(lambda d: jnp.sqrt(d["a"] - 3.0), design, sigma, samples=256)
    assert 120 <= lost.failed <= 136 and np.isfinite(lost.mean)


def test_the_yield_between_limits():
    """Of a sum of normal numbers in closed form, by the gradient and by samples."""
    design, sigma = {"a": 3.0, "b": 2.0}, {"a": 0.3, "b": 0.4}
    both = lambda d: jnp.stack([d["a"] + d["b"], d["a"] - 3.0 * d["b"]])
    spread = np.array([0.5, np.hypot(0.3, 1.2)])
    wanted = norm.cdf((np.array([5.4, -2.5]) - [5.0, -3.0]) / spread)
    first, drawn = (
        propagate_uncertainty(both, design, sigma),
        propagate_uncertainty(both, design, sigma, samples=4096),
    )
    np.testing.assert_allclose(first.fraction_within(upper=np.array([5.4, -2.5])), wanted, rtol=1e-12)
    np.testing.assert_allclose(drawn.fraction_within(upper=np.array([5.4, -2.5])), wanted, atol=3e-3)
    np.testing.assert_allclose(first.fraction_within(4.5, 5.5)[0], norm.cdf(1.0) - norm.cdf(-1.0))
    np.testing.assert_allclose(first.fraction_within(), 1.0)
    np.testing.assert_array_equal(
        propagate_uncertainty(product, design, {"a": 0.0, "b": 0.0}).fraction_within(6.0, 6.5), 1.0
    )
    lost = propagate_uncertainty(lambda d: jnp.sqrt(d["a"] - 3.0), design, sigma, samples=256)
    np.testing.assert_allclose(lost.fraction_within(), 0.5, atol=0.02)  # what failed lies outside
    with pytest.raises(ValueError, match="limits cross"):
        first.fraction_within(2.0, 1.0)


@pytest.mark.parametrize("good", [0, 1, 2])
def test_samples_that_fail(good):
    """Few or none with numbers: nan for what cannot be said, and how many failed."""
    start = {"a": 3.0}
    points = np.sort(propagate_uncertainty(lambda d: d["a"], start, {"a": 1.0}, samples=16).samples)
    least = points[16 - good - 1]
    found = propagate_uncertainty(lambda d: jnp.where(d["a"] > least, d["a"], jnp.nan), start, {"a": 1.0}, samples=16)
    assert found.failed == 16 - good and found.samples.shape == (good,)
    assert np.isfinite(found.mean) == np.isfinite(found.percentile) == (good > 0)
    assert np.isfinite(found.deviation) == (good > 1)
    np.testing.assert_allclose(found.fraction_within(), good / 16)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", [100, 128])
def test_any_number_of_samples_without_a_warning(number):
    assert propagate_uncertainty(
        product, {"a": 1.0, "b": 1.0}, {"a": 0.1, "b": 0.1}, samples=number
    ).samples.shape == (number,)
    assert set(sensitivities(product, {"a": (0.0, 1.0), "b": (0.0, 1.0)}, samples=number)) == {"a", "b"}


@jax.custom_vjp
def backwards(a, b):
    return a * b


backwards.defvjp(lambda a, b: (a * b, (a, b)), lambda held, g: (g * held[1], g * held[0]))


def forwards(a, b):
    """By a loop that has no derivative in reverse mode."""
    return jax.lax.while_loop(lambda k: k[0] < 1, lambda k: (k[0] + 1, k[1] * a), (0, b))[1]


@pytest.mark.parametrize(("gradient", "known"), [("forward", forwards), ("reverse", backwards)])
def test_either_mode_of_gradients(gradient, known):
    """Of functions that have one of them only, as motions do."""
    function = lambda d: known(d["a"], d["b"])
    design, width = {"a": 3.0, "b": 2.0}, {"a": 0.1, "b": 0.2}
    assert [row.name for row in tolerances(function, design, width, gradient=gradient)] == ["b", "a"]
    assert propagate_uncertainty(function, design, width, gradient=gradient).deviation == pytest.approx(
        np.hypot(0.2, 0.6)
    )
    bounds = {"a": (0.0, 1.0), "b": (0.0, 1.0)}
    found = sensitivities(function, bounds, gradient=gradient)
    assert found == pytest.approx(sensitivities(product, bounds))
    other = "forward" if gradient == "reverse" else "reverse"
    with pytest.raises((TypeError, ValueError), match="custom_vjp|[Rr]everse-mode"):
        tolerances(function, design, width, gradient=other)


def test_a_normal_scatter_as_a_plan():
    plan = normal({"a": 3.0, "b": np.array([1.0, 2.0])}, {"a": 0.3, "b": 0.0}, 1024)
    assert plan.designs["a"].shape == (1024,) and plan.designs["b"].shape == (1024, 2)
    np.testing.assert_allclose([np.mean(plan.designs["a"]), np.std(plan.designs["a"])], [3.0, 0.3], rtol=1e-2)
    np.testing.assert_array_equal(plan.designs["b"], np.tile([1.0, 2.0], (1024, 1)))
    np.testing.assert_allclose(norm.cdf((plan.designs["a"] - 3.0) / 0.3).mean(), 0.5, atol=1e-3)
    with pytest.raises(ValueError, match="must not be negative"):
        normal({"a": 3.0}, {"a": -1.0}, 4)


def test_tolerances_are_ranked():
    rows = tolerances(product, {"a": 3.0, "b": 2.0}, {"a": 0.1, "b": 0.2})
    assert [row.name for row in rows] == ["b", "a"]
    np.testing.assert_allclose([row.change for row in rows], [0.6, 0.2])
    np.testing.assert_allclose([row.share for row in rows], [0.9, 0.1])


def test_global_sensitivities():
    """Of a linear function: c_i^2 w_i^2 / pi^2 over the variance sum c_i^2 w_i^2 / 12."""
    bounds = {"x": (0.0, 2.0), "y": (-1.0, 1.0), "z": (0.0, 1.0)}
    found = sensitivities(lambda d: 3.0 * d["x"] + 1.0 * d["y"] + 0.0 * d["z"], bounds, samples=1024)
    shares = np.array([36.0, 4.0, 0.0]) / 40.0
    np.testing.assert_allclose(list(found.values()), 12.0 / np.pi**2 * shares, rtol=1e-2, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: propagate_uncertainty(product, {"a": 1.0, "b": 1.0}, {"a": 1.0}), "structure of the design"),
        (lambda: propagate_uncertainty(product, {"a": 1.0, "b": 1.0}, {"a": 1.0, "b": -1.0}), "must not be negative"),
        (
            lambda: propagate_uncertainty(product, {"a": 1.0, "b": 1.0}, {"a": 1.0, "b": 1.0}, percent=100.0),
            "between 0 and 100",
        ),
        (lambda: tolerances(product, {"a": 1.0, "b": 1.0}, {"a": np.nan, "b": 1.0}), "must not be negative"),
        (lambda: sensitivities(product, {"a": (1.0, 0.0), "b": (0.0, 1.0)}), "bounds must be finite"),
        (
            lambda: propagate_uncertainty(product, {"a": 1.0, "b": 1.0}, {"a": np.ones(2), "b": 1.0}),
            "in the shapes of the design",
        ),
        (
            lambda: propagate_uncertainty(product, {"a": 1.0, "b": 1.0}, {"a": 1.0, "b": 1.0}, samples=1),
            "at least two",
        ),
        (
            lambda: propagate_uncertainty(product, {"a": 1.0, "b": 1.0}, {"a": 1.0, "b": 1.0}, gradient="back"),
            "'back'",
        ),
        (lambda: tolerances(lambda d: jnp.stack([d, d]), 1.0, 0.1), "return one number"),
        (lambda: tolerances(lambda d: jnp.sqrt(d), 0.0, 0.1), "gradient is not finite for: design"),
        (lambda: tolerances(lambda d: jnp.log(d - 1.0), 0.5, 0.1), "the answer is nan"),
        (lambda: sensitivities(lambda d: d["a"] * jnp.nan, {"a": (0.0, 1.0)}), "0 of 256 designs gave numbers"),
    ],
)
def test_faults(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("samples", [None, 8])
@pytest.mark.parametrize("answer", [lambda d: {"y": d}, lambda d: "y", lambda d: jax.lax.complex(d, d)])
def test_answers_that_are_no_numbers(answer, samples):
    with pytest.raises(TypeError, match="return one real number or array"):
        propagate_uncertainty(answer, 1.0, 0.1, samples=samples)
    with pytest.raises(TypeError, match="return one real number or array"):
        tolerances(answer, 1.0, 0.1)


def test_samples_left_out_are_warned_of():
    with pytest.warns(UserWarning, match="designs gave no numbers and are left out"):
        sensitivities(lambda d: jnp.sqrt(d["a"]), {"a": (-1.0, 1.0)})
