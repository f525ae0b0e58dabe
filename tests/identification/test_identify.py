"""Identification against certified regressions, closed forms, and what no data can tell."""

import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.errors import ModelError
from jaxmbs.identification import identify

NIST = json.loads((Path(__file__).parent / "ID2_nist_regression.json").read_text())
CERTIFIED = {row["quantity"]: (row["value"], row["tol"]) for row in NIST["outputs"]}


def growth(b, x):
    return b["b1"] * (1 - jnp.exp(-b["b2"] * x))


def rational(b, x):
    return b["b1"] * (x**2 + b["b2"] * x) / (x**2 + b["b3"] * x + b["b4"])


MODELS = {"Misra1a": growth, "BoxBOD": growth, "MGH09": rational}


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("name", list(MODELS))
def test_certified_regressions(name, start):
    """Values and standard deviations from near and far starts; the last is nearly blind and says so."""
    given = NIST["parameters"][name]
    x, y = (np.array(given[k]) for k in "xy")
    first = {f"b{k + 1}": float(b) for k, b in enumerate(given["starts"][start])}
    found = identify(lambda b: MODELS[name](b, x), y, first)
    for k, unknown in enumerate(found.names):
        value, tol = CERTIFIED[f"{name}: {unknown} (certified)"]
        np.testing.assert_allclose(found.values[k], value, rtol=0, atol=tol)
        value, tol = CERTIFIED[f"{name}: standard deviation of {unknown} (certified)"]
        np.testing.assert_allclose(found.standard_error(unknown), value, rtol=0, atol=tol)
    assert found.reason == "converged"
    if name == "MGH09":
        assert not found.ok and found.rank == 3 and found.unseen[0].remedy == "b2"
        assert "b2" in str(found) and "not determined" in str(found)
    else:
        assert found.ok and found.unseen == ()


X = np.linspace(0.0, 1.0, 21)
NOISE = 0.02 * np.random.default_rng(4).normal(size=21)


def line(u):
    """Only `a + 0.4 c` counts, and b."""
    return (u["a"] + 0.4 * u["c"]) * X + u["b"]


DATA = 2.0 * X + 0.5 + NOISE


def test_a_line_in_closed_form():
    """Values, covariance, intervals, chi squared and the band by the normal equations of NumPy, absolute and not."""
    A = np.stack([X, np.ones(21)], 1)
    exact, rest, *_ = np.linalg.lstsq(A, DATA)
    inverse = np.linalg.inv(A.T @ A)
    predict = lambda u: u["a"] * X + u["b"]
    for deviation in (None, 0.02):
        found = identify(predict, DATA, {"a": 1.0, "b": 0.0}, deviations=deviation)
        variance = rest[0] / 19 if deviation is None else 0.02**2
        np.testing.assert_allclose(found.values, exact, rtol=1e-11)
        np.testing.assert_allclose(found.covariance, variance * inverse, rtol=1e-10)
        band = {None: 2.0930240544082634, 0.02: 1.959963984540054}[deviation]  # Student's of 19, normal
        half = band * np.sqrt(variance * np.einsum("np,pq,nq->n", A, inverse, A))
        np.testing.assert_allclose(found.prediction_band(), half, rtol=1e-9)
        np.testing.assert_allclose(found.prediction, A @ exact, rtol=1e-11)
        np.testing.assert_allclose(found.correlations[0, 1], inverse[0, 1] / np.sqrt(np.prod(np.diag(inverse))))
        said = f"noise of {np.sqrt(variance):.4g} estimated" if deviation is None else "chi squared"
        assert said in found.summary()
        chi = rest[0] / (1.0 if deviation is None else 0.02**2)
        np.testing.assert_allclose(found.chi_squared, chi, rtol=1e-9)
        end = found.intervals(95.0)[0, 1]
        rise = found.profile("a", [end])[0] - found.chi_squared
        np.testing.assert_allclose(rise, band**2 * (variance if deviation is None else 1.0), rtol=1e-6)


def test_directions_that_are_not_seen_have_names():
    found = identify(line, DATA, {"a": 1.0, "b": 0.1, "c": 1.0}, deviations=0.02)
    assert found.rank == 2 and not found.ok and len(found.unseen) == 1
    (direction,) = found.unseen
    assert np.isinf(direction.deviation) and set(direction.coefficients) == {"a", "c"}
    ratio = direction.coefficients["a"] / direction.coefficients["c"]
    np.testing.assert_allclose(ratio, -0.4, rtol=1e-8)
    assert np.isinf(found.standard_error("a")) and np.isfinite(found.standard_error("b"))
    seen = found.values[0] + 0.4 * found.values[2]
    np.testing.assert_allclose(seen, np.polyfit(X, DATA, 1)[0], rtol=1e-8)
    # a further experiment that sees c alone shows it, one that sees the same again does not
    assert found.with_experiment([[0.0, 0.0, 50.0]]) == ()
    assert len(found.with_experiment([[1.0, 0.0, 0.4]])) == 1


