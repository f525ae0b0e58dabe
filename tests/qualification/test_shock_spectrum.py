"""Shock spectra: case SR1 (half sine), pyYeti, the time after the pulse, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.signal import lsim

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
    """Its peaks are those at samples: it gets the same straight lines at forty points for each sample."""
    srs = pytest.importorskip("pyyeti.srs")
    fine = np.interp(np.arange(399 * 40 + 1) / 40, np.arange(400), NOISE)
    theirs = srs.srs(fine, 8e5, SOME, 10, ic="zero", stype=stype, ppc=1, time="primary", parallel="no")
    np.testing.assert_allclose(shock_spectrum(NOISE, 5e-5, SOME, 10.0, kind).primary, theirs, rtol=5e-5)


@pytest.mark.long
def test_time_after_the_signal():
    padded = np.concatenate([NOISE, np.zeros(20_000)])
    short, long = (shock_spectrum(s, 5e-5, SOME[:4], 10.0) for s in (NOISE, padded))
    np.testing.assert_allclose(short.maximax, long.primary, rtol=1e-7)
    np.testing.assert_allclose(short.positive, long.during[0], rtol=1e-7)
    np.testing.assert_allclose(short.negative, -long.during[1], rtol=1e-7)


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


H = 0.005
BELOW = np.array([0.05, 3.0, 20.0, 40.0, 60.0, 80.0, 95.0, 99.9])  # up to half the sampling rate


def record(n, jump=0.0):
    t = H * np.arange(n)
    signal = np.exp(-2 * t) * np.sin(40 * t) + 0.3 * np.random.default_rng(n).normal(size=n)
    signal[0] = jump
    return signal


def extremes(signal, f, Q, kind, parts=60):
    """Of SciPy's motion at many points of each interval, with a cubic through neighbours."""
    w, r = 2 * np.pi * f, 2 * np.pi * f / Q
    fine = np.interp(np.arange((len(signal) - 1) * parts + 1) / parts, np.arange(len(signal)), signal)
    times = H / parts * np.arange(len(fine))
    C = {"absolute acceleration": [-(w**2), -r], "relative displacement": [1.0, 0], "pseudo velocity": [w, 0]}[kind]
    states = lsim(([[0, 1], [-(w**2), -r]], [[0.0], [-1.0]], np.eye(2), np.zeros((2, 1))), fine, times)[2]
    y, dy = states @ C, np.column_stack([states[:, 1], -(w**2) * states[:, 0] - r * states[:, 1] - fine]) @ C
    cubic = CubicHermiteSpline(times, y, dy)
    turns = cubic.derivative().roots(extrapolate=False)
    values = np.concatenate([y, cubic(turns[np.isfinite(turns)])])
    return max(values.max(), 0.0), min(values.min(), 0.0)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["absolute acceleration", "relative displacement", "pseudo velocity"])
@pytest.mark.parametrize("Q", [0.6, 10.0, np.inf])
@pytest.mark.parametrize("n, jump", [(2, 0.7), (30, 0.0), (300, -0.5)])
def test_extremes_between_samples(kind, Q, n, jump):
    """At every frequency below half the sampling rate, with a first sample that is not zero, too."""
    signal = record(n, jump)
    found = shock_spectrum(signal, H, BELOW, Q, kind)
    wanted = np.array([extremes(signal, f, Q, kind) for f in BELOW]).T
    assert np.max(np.abs(found.during - wanted) / np.max(np.abs(wanted), axis=0)) < 3e-7


@pytest.mark.long
@pytest.mark.parametrize("kind", ["absolute acceleration", "pseudo velocity"])
def test_one_record_given_at_more_points_has_one_spectrum(kind):
    """Value and derivatives, which at each of both agree with differences."""
    signal, fine = record(200), np.arange(199 * 8 + 1) / 8

    def spectrum(p, parts):
        one = p[0] * signal + p[1] * np.roll(signal, 3)
        one = one if parts == 1 else jnp.interp(fine, np.arange(200.0), one)
        found = shock_spectrum(one, p[2] * H / parts, np.array([20.0, 60.0, 95.0]), p[3], kind)
        return jnp.concatenate([found.maximax, found.during[0], found.during[1]])

    p = jnp.array([1.0, 0.1, 1.0, 10.0])
    np.testing.assert_allclose(spectrum(p, 1), spectrum(p, 8), rtol=1e-7)
    coarse, many = (jax.jacrev(lambda p, k=k: spectrum(p, k))(p) for k in (1, 8))
    np.testing.assert_allclose(coarse, many, rtol=1e-5, atol=1e-5 * np.max(np.abs(many)))
    for k in range(4):
        step = 1e-5 * np.eye(4)[k]
        difference = (spectrum(p + step, 1) - spectrum(p - step, 1)) / 2e-5
        np.testing.assert_allclose(coarse[:, k], difference, rtol=1e-5, atol=1e-6 * np.max(np.abs(coarse)))


@pytest.mark.slow
def test_a_record_that_is_not_finite_has_no_spectrum_where_it_is_traced():
    lost = jax.jit(lambda a: shock_spectrum(a * jnp.ones(20), H, BELOW[:2]).during)(jnp.nan)
    assert np.all(np.isnan(lost))


@pytest.mark.long
def test_response_after_the_pulse_is_that_under_zeros():
    step, frequencies = 1e-5, np.array([20.0, 35.0, 60.0, 150.0])
    t = np.arange(1100) * step
    pulse = np.sin(np.pi * t / 0.011)
    pulse[-1] = 0.0
    found = shock_spectrum(pulse, step, frequencies)
    under_zeros = shock_spectrum(np.concatenate([pulse, np.zeros(30_000)]), step, frequencies)
    np.testing.assert_allclose(found.after[1], under_zeros.during[1], rtol=1e-7)
