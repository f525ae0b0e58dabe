"""Envelopes over load cases: values, places and cases, factors, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.coupling import limit_loads
from jaxmbs.errors import ModelError
from jaxmbs.qualification import LoadCase, load_envelope, response_spectrum

from .test_random_response import oscillator

T = np.linspace(0.0, 1.0, 5)
FIRST = np.array([[0.0, 1, -1, 2, 0], [5.0, 0, 0, -7, 0]]).T
SECOND = np.array([[0.0, 0, 1.5, 0, -4], [0.0, 1, 0, 0, 0]]).T


def envelope(first, second, factor=1.5):
    names = ["bolt x", "bolt y"]
    return load_envelope(
        [LoadCase("lift-off", first, names, T), LoadCase("landing", second, names, T, factor=factor)]
    )


def test_values_places_and_cases():
    found = envelope(FIRST, SECOND)
    np.testing.assert_allclose(found.highest, [2.25, 5.0])
    np.testing.assert_allclose(found.lowest, [-6.0, -7.0])
    np.testing.assert_allclose(found.at_highest, [0.5, 0.0])
    np.testing.assert_allclose(found.at_lowest, [1.0, 0.75])
    assert list(np.asarray(found.case_highest)) == [1, 0] and list(np.asarray(found.case_lowest)) == [1, 0]
    np.testing.assert_allclose(found.margins([12.0, 14.0]), [1.0, 1.0])
    assert "landing" in str(found) and "bolt x" in str(found)


@pytest.mark.long
def test_limit_values_and_response_spectra():
    """Loads without a place in time: limit values of pairs of modes, and peaks of a response spectrum."""
    limits = limit_loads(np.array([[3.0, 1.0], [-2.0, 0.5]]), np.array([[4.0, 1.0]]))
    given = LoadCase("separation", limits, ["bolt x", "bolt y"], factor=1.1)
    np.testing.assert_allclose(given.highest, [np.hypot(12, 1), np.hypot(8, 0.5)])
    found = load_envelope([given, LoadCase("landing", FIRST, ["bolt x", "bolt y"], T)])
    np.testing.assert_allclose(found.limits, 1.1 * limits)
    assert "- " in str(found) and "separation" in str(found)
    spectrum = ([1.0, 1e3], [4.0, 4.0])
    shock = LoadCase("shock", response_spectrum(oscillator(40.0), spectrum, ["m z"], ratios=None, unit="m/s^2"))
    np.testing.assert_allclose([shock.highest[0], shock.lowest[0], shock.at_highest[0]], [4.0, -4.0, 40.0])


@pytest.mark.long
def test_derivative_is_that_of_the_case_that_determines_it():
    found = jax.grad(lambda x: envelope(jnp.asarray(FIRST), x).limits[0])(jnp.asarray(SECOND))
    expected = np.zeros((5, 2))
    expected[4, 0] = -1.5
    np.testing.assert_allclose(found, expected)


def test_faults():
    with pytest.raises(ModelError, match="no load case"):
        load_envelope([])
    with pytest.raises(ModelError, match="two load cases"):
        load_envelope([LoadCase("a", FIRST, ["x", "y"], T)] * 2)
    with pytest.raises(ModelError, match="times of shape"):
        LoadCase("a", FIRST, ["x", "y"], T[:3])


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"names": "xy"}, r"names are given in a list, \['xy'\]"),
        ({"names": ["bolt", "bolt"]}, "'bolt' stands there twice"),
        ({"times": T[::-1]}, "times must rise"),
        ({"times": np.full(5, np.nan)}, "times must rise"),
        ({"loads": np.zeros((0, 2)), "times": np.zeros(0)}, "a history without a time"),
        pytest.param(
            {"factor": "1.5"}, "factor must be one positive number", marks=pytest.mark.user
        ),  # the hook of the quick tests refuses it by its type
    ],
)
def test_what_would_be_read_otherwise_is_refused(wrong, said):
    given = {"loads": FIRST, "names": ["x", "y"], "times": T}
    with pytest.raises(ModelError, match=said):
        LoadCase("landing", **{**given, **wrong})


def test_as_many_allowed_loads_as_components():
    with pytest.raises(ModelError, match="give one load, or 2, one for each component"):
        envelope(FIRST, SECOND).margins([1.0, 2.0, 3.0])
    np.testing.assert_allclose(envelope(FIRST, SECOND).margins(14.0), [14 / 6 - 1, 1.0])
