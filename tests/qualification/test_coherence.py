"""Coherence that depends on frequency: quadrature of the closed form of an oscillator, derivatives, faults."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import jaxmbs as mbs
from jaxmbs.errors import ModelError
from jaxmbs.fatigue import psd_table
from jaxmbs.qualification import Coordinates, RandomForce, WhiteNoise, random_response
from jaxmbs.qualification._coherence import coherence_of

NATURAL, RATIO, BAND = 20.0, 0.05, (5.0, 80.0)
FIRST, SECOND = 2.0, 8.0  # [N^2/Hz]
TABLE = ([5.0, 30.0, 80.0], [0.9, 0.2 + 0.3j, 0.1])


def rms(coherence, scale=1.0):
    w = 2 * np.pi * NATURAL
    system = mbs.LinearSystem(mass=np.eye(1), stiffness=[[w**2]], coordinates=["m z"])
    level = lambda value: psd_table(BAND, [value, value], "N^2/Hz")
    inputs = {"a": RandomForce(level(FIRST), {"m z": 1.0}), "b": RandomForce(level(SECOND), {"m z": scale})}
    out = {"x": Coordinates("m z", "displacement")}
    return random_response(system, inputs, out, coherence={("a", "b"): coherence}, ratios=RATIO).rms[0]


def exact(coherence, scale=1.0):
    w = 2 * np.pi * NATURAL

    def density(f):
        gain = 1.0 / abs(w**2 - (2 * np.pi * f) ** 2 + 2j * RATIO * w * 2 * np.pi * f) ** 2
        return gain * (FIRST + scale**2 * SECOND + 2 * scale * np.sqrt(FIRST * SECOND) * np.real(coherence(f)))

    return np.sqrt(quad(density, *BAND, points=[NATURAL, 30.0], epsrel=1e-12, limit=500)[0])


def of_table(f):
    return np.interp(f, TABLE[0], np.asarray(TABLE[1]))


@pytest.mark.parametrize(
    "given, closed",
    [
        (TABLE, of_table),
        (lambda f: jnp.exp(-f / 15.0), lambda f: np.exp(-f / 15.0)),
        pytest.param(
            lambda f: jnp.exp(-(0.02 + 0.1j) * f.astype(complex)),
            lambda f: np.exp(-(0.02 + 0.1j) * f),
            marks=pytest.mark.long,
        ),
        (0.5, lambda f: 0.5),
    ],
    ids=["table", "decay", "delay", "number"],
)
def test_against_the_integral(given, closed):
    np.testing.assert_allclose(rms(given), exact(closed), rtol=1e-9)


@pytest.mark.long
def test_derivatives_by_values_and_by_what_it_multiplies():
    found = jax.grad(lambda v: rms((TABLE[0], v * jnp.asarray(TABLE[1]))))(0.9)
    h = 1e-5
    slope = (exact(lambda f: (0.9 + h) * of_table(f)) - exact(lambda f: (0.9 - h) * of_table(f))) / 2 / h
    np.testing.assert_allclose(found, slope, rtol=1e-7)
    found = jax.jit(jax.grad(lambda s: rms(TABLE, s)))(1.5)
    np.testing.assert_allclose(found, (exact(of_table, 1.5 + h) - exact(of_table, 1.5 - h)) / 2 / h, rtol=1e-7)


@pytest.mark.parametrize(
    "value, said",
    [
        (lambda f: 1.0 + 0.01 * f, "not positive semidefinite at 80 Hz"),
        (([5.0, 80.0], [0.5, 1.5]), "not positive semidefinite at 80 Hz"),
        (([5.0, 5.0], [0.5, 0.5]), "must rise"),
        (([5.0, 8.0, 9.0], [0.5, 0.5]), "3 frequencies and 2 values"),
        (np.ones(4), "must be a number"),
        ("0.5", "must be a number"),
        (None, "must be a number"),
    ],
)
def test_faults(value, said):
    with pytest.raises(ModelError, match=said):
        coherence_of(("a", "b"), {("a", "b"): value}, (jnp.array(BAND),))


def test_white_noise_has_a_number():
    system = mbs.LinearSystem(mass=np.eye(1), stiffness=[[100.0]], coordinates=["m z"])
    inputs = {k: RandomForce(WhiteNoise(1.0, "force"), {"m z": 1.0}) for k in "ab"}
    with pytest.raises(ModelError, match="white noise has a coherence that is a number"):
        out = {"x": Coordinates("m z", "displacement")}
        random_response(system, inputs, out, coherence={("a", "b"): TABLE}, ratios=0.1)
