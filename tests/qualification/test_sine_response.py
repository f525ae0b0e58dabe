"""Sine tests: amplification of an oscillator, notches to a limit, their derivative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.errors import ModelError
from jaxmbs.qualification import Coordinates, sine_response

from .test_random_response import oscillator

pytestmark = pytest.mark.long
OUT = {"a": Coordinates("m z")}
LEVELS = [5.0, 100.0], [1.0, 1.0]


def test_amplification_and_notch():
    found = sine_response(oscillator(40.0), LEVELS, OUT, unit="g")
    np.testing.assert_allclose(jnp.max(found.amplitudes), 9.80665 * np.sqrt(101) * 1.0, rtol=2e-3)
    assert np.all(np.asarray(found.limiting) == -1) and np.all(found.notch_depth == 1.0)
    limited = sine_response(oscillator(40.0), LEVELS, OUT, notch={"a": 50.0}, unit="g")
    np.testing.assert_allclose(limited.peaks[0], 50.0, rtol=1e-12)
    inside = np.asarray(limited.limiting) == 0
    np.testing.assert_allclose(limited.amplitudes[inside, 0], 50.0, rtol=1e-12)
    np.testing.assert_allclose(limited.notch_depth[~inside], 1.0)
    np.testing.assert_allclose(limited.fastest_sweep, 77.6 * 40.0 / 100, rtol=2e-3)


def test_derivative_of_a_notched_input():
    def level(f):
        return sine_response(
            oscillator(f), LEVELS, OUT, notch={"a": 50.0}, frequencies=jnp.array([41.0]), unit="g"
        ).input[0]

    np.testing.assert_allclose(jax.grad(level)(40.0), (level(40.001) - level(39.999)) / 0.002, rtol=1e-6)


def test_faults():
    with pytest.raises(ModelError, match="did you mean|there is no output"):
        sine_response(oscillator(40.0), LEVELS, OUT, notch={"b": 50.0}, unit="g")
    with pytest.raises(ModelError, match="unknown unit"):
        sine_response(oscillator(40.0), LEVELS, OUT, unit="dB")


@pytest.mark.parametrize("frequencies", [[4.9], [50.0, 100.1], [np.nan]])
def test_nothing_is_specified_outside_of_the_levels(frequencies):
    with pytest.raises(ModelError, match="outside of the specification, 5 to 100 Hz"):
        sine_response(oscillator(40.0), LEVELS, OUT, frequencies=frequencies, unit="g")
    traced = jax.jit(lambda f: sine_response(oscillator(40.0), LEVELS, OUT, frequencies=f, unit="g").input)
    assert np.isnan(traced(jnp.asarray(frequencies))[-1])


def test_at_a_step_the_larger_amplitude_holds():
    stepped = [5.0, 20.0, 20.0, 100.0], [1.0, 1.0, 0.5, 0.5]
    found = sine_response(oscillator(40.0), stepped, OUT, frequencies=[19.0, 20.0, 21.0], unit="g")
    np.testing.assert_allclose(found.levels, 9.80665 * np.array([1.0, 1.0, 0.5]))


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"levels": ([5.0, 100.0], [1.0, np.nan])}, "amplitudes must be positive and finite"),
        ({"levels": ([5.0, np.nan], [1.0, 1.0])}, "frequencies must be finite"),
        ({"notch": {"a": np.nan}}, "notch: the limit of 'a' must be one positive"),
        ({"notch": {"a": "50"}}, "notch: the limit of 'a' must be one positive"),
    ],
)
def test_no_number_is_no_level(wrong, said):
    with pytest.raises(ModelError, match=said):
        sine_response(oscillator(40.0), **{"levels": LEVELS, "out": OUT, "unit": "g", **wrong})


def test_levels_without_a_unit_are_told():
    with pytest.warns(DeprecationWarning, match="sine_response: no unit"):
        told = sine_response(oscillator(40.0), LEVELS, OUT)
    np.testing.assert_array_equal(told.peaks, sine_response(oscillator(40.0), LEVELS, OUT, unit="g").peaks)
