"""Sampled forms of blocks against `scipy.signal.cont2discrete`, and against steps of their own rates."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete, dlsim, tf2ss

from jaxmbs.blocks import PI, PID, Delay, FirstOrder, RateLimit, StateSpace, TransferFunction

PERIOD = 0.05
INPUTS = np.cos(np.arange(40) ** 1.3)


def outputs(block, s, inputs=INPUTS, period=PERIOD):
    """Outputs of a block at samples of its inputs."""

    def step(s, u):
        y, s = block.sample(u, s, jnp.zeros(()), jnp.asarray(period))
        return s, y

    return jax.lax.scan(step, s, jnp.asarray(inputs))[1]


def of_scipy(A, B, C, D, x0):
    """The same of a linear system with its input held."""
    A, B, C, D = map(np.array, (A, B, C, D))
    F, G, C, D, h = cont2discrete((A, B, C, D), PERIOD)
    return dlsim((F, G, C, D, h), INPUTS[:, None], x0=x0)[1][:, 0]


def test_linear_blocks_are_those_of_scipy():
    A, B, C, D = np.array([[-1.0, 2.0], [-30.0, -4.0]]), np.array([[0.5], [1.0]]), np.array([[1.0, -2.0]]), [[0.3]]
    found = outputs(StateSpace(A, B, C, D), {"x": jnp.array([0.2, -0.1])})
    np.testing.assert_allclose(found, of_scipy(A, B, C, D, [0.2, -0.1]), rtol=1e-11, atol=1e-12)
    num, den = [0.2, 1.0, 3.0], [0.1, 0.5, 2.0]
    found = outputs(TransferFunction(num, den), {"x": jnp.zeros(2)})
    np.testing.assert_allclose(found, of_scipy(*tf2ss(num, den), [0.0, 0.0]), rtol=1e-11, atol=1e-12)
    found = outputs(FirstOrder(0.08, 3.0), {"value": jnp.asarray(0.4)})
    np.testing.assert_allclose(found, of_scipy([[-1 / 0.08]], [[3 / 0.08]], [[1.0]], [[0.0]], [0.4]), rtol=1e-11)


@pytest.mark.parametrize(
    "duration, count",
    [(0.05, 1), (0.2, 4), (4 * 0.05, 4), (0.1 + 0.2, 6), (0.21, 5), (0.0499, 1), (5.0, 100)],
)
def test_a_delay_gives_back_what_was_held_a_time_ago(duration, count):
    """Exact samples, a part of a period counted as a whole one; before the start the input of the start."""
    delay = Delay(duration, 3).sampled(PERIOD)
    found = outputs(delay, delay.start(jnp.asarray(INPUTS[0]), 0.0))
    held = [INPUTS[max(0, math.floor((n * PERIOD - duration) / PERIOD + 1e-9))] for n in range(len(INPUTS))]
    np.testing.assert_array_equal(found, held)
    np.testing.assert_array_equal(found, np.r_[np.full(count, INPUTS[0]), INPUTS][: len(INPUTS)])


@pytest.mark.parametrize("gap", [0.02, 0.1, 0.14, 0.2, 0.5, 5.0, -0.03, -0.1, -0.4, 0.0])
@pytest.mark.parametrize("period", [0.01, 0.2, 1.0])
def test_a_limited_rate_is_the_solution_under_a_held_input(gap, period):
    block = RateLimit(0.7, 0.4, time_constant=0.2)
    rate = lambda t, y: np.clip((gap - y) / 0.2, -0.4, 0.7)
    wanted = solve_ivp(rate, (0.0, period), [0.0], rtol=1e-10, atol=1e-12, max_step=period / 50).y[0, -1]
    found = block.sample(jnp.asarray(gap), {"value": jnp.zeros(())}, 0.0, jnp.asarray(period))[1]["value"]
    np.testing.assert_allclose(found, wanted, rtol=1e-7, atol=1e-10)


def test_integrals_of_controllers_are_those_of_held_errors():
    e = -INPUTS
    for block in (PI(2.0, 3.0), PID(2.0, 3.0)):
        found = outputs(block, {name: jnp.zeros(()) for name in block.internal_states})
        np.testing.assert_allclose(found, 2.0 * e + 3.0 * PERIOD * (np.cumsum(e) - e), rtol=1e-12, atol=1e-12)


def test_short_periods_approach_the_rate_of_the_block():
    """Controllers and a limited rate: half the period halves the distance to the continuous block."""
    half, u = jnp.asarray(0.3), jnp.asarray(0.5)
    blocks = [
        (PI(2.0, 3.0, limit=1.1), {"integral": -half}),
        (PID(2.0, 3.0, kd=0.2, filter=0.1), {"integral": half, "filtered": half}),
        (RateLimit(0.7, 0.4, time_constant=0.2), {"value": half}),
        (RateLimit(0.7, 2.4, time_constant=0.2), {"value": half + 0.4}),
    ]
    for block, s in blocks:
        rate = block.rate(u, s, 0.0)
        off = []
        for period in (1e-3, 5e-4):
            y, new = block.sample(u, s, 0.0, jnp.asarray(period))
            slope = {name: (new[name] - s[name]) / period for name in s}
            off.append([*(float(slope[name] - rate[name]) for name in s), float(y - block.output(u, s, 0.0))])
        first, second = np.abs(off)
        assert np.all(second <= 0.52 * first + 1e-9) and np.all(first < 0.1)


def test_a_limited_controller_does_not_wind_up_and_its_derivative_is_bounded():
    block = PI(2.0, 40.0, target=1.0, limit=1.0)
    held = np.r_[np.zeros(50), 1.2 * np.ones(5)]
    found = outputs(block, {"integral": jnp.asarray(0.0)}, held)
    assert np.all(found[:50] == 1.0) and np.all(found[50:] < 0.9)
    quick = outputs(PID(0.0, 0.0, kd=1.0, filter=1e-6), {k: jnp.asarray(0.0) for k in ("integral", "filtered")})
    np.testing.assert_allclose(quick[1:], -np.diff(INPUTS) / PERIOD, atol=2e-3)  # of -u, by differences
