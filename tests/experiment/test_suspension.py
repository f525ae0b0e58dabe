"""Several levels of force on a structure whose stiffness grows with them, and suspensions soft and stiff."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from scipy.optimize import brentq

from jaxmbs.errors import ModelError
from jaxmbs.experiment import check_suspension, free_response, nonlinearity, sweep_amplitudes
from jaxmbs.linear import LinearSystem

MASSES, SPRING, DAMPER = np.array([2.0, 1.0]), 900.0, 4.0
SOFT, LEAK = 8.0, 12.0  # suspension of the first mass
OMEGA, LEVELS = np.array([18.0, 24.0, 50.0]), np.array([2.0, 20.0, 40.0])
STEPS, PERIODS, LAST = 64, 80, 5


def simulated(cubic):
    """Both masses (frequencies, levels, samples) in vibration, and the force of the suspension: Runge and Kutta."""

    def rate(state, force):
        x, v = state[:2], state[2:]
        stretch = x[1] - x[0]
        pull = SPRING * stretch + cubic * stretch**3 + DAMPER * (v[1] - v[0])
        support = -SOFT * x[0] - LEAK * v[0]
        return jnp.concatenate([v, jnp.stack([force + support + pull, -pull]) / MASSES])

    def run(omega, level):
        h = 2 * jnp.pi / omega / STEPS

        def step(y, k):
            f = [level * jnp.cos(2 * jnp.pi * (k + c) / STEPS) for c in (0.0, 0.5, 1.0)]
            a = rate(y, f[0])
            b = rate(y + h / 2 * a, f[1])
            c = rate(y + h / 2 * b, f[1])
            d = rate(y + h * c, f[2])
            new = y + h / 6 * (a + 2 * b + 2 * c + d)
            return new, y

        return lax.scan(step, jnp.zeros(4), jnp.arange(1.0 * STEPS * PERIODS))[1][-2 * LAST * STEPS - 1 :]

    return jax.vmap(jax.vmap(run, (None, 0)), (0, None))(jnp.asarray(OMEGA), jnp.asarray(LEVELS))


@cache
def measured(cubic):
    """Receptances (levels, frequencies, 2, 1) of the structure freed of its suspension, level by level."""

    @jax.jit
    def campaign(cubic):
        y = simulated(cubic)
        support = -SOFT * y[..., 0] - LEAK * y[..., 2]
        signals = jnp.stack([y[..., 0], y[..., 1], support], axis=2)
        phase = 2 * jnp.pi * jnp.arange(1.0 * signals.shape[-1]) / STEPS
        start = -2 * LAST * STEPS - 1 + STEPS * PERIODS
        phase = phase + 2 * jnp.pi * (start % STEPS) / STEPS
        middle = [LAST * STEPS]
        Z = jax.vmap(jax.vmap(lambda s: sweep_amplitudes(s, phase, middle, LAST * STEPS)[0]))(signals)
        drive = jnp.broadcast_to(jnp.asarray(LEVELS, complex)[None], Z.shape[:2])
        by_level = [free_response(Z[:, i, :2, None], drive[:, i, None, None], Z[:, i, 2:, None]) for i in range(3)]
        return jnp.stack([found.receptance for found in by_level])

    return np.asarray(campaign(cubic))


def harmonic_balance(cubic):
    """The same by the spring `k + 3/4 k3 a^2` of the amplitude a that it then has: NumPy."""
    found = np.zeros((3, 3, 2, 1), complex)
    for j, w in enumerate(OMEGA):

        def stiff(a, w=w):
            k = (SPRING + 0.75 * cubic * a**2 + 1j * w * DAMPER) * np.array([[1, -1], [-1, 1]])
            return k - w**2 * np.diag(MASSES)

        for i, level in enumerate(LEVELS):

            def gap(a, w=w, level=level):
                Z = stiff(a) + np.diag([SOFT + 1j * w * LEAK, 0.0])
                x = np.linalg.solve(Z, [level, 0.0])
                return abs(x[1] - x[0]) - a

            a = brentq(gap, 0.0, 10.0)
            found[i, j, :, 0] = np.linalg.inv(stiff(a))[:, 0]
    return found


@pytest.mark.long
def test_levels_of_a_structure_that_stiffens():
    """Fig. 5, for each level: what is measured is the balance of harmonics, and differs as that does."""
    cubic = 3e5
    found, expected = measured(cubic), harmonic_balance(cubic)
    np.testing.assert_allclose(found, expected, atol=0.01 * np.abs(expected).max())
    spread = np.abs(expected - expected.mean(axis=0)[None])
    size = np.sqrt((spread**2).sum(axis=(2, 3))) / np.sqrt((np.abs(expected.mean(axis=0)) ** 2).sum(axis=(1, 2)))
    told = nonlinearity(found)
    np.testing.assert_allclose(told, size.max(axis=0), rtol=0.05)
    assert np.all(size.max(axis=0) > 1.2 * np.sqrt((size**2).mean(axis=0)))  # the largest, and no mean of the levels
    assert np.max(told) > 0.05


@pytest.mark.long
def test_levels_of_a_linear_structure():
    found = measured(0.0)
    np.testing.assert_allclose(found, harmonic_balance(0.0), rtol=1e-4)
    assert np.all(nonlinearity(found) < 1e-6)


# ----------------------------------------------------------------------------------------------------- suspensions
def two_masses(m=3.0, k=500.0):
    return LinearSystem(mass=m * np.eye(2), stiffness=k * np.array([[1.0, -1], [-1, 1]]), coordinates=["a", "b"])


def test_suspension_of_two_masses_in_closed_form():
    """Springs s below both: `sqrt(s / m)` together, `sqrt((2 k + s) / m)` against each other."""
    m, k, s = 3.0, 500.0, 4.0
    found = check_suspension(two_masses(m, k), {"a": s, "b": [s]}, num_rigid=1)
    np.testing.assert_allclose(found.frequencies, [np.sqrt(s / m) / (2 * np.pi)], rtol=1e-9)
    np.testing.assert_allclose(found.elastic, np.sqrt(2 * k / m) / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(found.suspended, np.sqrt((2 * k + s) / m) / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(found.ratio, np.sqrt(s / (2 * k)), rtol=1e-9)
    np.testing.assert_allclose(found.shift, np.sqrt(1 + s / (2 * k)) - 1, rtol=1e-8)
    assert found.ok and "soft enough" in str(found)


def test_a_stiff_suspension_is_told():
    stiff = check_suspension(two_masses(), {"a": 90.0, "b": 90.0}, num_rigid=1)
    assert not stiff.ok and "too stiff: more than 0.1" in str(stiff)
    assert check_suspension(two_masses(), {"a": 90.0, "b": 90.0}, num_rigid=1, limit=0.4).ok
    with pytest.raises(ModelError, match=r"is 0\.3 of the first elastic frequency"):
        check_suspension(two_masses(), {"a": 90.0, "b": 90.0}, num_rigid=1, throw=True)
    with pytest.raises(ValueError, match="negative stiffness: a"):
        check_suspension(two_masses(), {"a": -1.0}, num_rigid=1)
    with pytest.raises(ValueError, match="so that there is an elastic mode"):
        check_suspension(two_masses(), {"a": 90.0})


@pytest.mark.long
def test_ratio_has_a_gradient_and_batches():
    """By the stiffness of the supports, ten of them at once: `d ratio / d s = ratio / (2 s)`."""

    def ratio(s):
        return check_suspension(two_masses(), {"a": s, "b": s}, num_rigid=1, throw=True).ratio

    s = jnp.linspace(1.0, 20.0, 10)
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(ratio)))(s)
    np.testing.assert_allclose(slope, value / (2 * s), rtol=1e-7)