def test_a_prior_or_a_bound_makes_it_seen():
    first = {"a": 1.0, "b": 0.1, "c": 1.0}
    prior = identify(line, DATA, first, deviations=0.02, prior={"a": None, "b": None, "c": (1.5, 0.1)})
    assert prior.ok and prior.freedom == 21 + 1 - 3
    np.testing.assert_allclose(prior.unknowns["c"], 1.5, rtol=1e-6)
    np.testing.assert_allclose(prior.standard_error("c"), 0.1, rtol=1e-6)
    held = identify(line, DATA, first, deviations=0.02, bounds={"a": (0.0, 9.0), "b": None, "c": (1.0, 1.0)})
    assert held.ok and held.standard_error("c") == 0.0 and "at its bound" in str(held)
    np.testing.assert_allclose(held.values[0], np.polyfit(X, DATA, 1)[0] - 0.4, rtol=1e-9)


def test_an_active_bound_is_said():
    """The others are found as if it were known, but nothing is ok and its own error is not a number."""
    found = identify(lambda u: u["a"] * X + u["b"], DATA, {"a": 1.0, "b": 0.0}, {"a": (0.0, 1.5), "b": None})
    assert found.values[0] == 1.5 and found.at_bound[0] and found.freedom == 20 and "at its bound" in str(found)
    np.testing.assert_allclose(found.values[1], np.mean(DATA - 1.5 * X), rtol=1e-12)
    assert np.isnan(found.standard_error("a")) and np.isfinite(found.standard_error("b")) and found.rank == 1
    assert np.isnan(found.intervals()[0]).all() and np.isnan(found.correlations[0, 1])
    assert not found.ok and list(found.is_cut_off) == [True, False] and "cuts off a = 1.5" in str(found)


@pytest.mark.parametrize("bounds", [(0.0, 1.5), (2.5, 9.0), (1.5, 1.5), (0.0, 9.0)])
@pytest.mark.parametrize("deviation", [0.02, 0.002, None])
def test_verdicts_of_bounds_and_of_chi_squared(bounds, deviation):
    """A bound that cuts off, above or below, one that fixes, one that is wide; right and wrong deviations, or none.

    Chi squared is judged by SciPy's distribution at one in a million.
    """
    from scipy.stats import chi2

    low, high = bounds
    found = identify(
        lambda u: u["a"] * X + u["b"],
        DATA,
        {"a": np.clip(2.2, low, high), "b": 0.0},
        {"a": bounds, "b": None},
        deviations=deviation,
    )
    cut_off = low < high and not low < 2.0 < high
    misfit = deviation is not None and chi2.ppf(1 - 1e-6, found.freedom) < found.chi_squared
    assert misfit == (deviation == 0.002 or (deviation is not None and not low < 2.0 < high))
    assert found.ok == (not cut_off and not misfit)
    assert ("cuts off a" in found.summary()) == cut_off
    assert ("the model does not fit" in found.summary()) == misfit
    fault = found.report().fault
    assert fault == "" if found.ok else "a bound cuts" in fault if cut_off else "farther from the model" in fault
    assert np.isnan(found.standard_error("a")) == cut_off and (found.standard_error("a") == 0.0) == (low == high)


def test_a_search_that_was_stopped_has_no_errors():
    given = NIST["parameters"]["MGH09"]
    x, y = (np.array(given[k]) for k in "xy")
    first = {f"b{k + 1}": float(b) for k, b in enumerate(given["starts"][0])}
    found = identify(lambda b: rational(b, x), y, first, steps=2)
    assert not found.ok and "step limit" in str(found) and np.isnan(found.standard_errors).all()


def test_outliers_count_linearly():
    """Huber's estimate by weights again and again, NumPy."""
    data = DATA.copy()
    data[[3, 11]] += (1.0, -2.0)
    predict = lambda u: u["a"] * X + u["b"]
    found = identify(predict, data, {"a": 1.0, "b": 0.0}, deviations=0.02, robust=1.5)
    A, x = np.stack([X, np.ones(21)], 1), np.zeros(2)
    for _ in range(2000):
        r = np.abs(data - A @ x) / 0.02
        w = np.where(r < 1.5, 1.0, 1.5 / np.maximum(r, 1e-9))
        x = np.linalg.solve(A.T @ (w[:, None] * A), A.T @ (w * data))
    np.testing.assert_allclose(found.values, x, rtol=1e-9)
    plain = identify(predict, data, {"a": 1.0, "b": 0.0}, deviations=0.02)
    assert abs(found.values[0] - 2.0) < 0.1 * abs(plain.values[0] - 2.0) + 0.05


