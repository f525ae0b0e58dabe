"""Controllers: their transfer functions, limits and back-calculation."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import blocks
from tests.blocks.test_linear import OMEGA, response


def test_a_pi_and_a_pid_have_their_transfer_functions():
    s = 1j * OMEGA
    np.testing.assert_allclose(-response(blocks.PI(2.0, 3.0)), 2.0 + 3.0 / s, rtol=1e-12)
    pid = blocks.PID(2.0, 3.0, kd=0.5, filter=0.1)
    np.testing.assert_allclose(-response(pid), 2.0 + 3.0 / s + 0.5 * s / (1.0 + 0.1 * s), rtol=1e-12)


def test_a_pid_starts_without_a_kick():
    pid = blocks.PID(2.0, 3.0, target=4.0, kd=0.5, filter=0.1)
    s = {"integral": jnp.zeros(()), **pid.start(jnp.asarray(1.0), 0.0)}
    np.testing.assert_allclose(pid.output(jnp.asarray(1.0), s, 0.0), 6.0)


@pytest.mark.parametrize("limit", [1.5, (-0.5, 1.5)])
def test_the_integral_follows_the_limit_by_back_calculation(limit):
    pi = blocks.PI(2.0, 3.0, target=4.0, limit=limit, tracking=0.25)
    s, u = {"integral": jnp.asarray(0.7)}, jnp.asarray(1.0)
    np.testing.assert_allclose(pi.output(u, s, 0.0), 1.5)
    np.testing.assert_allclose(pi.rate(u, s, 0.0)["integral"], 3.0 * 3.0 + (1.5 - 6.7) / 0.25)
    low = {"integral": jnp.asarray(-9.0)}
    np.testing.assert_allclose(pi.output(u, low, 0.0), np.min(np.broadcast_to(limit, 2)) if np.ndim(limit) else -1.5)


@pytest.mark.parametrize(
    ("block", "fault"),
    [
        (blocks.PI(-1.0, 1.0), "kp must not be negative"),
        (blocks.PI(1.0, -1.0), "ki must not be negative"),
        (blocks.PI(1.0, 1.0, limit=-1.0), "limit must be positive"),
        (blocks.PI(1.0, 1.0, limit=[1.0, 2.0, 3.0]), "one number or (lower, upper)"),
        (blocks.PI(0.0, 1.0, limit=1.0), "give the tracking time"),
        (blocks.PI(1.0, 1.0, limit=1.0, tracking=0.0), "tracking must be positive"),
        (blocks.PID(1.0, 1.0, kd=-1.0), "kd must not be negative"),
        (blocks.PID(1.0, 1.0, kd=1.0, filter=0.0), "must be positive"),
        (blocks.PI(np.inf, 1.0), "is not finite"),
    ],
)
def test_faults(block, fault):
    assert any(fault in text for text in block.faults())
