"""Limits with a probability: optima that samples confirm, prices against differences, what is refused."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import Limit, ModelError
from jaxmbs.probability import LogNormal, Normal

SCATTER = {"load": LogNormal(50.0, 5.0), "strength": Normal(400.0, 20.0)}


def rod(lower=0.0):
    margin = lambda d, x: x["strength"] - x["load"] / d["area"]
    return Limit("margin", margin, lower=lower, probability=1e-3, variables=SCATTER, unit="MPa")


def lightest(limit, **options):
    return mbs.minimise(
        lambda d: d["area"], {"area": 0.25}, {"area": (0.05, 1.0)}, limits=limit, progress=False, **options
    )


@pytest.mark.slow
def test_the_lightest_rod():
    """A million samples of the function and of a polynomial confirm the probability; the price is that of
    differences."""
    limit = rod()
    found = lightest(limit)
    assert found.ok and "but for 0.001" in found.table()
    drawn, surrogate = (limit.reliability(found.design, method) for method in ("samples", "pce"))
    assert drawn.samples == 1_000_000 and drawn.ok and surrogate.ok
    np.testing.assert_allclose([drawn.probability, surrogate.probability], 1e-3, rtol=0.1)
    assert surrogate.surrogate_error < 1e-3
    ends = [lightest(rod(h)).value for h in (2.0, -2.0)]
    np.testing.assert_allclose(found.limit("margin").price, (ends[0] - ends[1]) / 4.0, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "share"),
    [
        (lambda d, x: jnp.maximum(x["a"], x["b"]) - d, 0.029),  # medians on the ridge of a kink
        (lambda d, x: x["a"] ** 2 + x["b"] ** 2 + x["a"] - d, 0.0031),  # curved
    ],
)
def test_samples_contradict_a_percentile_of_the_first_order(value, share):
    """Such designs were called ok; shares by a million samples."""
    two = {"a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0)}
    limit = Limit("peak", value, upper=0.0, scale=1.0, probability=1e-3, variables=two)
    found = mbs.minimise(lambda d: d, 5.0, (0.0, 40.0), limits=limit, progress=False, compile="tape")
    low, high = (float(word) for word in found.reason.split("probability of ")[1].split(" by")[0].split(" to "))
    assert not found.ok and 1e-3 < low < share < high


@pytest.mark.long
def test_numbers_of_the_design_scatter_and_each_entry_is_held():
    """A width that is made with a deviation, two stresses of it; forward mode; as a limit beside Worst too."""
    spread = lambda d: {"width": Normal(d["width"], 0.02), "load": Normal(10.0, 1.0)}
    stress = lambda d, x: jnp.stack([1.0, 2.0]) * x["load"] / x["width"]
    limit = Limit("stress", stress, upper=60.0, probability=1e-2, variables=spread)
    options = {"bounds": {"width": (0.1, 2.0)}, "limits": limit, "progress": False}
    found = mbs.minimise(lambda d: d["width"], {"width": 0.5}, **options, gradient="forward")
    assert found.ok and found.limit("stress").after.shape == (2,)
    np.testing.assert_allclose(limit.reliability(found.design).probability, 1e-2, rtol=0.03)
    worst = mbs.minimise(
        mbs.design.Worst(lambda d: jnp.stack([d["width"], 0.5 * d["width"]])), {"width": 0.5}, **options
    )
    np.testing.assert_allclose(worst.value, found.value, rtol=1e-6)


def test_what_is_no_limit_with_a_probability_is_refused():
    margin = lambda d, x: x["a"] - d
    one = {"a": Normal(0.0, 1.0)}
    for options, text in (
        ({"upper": 1.0, "probability": 1.5, "variables": one}, "between 0 and 1"),
        ({"upper": 1.0, "probability": 0.1}, "needs variables"),
        ({"upper": 1.0, "variables": one}, "give that too"),
        ({"lower": 0.0, "upper": 1.0, "probability": 0.1, "variables": one}, "two limits"),
        ({"upper": 1.0, "probability": 0.1, "variables": {"a": 1.0}}, "no distribution"),
    ):
        with pytest.raises(ModelError, match=text):
            Limit("x", margin, **options)
    with pytest.raises(ModelError, match="function of a design"):
        Limit("x", "answer", upper=1.0, probability=0.1, variables=one)
    with pytest.raises(ModelError, match="no probability"):
        Limit("x", margin, upper=1.0).reliability(0.0)
