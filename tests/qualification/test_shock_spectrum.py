"""Shock spectra: case SR1 (half sine), pyYeti, the time after the pulse, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.qualification import shock_spectrum

F = np.array([10.0, 20, 45, 73.5, 100, 200, 500, 1000, 2000])
DAMPED = [
    *(20.258786948010712, 39.155613112050396, 72.76490800200918, 82.56876410184334, 79.56978565565475),
    *(56.98031054859815, 52.350950961420196, 50.37821466081561, 50.04670811454318),
]
UNDAMPED = [
    *(21.752182552535686, 42.04189320701231, 78.1419303452385, 88.42274784194737, 84.68895714686798),
    *(59.41398338637069, 54.99999999999999, 52.258840290933, 51.131623707953736),
]
STEP = 0.011 / 2200
PULSE = 50 * np.sin(np.pi * np.arange(2201) / 2200)
RNG = np.random.default_rng(0)
NOISE = np.concatenate([RNG.standard_normal(399) * np.hanning(399), [0.0]])
SOME = np.geomspace(30, 2000, 7)


@pytest.mark.long
@pytest.mark.parametrize("Q, wanted", [(10.0, DAMPED), (np.inf, UNDAMPED)])
def test_half_sine(Q, wanted):
    np.testing.assert_allclose(mbs.shock_spectrum(PULSE, STEP, F, Q).maximax, wanted, rtol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize(
    "kind, stype",
    [("absolute acceleration", "absacce"), ("relative displacement", "reldisp"), ("pseudo velocity", "pvelo")],
)
def test_pyyeti_agrees(kind, stype):
    srs = pytest.importorskip("pyyeti.srs")
    theirs = srs.srs(NOISE, 2e4, SOME, 10, ic="zero", stype=stype, ppc=1, time="primary", parallel="no")
    np.testing.assert_allclose(shock_spectrum(NOISE, 5e-5, SOME, 10.0, kind).primary, theirs, rtol=1e-5)


@pytest.mark.long
def test_time_after_the_signal():
    padded = np.concatenate([NOISE, np.zeros(20_000)])
    short, long = (shock_spectrum(s, 5e-5, SOME[:4], 10.0) for s in (NOISE, padded))
    np.testing.assert_allclose(short.maximax, long.primary, rtol=3e-4)  # peaks at samples
    np.testing.assert_allclose(short.positive, long.during[0], rtol=3e-4)
    np.testing.assert_allclose(short.negative, -long.during[1], rtol=3e-4)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["absolute acceleration", "pseudo velocity"])
def test_derivatives(kind):
    def total(p):
        signal = p[0] * NOISE + p[1] * np.roll(NOISE, 40)
        return jnp.sum(shock_spectrum(signal, 5e-5, p[2] * SOME, p[3], kind).maximax)

    p = jnp.array([1.0, 0.3, 1.0, 10.0])
    gradient = jax.grad(total)(p)
    np.testing.assert_allclose(gradient, jax.jacfwd(total)(p), rtol=1e-10)
    for k in range(4):
        h = 1e-6 * jnp.eye(4)[k]
        np.testing.assert_allclose(gradient[k], (total(p + h) - total(p - h)) / 2e-6, rtol=1e-5)


@pytest.mark.parametrize(
    "change, word",
    [({"kind": "jerk"}, "kind"), ({"step": 0.0}, "positive"), ({"Q": 0.5}, "Q"), ({"step": 1.0}, "Hz")],
)
def test_wrong_numbers(change, word):
    with pytest.raises(ValueError, match=word):
        shock_spectrum(**({"signal": NOISE, "step": 5e-5, "frequencies": SOME} | change))


@pytest.mark.slow
def test_response_after_the_pulse_is_that_under_zeros():
    """Peaks are taken at the samples, at least 600 a period."""
    step, frequencies = 1e-5, np.array([20.0, 35.0, 60.0, 150.0])
    t = np.arange(1100) * step
    pulse = np.sin(np.pi * t / 0.011)
    pulse[-1] = 0.0
    found = shock_spectrum(pulse, step, frequencies)
    under_zeros = shock_spectrum(np.concatenate([pulse, np.zeros(30_000)]), step, frequencies)
    np.testing.assert_allclose(found.after[1], under_zeros.during[1], rtol=1e-4)
