"""A simulated test campaign: slow sweeps on a soft suspension, noise, and the uncertainty of what is recovered."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from jax import lax

from jaxmbs.experiment._decoupling import decouple
from jaxmbs.experiment._rig import free_response, remove_stiffness
from jaxmbs.experiment._sine_sweep import sweep_amplitudes, sweep_phase, sweep_variance
from jaxmbs.experiment._uncertainty import (
    add_noise,
    coherence_variance,
    mean_of_repeats,
    noise_variance,
    propagate,
    propagate_scalar,
)
from jaxmbs.linear._transfer import TransferFunctions

N, ENDS = 4, [0, 3]
K = 2000.0 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
K[0, 0] = K[-1, -1] = 2000.0
C, M = 4e-3 * K, np.eye(N)
SOFT, LEAK = 60.0, 3.0  # stiffness and damping of the suspension at both ends
HOLD = np.eye(N)[:, ENDS] @ np.eye(N)[ENDS]


def free(omega):
    w = omega[:, None, None]
    return np.linalg.inv(K + 1j * w * C - w**2 * M)[:, :, ENDS]


def drive(force, rate):
    """Displacements and velocities (samples, 2 N, runs) under forces at the ends, linear between samples."""
    A = np.block([[np.zeros((N, N)), np.eye(N)], [-K - SOFT * HOLD, -C - LEAK * HOLD]])
    E = np.concatenate([np.zeros((N, 2)), np.eye(N)[:, ENDS]])
    whole = np.zeros((12, 12))
    whole[:8, :8], whole[:8, 8:10], whole[8:10, 10:] = A, E, np.eye(2) * rate
    step = scipy.linalg.expm(whole / rate)
    Phi, now, change = jnp.asarray(step[:8, :8]), jnp.asarray(step[:8, 8:10]), jnp.asarray(step[:8, 10:])

    def advance(x, pair):
        f, g = pair
        x = Phi @ x + now @ f + change @ (g - f)
        return x, x

    start = jnp.zeros((8, force.shape[2]))
    return jnp.concatenate([start[None], lax.scan(advance, start, (force[:-1], force[1:]))[1]])


@pytest.mark.long
def test_amplitudes_of_a_known_sweep():
    """Amplitudes that change linearly along the sweep come out exactly; noise as predicted."""
    t = jnp.asarray(np.arange(4000) / 200.0)
    phase, _ = sweep_phase(t, 20.0, 120.0, 20.0)
    A, B = np.array([1.0 - 2j, 0.3j]), np.array([0.01 + 0.02j, -0.05])
    amplitude = jnp.asarray(A)[:, None] + jnp.asarray(B)[:, None] * t.astype(complex)[None]
    signals = jnp.real(amplitude * jnp.exp(1j * phase.astype(complex))[None]) + 0.7
    at = [300, 1500, 3600]
    np.testing.assert_allclose(sweep_amplitudes(signals, phase, at, 200), amplitude[:, np.array(at)].T, rtol=1e-9)
    noise = 0.1 * jax.random.normal(jax.random.key(0), (300, 4000))
    found = sweep_amplitudes(noise, phase, [1500], 200)
    np.testing.assert_allclose(jnp.mean(jnp.abs(found) ** 2), sweep_variance(0.1, 200), rtol=0.25)
    with pytest.raises(ValueError, match="at least 200 samples"):
        sweep_amplitudes(signals, phase, [100], 200)


@pytest.mark.long
def test_sweep_on_a_soft_suspension():
    """Sweeps up and down in and out of phase: the free structure comes back, also where the suspension still acts."""
    rate, duration = 200.0, 300.0
    t = jnp.asarray(np.arange(int(rate * duration)) / rate)
    low, high, level = 2 * np.pi * 1.0, 2 * np.pi * 12.0, 5.0
    centres = np.arange(1500, len(t) - 1500, 400)
    runs = jnp.array([[1.0, 1.0], [1.0, -1.0]])
    simulate = jax.jit(lambda force: drive(force, rate))
    found = []
    for start, end in ((low, high), (high, low)):
        phase, omega = sweep_phase(t, start, end, duration)
        force = level * jnp.cos(phase)[:, None, None] * runs[None]
        x = simulate(force)
        support = -SOFT * x[:, np.array(ENDS)] - LEAK * x[:, N + np.array(ENDS)]
        signals = jnp.concatenate([x[:, :N], force, support], axis=1)
        flat = signals.reshape(len(t), -1).T
        Z = sweep_amplitudes(flat, phase, centres, 120).reshape(len(centres), N + 4, 2)
        B = free_response(Z[:, :N], Z[:, N : N + 2], Z[:, N + 2 :]).receptance
        held = free_response(Z[:, :N], Z[:, N : N + 2]).receptance
        w = np.asarray(omega)[centres]
        order = np.argsort(w)
        found.append((w[order], B[order], held[order]))
    grid = np.linspace(10.0, 70.0, 61)

    def at(w, B):
        flat = np.asarray(B).reshape(len(w), -1)
        parts = [np.interp(grid, w, c.real) + 1j * np.interp(grid, w, c.imag) for c in flat.T]
        return np.stack(parts, 1).reshape(len(grid), N, 2)

    def error(B):
        truth = free(grid)
        return np.linalg.norm(B - truth, axis=(1, 2)) / np.linalg.norm(truth, axis=(1, 2))

    mean = (at(*found[0][:2]) + at(*found[1][:2])) / 2
    held = (at(found[0][0], found[0][2]) + at(found[1][0], found[1][2])) / 2
    assert np.max(error(mean)) < 0.03
    assert np.max(error(held)) > 0.2
    assert np.max(error(at(*found[0][:2]))) > 2 * np.max(error(mean))


def measurements():
    """Motions, forces and support forces (frequencies, 4 + 2 + 2, 3 runs) of one campaign, without noise."""
    omega = np.linspace(10.0, 80.0, 25)
    w = omega[:, None, None]
    r = np.random.default_rng(0)
    F = r.normal(size=(25, 2, 3)) + 1j * r.normal(size=(25, 2, 3))
    Z = K + 1j * w * C - w**2 * M + (SOFT + 1j * w * LEAK) * HOLD
    X = np.linalg.solve(Z, np.eye(N)[:, ENDS] @ F)
    R = -(SOFT + 1j * w * LEAK) * X[:, ENDS]
    return omega, jnp.asarray(np.concatenate([X, F, R], axis=1))


def recovered(values):
    return free_response(values[:, :N], values[:, N : N + 2], values[:, N + 2 :]).receptance


@pytest.mark.long
def test_error_bars_of_the_free_structure():
    """Noise on every signal: predicted variances against 400 samples, and the truth inside three of them."""
    omega, clean = measurements()
    variance = noise_variance(clean, 0.01, 1e-6)
    found, predicted = jax.jit(lambda v: propagate(recovered, v, variance))(clean)
    np.testing.assert_allclose(found, free(omega), rtol=1e-9, atol=1e-12)
    samples = jax.jit(jax.vmap(lambda key: recovered(add_noise(key, clean, variance))))(
        jax.random.split(jax.random.key(1), 400)
    )
    ratio = np.mean(np.abs(samples - found[None]) ** 2, axis=0) / predicted
    assert 0.95 < ratio.mean() < 1.08 and ratio.min() > 0.75 and ratio.max() < 1.4
    inside = np.abs(samples[0] - found) < 3 * np.sqrt(predicted)
    assert inside.mean() > 0.99
    low = clean.astype(np.complex64)
    found32, predicted32 = propagate(recovered, low, noise_variance(low, 0.01, 1e-6))
    assert found32.dtype == np.complex64 and predicted32.dtype == np.float32
    np.testing.assert_allclose(predicted32, predicted, rtol=1e-2)
    mean, of_mean = mean_of_repeats(samples)
    np.testing.assert_allclose(of_mean * 400, predicted, rtol=0.4)
    assert np.mean(np.abs(mean - found) < 4 * np.sqrt(of_mean)) > 0.98


@pytest.mark.long
def test_error_bars_of_a_number():
    """Largest response over frequency (a smooth maximum), by one adjoint; against samples."""
    omega, clean = measurements()
    variance = noise_variance(clean, 0.01)

    def peak(values):
        return jax.nn.logsumexp(2e3 * jnp.abs(recovered(values)[:, 0, 0])) / 2e3

    value, predicted = jax.jit(lambda v: propagate_scalar(peak, v, variance))(clean)
    keys = jax.random.split(jax.random.key(3), 400)
    samples = jax.jit(jax.vmap(lambda key: peak(add_noise(key, clean, variance))))(keys)
    np.testing.assert_allclose(np.var(samples), predicted, rtol=0.3)
    assert abs(np.mean(samples) - value) < np.sqrt(predicted)


@pytest.mark.long
def test_error_bars_through_decoupling_and_a_known_rig():
    """Truncated decoupling and the taking out of a rig, against samples."""
    omega = np.linspace(10.0, 80.0, 9)
    w = omega[:, None, None]
    Z = K + 1j * w * C - w**2 * M
    names = list("abcd")
    on_rig = TransferFunctions(omega, np.linalg.inv(Z + 300.0 * HOLD), names, names)
    rig = TransferFunctions(omega, np.ones((9, 1, 1)) / (300.0 - 0.2j * omega[:, None, None]), ["a"], ["a"])
    variance = noise_variance(on_rig.values, 0.003)
    for f in (
        lambda v: decouple(on_rig.with_values(v), rig, ["a"], rank=1).values[:, :3, 1:],
        lambda v: remove_stiffness(on_rig.with_values(v), ["a", "d"], 300.0 * np.eye(2)).values,
    ):
        found, predicted = jax.jit(lambda v, f=f: propagate(f, v, variance))(on_rig.values)
        keys = jax.random.split(jax.random.key(2), 400)
        samples = jax.jit(jax.vmap(lambda key, f=f: f(add_noise(key, on_rig.values, variance))))(keys)
        ratio = np.mean(np.abs(samples - found[None]) ** 2, axis=0) / predicted
        assert 0.9 < ratio.mean() < 1.15


def test_variance_from_coherence():
    """H1 of a noisy output over 40 averages, many times: the scatter is what the coherence predicts."""
    r = np.random.default_rng(6)
    H, averages = 2.0 - 1j, 40
    shape = (4000, averages)
    f, n = (r.normal(size=shape) + 1j * r.normal(size=shape) for _ in range(2))
    x = H * f + 1.5 * n
    xf, ff, xx = (np.mean(a, 1) for a in (x * f.conj(), np.abs(f) ** 2, np.abs(x) ** 2))
    estimate, coherence = xf / ff, np.abs(xf) ** 2 / (ff * xx)
    predicted = coherence_variance(jnp.asarray(estimate), jnp.asarray(coherence), averages)
    np.testing.assert_allclose(np.mean(predicted), np.mean(np.abs(estimate - H) ** 2), rtol=0.07)
