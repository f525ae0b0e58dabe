# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Removing the test rig
#
# What one wants are transfer functions of the free structure; what one measures hangs on something and carries a
# fixture. Here a test campaign is simulated, with noise, and the rig is taken out by computation: first a soft
# suspension whose forces are measured, then a fixture that was measured on its own. Every result has its error bar.

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import scipy.linalg

from jaxmbs import experiment, linear

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## The structure and its suspension
# Four masses in a row between springs, driven at both ends. Springs with dynamometers carry the ends: the rigid
# motion on the suspension lies below 1 Hz, the structure's first mode at 5.4 Hz.

# %%
N, ENDS = 4, np.array([0, 3])
K = 2000.0 * (2 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
K[0, 0] = K[-1, -1] = 2000.0
C, M = 3e-3 * K, np.eye(N)
SOFT, LEAK = 30.0, 1.0
at_ends = np.eye(N)[:, ENDS] @ np.eye(N)[ENDS]
for name, stiffness in (("free", K), ("suspended", K + SOFT * at_ends)):
    squares = np.maximum(scipy.linalg.eigh(stiffness, M, eigvals_only=True), 0.0)
    print(f"{name:10s}", np.round(np.sqrt(squares) / (2 * np.pi), 3), "Hz")


def truth(omega):
    w = np.asarray(omega)[:, None, None]
    return np.linalg.inv(K + 1j * w * C - w**2 * M)[:, :, ENDS]


# %% [markdown]
# ## Slow sweeps
# Two exciters, in phase and out of phase, each swept up and down. The motion between samples is exact for forces that
# are linear in between; then every signal gets noise.

# %%
RATE, DURATION = 200.0, (60.0 if FAST else 600.0)
LOW, HIGH = 2 * np.pi * 1.5, 2 * np.pi * 15.0
RUNS = np.array([[1.0, 1.0], [1.0, -1.0]])  # exciters by runs
time = np.arange(int(RATE * DURATION)) / RATE

A = np.block([[np.zeros((N, N)), np.eye(N)], [-K - SOFT * at_ends, -C - LEAK * at_ends]])
whole = np.zeros((2 * N + 4, 2 * N + 4))
whole[: 2 * N, : 2 * N], whole[N : 2 * N, 2 * N : 2 * N + 2] = A, np.eye(N)[:, ENDS]
whole[2 * N : 2 * N + 2, 2 * N + 2 :] = RATE * np.eye(2)
step = jnp.asarray(scipy.linalg.expm(whole / RATE)[: 2 * N])


@jax.jit
def motion(force):
    def advance(x, ends):
        x = step @ jnp.concatenate([x, ends[0], ends[1] - ends[0]])
        return x, x

    return jax.lax.scan(advance, jnp.zeros((2 * N, 2)), (force[:-1], force[1:]))[1]


def sweep(start, end, level, noise, seed):
    """Phase, frequency and signals (4 motions, 2 exciters, 2 supports; samples; runs) of a sweep."""
    phase, omega = experiment.sweep_phase(time, start, end, DURATION)
    force = level * np.cos(phase)[:, None, None] * RUNS
    x = np.concatenate([np.zeros((1, 2 * N, 2)), motion(force)])
    support = -SOFT * x[:, ENDS] - LEAK * x[:, N + ENDS]
    signals = np.concatenate([x[:, :N], force, support], axis=1).transpose(1, 0, 2)
    return phase, omega, signals + noise[:, None, None] * np.random.default_rng(seed).normal(size=signals.shape)


LEVEL = 5.0
NOISE = np.array([5e-4] * N + [0.05] * 2 + [0.02] * 2)  # m, N: standard deviation of each sample
WIDTH = 80 if FAST else 200
centres = np.arange(WIDTH + 200, len(time) - WIDTH - 200, (60 if FAST else 200))


def amplitudes(start, end, level=LEVEL, seed=0):
    """Frequencies, rising, and complex amplitudes (frequencies, 8 signals, runs)."""
    phase, omega, signals = sweep(start, end, level, NOISE, seed)
    flat = jnp.asarray(signals.transpose(0, 2, 1).reshape(-1, len(time)))
    found = experiment.sweep_amplitudes(flat, jnp.asarray(phase), centres, WIDTH).reshape(len(centres), -1, 2)
    order = np.argsort(omega[centres])
    return omega[centres][order], found[order]


up, Z_up = amplitudes(LOW, HIGH, seed=1)
down, Z_down = amplitudes(HIGH, LOW, seed=2)
print(f"{len(up)} frequencies from {up[0] / 2 / np.pi:.2f} to {up[-1] / 2 / np.pi:.2f} Hz")

# %% [markdown]
# ## Taking the suspension out
# The structure does not know which forces are the exciters' and which the supports': $X = B_{free}(F + R)$ over the
# runs, at each frequency. With the support forces left out, the result is the suspended structure's.


# %%
def free(signals):
    return experiment.free_response(signals[:, :N], signals[:, N : N + 2], signals[:, N + 2 :]).receptance


def suspended(signals):
    return experiment.free_response(signals[:, :N], signals[:, N : N + 2]).receptance


variance = jnp.broadcast_to(jnp.asarray(experiment.sweep_variance(NOISE, WIDTH))[None, :, None], Z_up.shape)
B_up, var_up = experiment.propagate(free, Z_up, variance)
B_down, var_down = experiment.propagate(free, Z_down, variance)


def to_up(values):
    """Values of the sweep down at the frequencies of the sweep up."""
    flat = np.asarray(values).reshape(len(down), -1).T
    parts = [np.interp(up, down, row.real) + 1j * np.interp(up, down, row.imag) for row in flat]
    return np.stack(parts, axis=1).reshape(values.shape)


B = (np.asarray(B_up) + to_up(B_down)) / 2
deviation = np.sqrt((np.asarray(var_up) + to_up(var_down).real) / 4)
hertz = up / (2 * np.pi)
fig, axes = plt.subplots(2, 1, figsize=(7, 6), layout="constrained", sharex=True)
axes[0].semilogy(hertz, np.abs(truth(up)[:, 3, 0]), "k", lw=3, alpha=0.3, label="true, free")
axes[0].semilogy(hertz, np.abs(suspended(Z_up)[:, 3, 0]), label="suspended")
axes[0].semilogy(hertz, np.abs(B[:, 3, 0]), label="suspension taken out")
axes[0].set_ylabel("receptance end to end [m/N]")
axes[0].legend(frameon=False)
error = np.abs(B - truth(up))[:, 3, 0]
axes[1].semilogy(hertz, error, ".", ms=3, label="error")
axes[1].semilogy(hertz, np.abs(np.asarray(B_up) - truth(up))[:, 3, 0], ".", ms=2, label="error of one sweep")
axes[1].semilogy(hertz, deviation[:, 3, 0], "k", label="predicted standard deviation")
axes[1].set_xlabel("frequency [Hz]")
axes[1].set_ylabel("[m/N]")
axes[1].legend(frameon=False)
inside = np.mean(np.abs(B - truth(up)) < 3 * deviation)
print(f"{100 * inside:.1f} % of all values lie within three predicted standard deviations of the truth")

# %% [markdown]
# The error bar is that of the noise. One sweep also errs by its speed, `-i w' B''/2`; the sweep down errs the other
# way, so that the mean of the two is free of it to first order. What remains shows at the first mode, and the end of
# the start's transient at the lowest frequencies: a slower sweep is the remedy, no error bar shows it.
#
# ## Levels
# A linear structure answers alike at every level: the difference of three levels beside what the noise makes of it.

# %%
levels = jnp.stack([free(amplitudes(LOW, HIGH, level, seed)[1]) for seed, level in ((3, 2.5), (4, 5.0), (5, 10.0))])
spread = np.asarray(experiment.nonlinearity(levels))
expected = np.sqrt(np.sum(4 * np.asarray(var_up), axis=(1, 2)) / np.sum(np.abs(np.asarray(B_up)) ** 2, axis=(1, 2)))
print(
    f"median difference of levels {np.median(spread):.2%}, of the noise at the lowest level {np.median(expected):.2%}"
)

# %% [markdown]
# ## A fixture that was measured on its own
# The structure carries a fixture of two masses at its last two places: it is decoupled, the fixture being coupled
# once more with the opposite sign, at the interface alone (standard) or with points inside the fixture as well
# (extended) and as many singular values as the interface has coordinates. Both results have their own error bars.

# %%
fixture_K = 1500.0 * np.array(
    [[1.0, -0.4, -0.6, 0], [-0.4, 1.4, 0, -1.0], [-0.6, 0, 1.6, -1.0], [0, -1.0, -1.0, 2.0]]
)
fixture_M, fixture_C = np.diag([0.2, 0.2, 0.8, 0.5]), 1e-3 * fixture_K
omega = np.linspace(2 * np.pi * 2, 2 * np.pi * 15, 40 if FAST else 200)
w = omega[:, None, None]
Z = np.zeros((len(omega), 6, 6), complex)
Z[:, :4, :4] += K + 1j * w * C - w**2 * M
Z[:, 2:, 2:] += fixture_K + 1j * w * fixture_C - w**2 * fixture_M
names = ["m1", "m2", "m3", "m4", "f1", "f2"]
assembled = linear.TransferFunctions(omega, np.linalg.inv(Z), names, names)
fixture_Z = fixture_K + 1j * w * fixture_C - w**2 * fixture_M
fixture = linear.TransferFunctions(omega, np.linalg.inv(fixture_Z), names[2:], names[2:])
alone = np.linalg.inv(K + 1j * w * C - w**2 * M)


def noise_of(transfer):
    return experiment.noise_variance(transfer.values, relative=2e-3, floor=1e-7)


both = jnp.concatenate([assembled.values.reshape(len(omega), -1), fixture.values.reshape(len(omega), -1)], axis=1)
of_both = jnp.concatenate([noise_of(assembled).reshape(len(omega), -1), noise_of(fixture).reshape(len(omega), -1)], 1)
measured = experiment.add_noise(jax.random.key(0), both, of_both)[:, None, :]


PLACE = "m4"


def without_fixture(values, channels, rank):
    seen = assembled.with_values(values[:, 0, :36].reshape(-1, 6, 6))
    known = fixture.with_values(values[:, 0, 36:].reshape(-1, 4, 4))
    return experiment.decouple(seen, known, channels, rank=rank).at([PLACE], [PLACE]).values


place = names.index(PLACE)
fig, axes = plt.subplots(2, 1, figsize=(7, 6), layout="constrained", sharex=True)
hertz = omega / (2 * np.pi)
axes[0].semilogy(hertz, np.abs(alone[:, place, place]), "k", lw=3, alpha=0.3, label="true, alone")
axes[0].semilogy(hertz, np.abs(assembled.values[:, place, place]), "k:", lw=1, label="with the fixture")
for color, (label, channels, rank) in zip(
    ("C0", "C1"), (("standard", ["m3", "m4"], None), ("extended", names[2:], 2)), strict=True
):
    found, spread = jax.jit(
        lambda v, channels=channels, rank=rank: experiment.propagate(
            lambda x: without_fixture(x, channels, rank), v, of_both[:, None, :]
        )
    )(measured)
    error, bar = np.abs(np.asarray(found)[:, 0, 0] - alone[:, place, place]), np.sqrt(np.asarray(spread)[:, 0, 0])
    axes[0].semilogy(hertz, np.abs(found[:, 0, 0]), color, lw=1, label=f"decoupled, {label}")
    axes[1].semilogy(hertz, error, color + ".", ms=3, label=f"error, {label}")
    axes[1].semilogy(hertz, bar, color, lw=1, label="predicted")
    share, median = np.mean(error < 3 * bar), np.median(error / np.abs(alone[:, place, place]))
    print(f"{label:9s} median error {median:.2%}, {share:.0%} within three predicted standard deviations")
axes[0].set_ylabel(f"receptance at {PLACE} [m/N]")
axes[0].legend(frameon=False)
axes[1].set_xlabel("frequency [Hz]")
axes[1].set_ylabel("[m/N]")
axes[1].legend(frameon=False, ncols=2)

# %% [markdown]
# The interface alone fails where the difference of the two measurements is near singular; its error bar says so.
#
# ## A rig of known stiffness
# When the rig's dynamic stiffness is known, no force need be measured: $(B^{-1} - Z)^{-1}$ at the places that it
# holds. The real and imaginary stiffness that remain are the structure's own.

# %%
held = linear.TransferFunctions(
    omega, np.linalg.inv(K + 1j * w * C - w**2 * M + 500.0 * at_ends), names[:4], names[:4]
)
found = experiment.remove_stiffness(held, ["m1", "m4"], 500.0 * np.eye(2))
H, J = experiment.measured_stiffness(found)
print("rest of the rig:", float(np.max(np.abs(np.asarray(found.values) - alone)) / np.max(np.abs(alone))))
print("stiffness and damping of the first spring:", -np.asarray(H)[0, 0, 1], -np.asarray(J)[0, 0, 1] / omega[0])
