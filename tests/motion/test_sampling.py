"""Motions of sampled blocks between their saved times and samples, against SciPy's matrix exponential."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs.motion import peak
from tests.motion.test_simulate_samples import KI, KP, KT, PERIOD, TARGET, J, L, R, motor, start

A = np.array([[0.0, KT / J, 0.0], [-KT / L, -R / L, 1.0 / L], [0.0, 0.0, 0.0]])  # speed, current, held voltage


def exact(t, kp=KP, ki=KI, every=PERIOD, after=False):
    """Speed, current and voltage at a time, at a sample before it or `after`: every piece in closed form."""
    x, integral, k = np.array([0.5, 0.3, 0.0]), 0.2, 0
    x[2] = kp * (TARGET - x[0]) + integral  # that the start holds
    while k * every < t - 1e-12 or (after and abs(k * every - t) < 1e-12):
        error = TARGET - x[0]
        x[2] = kp * error + integral
        integral += every * ki * error
        x = expm(A * min(every, t - k * every)) @ x
        k += 1
    return x


def rows(states):
    return np.stack([states.velocities[..., 0], *(states.internal[n] for n in ("motor.current", "loop.output"))], -1)


@pytest.mark.long
@pytest.mark.parametrize("saved", [0.013, PERIOD, 3.7 * PERIOD])
def test_states_between_samples_and_saved_times(saved):
    """Saved finer than the samples, at them, and coarser: what is held is that of the sample before."""
    system = motor()
    motion = mbs.simulate(system, start(system), ts=saved * np.arange(6), rtol=1e-11, atol=1e-12)
    t = np.sort(np.random.default_rng(1).uniform(0.0, 5.0 * saved, 12))
    np.testing.assert_allclose(rows(motion.at(system, t)), [exact(x) for x in t], atol=1e-9)
    np.testing.assert_allclose(rows(motion.at(system, motion.ts)), rows(motion.states), atol=1e-10)


@pytest.mark.long
def test_the_motion_with_its_samples_and_its_peaks():
    system, ts = motor(), 5.0 * PERIOD * np.arange(4)
    motion = mbs.simulate(system, start(system), ts=ts, rtol=1e-11, atol=1e-12)
    whole = motion.with_knots(system)
    times = np.asarray(whole.ts)
    np.testing.assert_allclose(np.unique(times.round(9)), (PERIOD * np.arange(16)).round(9))
    twice = np.append(False, times[1:] == times[:-1])
    wanted = [exact(t, after=side) for t, side in zip(times, twice, strict=True)]
    assert twice.sum() == 15  # each sample but that at the end, where none is taken
    np.testing.assert_allclose(rows(whole.states), wanted, atol=1e-9)
    assert np.abs(whole.diagnostics.energy_residual).max() < 1e-8
    fine = np.linspace(0.0, ts[-1], 3001)
    current = np.array([exact(t)[1] for t in fine])
    most = peak(system, motion, lambda s: s.internal["motor.current"])
    assert float(most.value) == pytest.approx(current.max(), abs=2e-5)
    assert float(most.value) == pytest.approx(exact(float(most.time))[1], abs=1e-5)
    steepest = peak(system, motion, lambda s: -s.internal["loop.output"])
    least = min(exact(t, after=True)[2] for t in PERIOD * np.arange(15))
    assert float(steepest.value) == pytest.approx(-min(least, exact(0.0)[2]), abs=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_derivatives_between_samples(gradient):
    like, t = motor(), np.array([0.013, 0.051, 0.097])

    def found(x):
        system = motor(x[0], x[1], like=like)
        motion = mbs.simulate(
            system, start(system), ts=np.array([0.0, 0.1]), gradient=gradient, rtol=1e-11, atol=1e-12
        )
        states = motion.at(system, t)
        return jnp.stack([states.velocities[:, 0], states.internal["motor.current"]], axis=1)

    x, h = np.array([KP, KI]), 1e-5
    J_found = jax.jit((jax.jacrev if gradient == "reverse" else jax.jacfwd)(found))(x)
    wanted = [
        [(np.array([exact(s, *(x + d))[:2] for s in t]) - [exact(s, *(x - d))[:2] for s in t]) / (2 * h)]
        for d in h * np.eye(2)
    ]
    np.testing.assert_allclose(np.moveaxis(J_found, 2, 0), np.array(wanted)[:, 0], atol=1e-6)