def test_complex_data_gaps_and_starts():
    """Stiffness and damping of a bushing from its transfer function, with a gap; starts between bounds."""
    w = 2 * np.pi * np.geomspace(2.0, 200.0, 40)
    truth = {"k": 2.5e5, "c": 120.0}

    def receptance(u):
        return {"frf": 1.0 / jax.lax.complex(u["k"] - 2.0 * w**2, w * u["c"])}

    rng = np.random.default_rng(0)
    data = np.asarray(receptance(truth)["frf"])
    noise = 1e-3 * np.abs(data)
    data = data + noise * (rng.normal(size=40) + 1j * rng.normal(size=40))
    data[7] = np.nan
    found = identify(
        receptance,
        {"frf": data},
        {"k": 1e4, "c": 1.0},
        bounds={"k": (1e3, 1e6), "c": (0.1, 1e3)},
        deviations={"frf": noise},
        starts=6,
    )
    assert found.ok and found.freedom == 2 * 39 - 2
    for name, value in truth.items():
        assert abs(found.unknowns[name] - value) < 4 * found.standard_error(name) < 0.01 * value
    assert 0.5 < found.chi_squared / found.freedom < 1.6
    assert np.isnan(found.prediction["frf"][7]) and found.prediction["frf"].shape == (40,)


def pendulum(u, like=None):
    b = mbs.SystemBuilder()
    b.body("bob", mass=u["mass"], com=(0, 0, -u["length"]))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("air", mbs.SpringDamper(damping=u["damping"]), joint="pin")
    return b.build(like=like)


TRUTH = {"length": 1.2, "damping": 0.3, "mass": 1.0, "offset": 0.05}
FIRST = {"length": 1.0, "damping": 0.1, "mass": 1.0, "offset": 0.0}


@pytest.mark.long
@pytest.mark.parametrize("gradient", ["forward", "reverse"])
def test_a_pendulum_from_its_record(gradient):
    """From a noisy angle: length, damping over mass, and the sensor's offset; mass and damping share a direction."""
    like, ts = pendulum(FIRST), np.linspace(0.0, 4.0, 60)

    def angle(u):
        system = pendulum(u, like)
        state = mbs.State.at(system, pin=0.8)
        motion = mbs.simulate(system, state, ts=ts, rtol=1e-9, atol=1e-9, gradient=gradient)
        return motion.states.coordinates[:, 0] + u["offset"]

    data = np.asarray(angle(TRUTH)) + 0.01 * np.random.default_rng(2).normal(size=60)
    blind = identify(angle, data, FIRST, deviations=0.01, gradient=gradient)
    (direction,) = blind.unseen
    assert set(direction.coefficients) == {"mass", "damping"}
    ratio = direction.coefficients["damping"] / direction.coefficients["mass"]
    np.testing.assert_allclose(ratio, blind.unknowns["damping"] / blind.unknowns["mass"], rtol=1e-3)
    bounds = {"length": (0.5, 2.0), "damping": (0.0, 2.0), "mass": (1.0, 1.0), "offset": None}
    found = identify(angle, data, FIRST, bounds=bounds, deviations=0.01, gradient=gradient)
    assert found.ok
    for name in ("length", "damping", "offset"):
        assert abs(found.unknowns[name] - TRUTH[name]) < 4 * found.standard_error(name)


@pytest.mark.long
def test_coverage_of_intervals():
    """Of 1 600 records the 95 % intervals of a decay hold the truth in 93.5 to 96.5 %."""
    t = np.linspace(0.0, 3.0, 25)
    truth = np.array([2.0, 0.7])
    clean = truth[0] * np.exp(-truth[1] * t)
    held = np.zeros(2)
    for seed in range(1600):
        data = clean + 0.05 * np.random.default_rng(seed).normal(size=25)
        found = identify(_decay, data, {"a": 1.0, "b": 1.0})
        low, high = found.intervals().T
        held += (low <= truth) & (truth <= high)
    assert np.all((0.935 <= held / 1600) & (held / 1600 <= 0.965)), held / 1600


def _decay(u):
    return u["a"] * jnp.exp(-u["b"] * jnp.linspace(0.0, 3.0, 25))


FAULTS = {
    "shape": (lambda: identify(lambda u: u["a"] * X[:3], DATA, {"a": 1.0}), "has shape"),
    "parts": (lambda: identify(lambda u: {"y": X}, DATA, {"a": 1.0}), "has the parts"),
    "both": (lambda: identify(line, DATA, {"a": 1.0}, deviations=1.0, weights=1.0), "not both"),
    "noise": (lambda: identify(line, DATA, {"a": 1.0}, deviations=-1.0), "positive"),
    "prior": (
        lambda: identify(lambda u: u["a"] * X, DATA, {"a": 1.0}, prior={"a": (1.0, 1.0)}),
        "needs the deviations",
    ),
    "nan": (lambda: identify(lambda u: jnp.sqrt(-1.0 - u["a"] ** 2) * X, DATA, {"a": 1.0}), "not finite"),
    "gaps": (lambda: identify(line, np.full(21, np.nan), {"a": 1.0}), "but gaps"),
    "robust": (lambda: identify(line, DATA, {"a": 1.0}, robust=-1.0), "robust"),
}


@pytest.mark.parametrize("name", list(FAULTS))
def test_faults(name):
    call, message = FAULTS[name]
    with pytest.raises(ModelError, match=message):
        call()


def test_unknown_names_are_refused():
    found = identify(lambda u: u["a"] * X, DATA, {"a": 1.0})
    with pytest.raises(mbs.UnknownNameError, match="did you mean|unknown"):
        found.standard_error("b")
    assert jax.tree.structure(found.unknowns) == jax.tree.structure({"a": 1.0})
