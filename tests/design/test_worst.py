"""The largest of many numbers as objective and limit, against linear programs of SciPy."""

import importlib.util

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import linprog

import jaxmbs as mbs
from jaxmbs.design import Limit, Worst

X = np.linspace(0.0, 1.0, 9)
POWERS = np.stack([np.ones(9), X], 1)


def errors(d):
    """Of a straight line through the exponential, and their opposites."""
    miss = d["a"] + d["b"] * X - jnp.exp(X)
    return jnp.stack([miss, -miss])


def chebyshev(most_slope=None):
    """Best line in the sense of Chebyshev by linear programming: (a, b), error, multipliers (2, 9)."""
    A = np.concatenate([np.c_[POWERS, -np.ones(9)], np.c_[-POWERS, -np.ones(9)]])
    bounds = [(None, None), (None, most_slope), (None, None)]
    found = linprog([0, 0, 1], A, np.r_[np.exp(X), -np.exp(X)], bounds=bounds)
    return found.x[:2], found.x[2], -found.ineqlin.marginals.reshape(2, 9)


OPTIMISERS = ["SLSQP", "trust-constr", *(["MMA", "CCSAQ"] if importlib.util.find_spec("nlopt") else [])]


@pytest.mark.parametrize("optimiser", OPTIMISERS)
def test_the_best_line_of_chebyshev(optimiser):
    """Design, error and prices, by each optimiser that takes limits."""
    design, error, weights = chebyshev()
    found = mbs.minimise(
        Worst(errors),
        {"a": 0.0, "b": 0.0},
        {"a": (-3.0, 3.0), "b": (-3.0, 3.0)},
        optimiser,
        steps=500,
        progress=False,
    )
    assert found.ok or optimiser in ("MMA", "CCSAQ"), found.reason
    tolerance = 1e-6 if optimiser in ("SLSQP", "trust-constr") else 1e-3
    np.testing.assert_allclose(found.value, error, rtol=tolerance)
    np.testing.assert_allclose([found.design["a"], found.design["b"]], design, rtol=10 * tolerance)
    np.testing.assert_allclose(found.value, np.max(errors(found.design)), rtol=1e-12)
    assert found.initial_value == pytest.approx(np.e)
    assert found.names == ("a", "b") and found.lower.shape == (2,) and set(found.design) == {"a", "b"}
    if optimiser == "SLSQP":
        numbers = found.limit("worst")
        np.testing.assert_allclose(-numbers.prices, weights, atol=1e-5)
        np.testing.assert_allclose(np.sum(numbers.prices), -1.0, rtol=1e-6)
        np.testing.assert_allclose(numbers.after, errors(found.design), atol=1e-12)
        assert "worst[" in found.table() and numbers.bound == found.value


@pytest.mark.parametrize("size", [1e-9, 1e7])
def test_the_unit_of_the_numbers_does_not_matter(size):
    found = mbs.minimise(Worst(lambda d: size * errors(d)), {"a": 0.0, "b": 0.0}, progress=False)
    assert found.ok
    np.testing.assert_allclose(found.value, size * chebyshev()[1], rtol=1e-6)


@pytest.mark.parametrize("start", [0.0, -1.0])
def test_numbers_that_are_zero_or_negative_at_first(start):
    """The largest of `x - 1, -x - 1, -3` and of their negative parts: its minimum is at zero."""
    found = mbs.minimise(
        Worst(lambda d: jnp.stack([d["x"], -d["x"], -3.0 + 0.0 * d["x"]]) + start), {"x": 0.7}, progress=False
    )
    assert found.ok and abs(found.design["x"]) < 1e-6
    np.testing.assert_allclose(found.value, start, atol=1e-6)


def test_beside_limits_answers_starts_and_callbacks():
    """A limit on a slope by name and one by function; many first designs, each with a bound of its own."""
    seen = []
    limits = [Limit("slope", "slope", upper=1.5), Limit("height", lambda d: d["a"], lower=-10.0)]
    worst = Worst(lambda d: (errors(d), {"slope": d["b"]}), name="miss")
    bounds = {"a": (-3.0, 3.0), "b": (-3.0, 3.0)}
    options = {"limits": limits, "progress": False}
    one = mbs.minimise(worst, {"a": 0.0, "b": 0.0}, bounds, callback=lambda k, d, f: seen.append(set(d)), **options)
    design, error, _ = chebyshev(1.5)
    assert one.ok and [limit.name for limit in one.limits] == ["miss", "slope", "height"] and {"a", "b"} in seen
    np.testing.assert_allclose(one.value, error, rtol=1e-6)
    step = 1e-4  # the price of the slope, against the linear program with another
    price = (chebyshev(1.5 + step)[1] - chebyshev(1.5 - step)[1]) / (2 * step)
    np.testing.assert_allclose(one.limit("slope").price, price, rtol=1e-5)
    many = mbs.minimise(worst, {"a": 0.0, "b": 0.0}, bounds, starts=4, **options)
    assert many.ok and len(many.starts) == 4
    np.testing.assert_allclose([each.value for each in many.starts], error, rtol=1e-5)
    assert len({each.initial_value for each in many.starts}) == 4


def test_as_a_limit():
    """The steepest line that misses by no more than a quarter, against a linear program."""
    limit = Limit("miss", Worst(errors), upper=0.25)
    found = mbs.minimise(lambda d: -d["b"], {"a": 0.0, "b": 0.0}, limits=limit, progress=False)
    A = np.concatenate([POWERS, -POWERS])
    exact = linprog([0, -1], A, np.r_[np.exp(X) + 0.25, -np.exp(X) + 0.25], bounds=[(None, None)] * 2)
    assert found.ok and found.limit("miss").after.shape == (2, 9)
    np.testing.assert_allclose(found.design["b"], exact.x[1], rtol=1e-6)


def test_worst_as_a_function():
    """In a batch, a gradient and a program: the largest number."""
    d = {"a": jnp.array([0.0, 1.0]), "b": jnp.array([0.0, 1.0])}
    rows = mbs.batch(Worst(errors), d, progress=False)
    np.testing.assert_allclose(rows.values, [np.e, np.max(np.abs(1 + X - np.exp(X)))], rtol=1e-12)
    slope = jax.grad(Worst(errors))({"a": 0.0, "b": 0.0})
    np.testing.assert_allclose([slope["a"], slope["b"]], [-1.0, -1.0])


def test_refusals():
    with pytest.raises(ValueError, match="an upper bound only"):
        Limit("miss", Worst(errors), lower=0.0)
    with pytest.raises(ValueError, match=r"design\.Worst"):
        mbs.minimise(Worst(errors), {"a": 0.0, "b": 0.0}, optimiser="L-BFGS-B", progress=False)
    with pytest.raises(TypeError, match="function"):
        Worst(np.ones(3))
    with pytest.raises(ValueError, match="several limits are named 'worst'"):
        taken = Limit("worst", lambda d: d["a"], upper=1.0)
        mbs.minimise(Worst(errors), {"a": 0.0, "b": 0.0}, limits=taken, progress=False)
    with pytest.raises(TypeError, match="smooth objectives"):
        mbs.design.pareto(Worst(errors), lambda d: d["a"] ** 2, {"a": 0.0, "b": 0.0}, progress=False)
