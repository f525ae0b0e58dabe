"""Linear blocks against SciPy: their matrices by derivatives of rate and output, at frequencies."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from scipy import interpolate, signal

import jaxmbs as mbs
from jaxmbs import blocks

OMEGA = np.array([0.3, 2.0, 11.0])


def response(block, omega=OMEGA):
    """Transfer function of a block at frequencies, from the derivatives of its methods."""
    s = {name: jnp.zeros(one.shape) for name, one in block.internal_states.items()}
    x, unravel = ravel_pytree(s)
    rate = lambda x, u: ravel_pytree(block.rate(u, unravel(x), 0.0))[0]
    output = lambda x, u: block.output(u, unravel(x), 0.0)
    (A, B), (C, D) = mbs.jit(lambda x, u: [jax.jacfwd(f, (0, 1))(x, u) for f in (rate, output)])(x, jnp.zeros(()))
    A, B, C, D = map(np.asarray, (A, B, C, D))
    eye = np.eye(x.size)
    return np.array([C @ np.linalg.solve(1j * w * eye - A, B) + D for w in omega])


@pytest.mark.parametrize("numerator", [[3.0, 1.0, -2.0], [1.5, 0.5], [2.0]])
def test_a_rational_function_is_that_of_scipy(numerator):
    denominator = [2.0, 1.0, 5.0]
    block = blocks.TransferFunction(numerator, denominator)
    np.testing.assert_allclose(response(block), signal.freqs(numerator, denominator, OMEGA)[1], rtol=1e-12)
    assert block.is_feedthrough == (len(numerator) == 3) and not block.faults()


def test_a_lag_and_a_state_space_are_those_of_scipy():
    np.testing.assert_allclose(response(blocks.FirstOrder(0.3, 2.0)), 2.0 / (1.0 + 0.3j * OMEGA), rtol=1e-12)
    space = signal.tf2ss([3.0, 1.0, -2.0], [2.0, 1.0, 5.0])
    block = blocks.StateSpace(*space)
    np.testing.assert_allclose(response(block), signal.freqs([3.0, 1.0, -2.0], [2.0, 1.0, 5.0], OMEGA)[1], rtol=1e-12)
    assert [part.shape for part in block] == [(2, 2), (2, 1), (1, 2), (1, 1)]


@pytest.mark.parametrize("order", [1, 2, 3, 6])
def test_a_delay_is_the_rational_function_of_pade(order):
    series = np.cumprod(np.r_[1.0, -1.0 / np.arange(1, 2 * order + 1)])  # exp(-s)
    p, q = interpolate.pade(series, order)
    np.testing.assert_allclose(response(blocks.Delay(0.2, order)), p(0.2j * OMEGA) / q(0.2j * OMEGA), rtol=1e-8)
    assert np.allclose(np.abs(response(blocks.Delay(0.2, order))), 1.0)


def test_a_delay_starts_at_rest_for_its_input():
    block = blocks.Delay(0.2, 4)
    s = block.start(jnp.asarray(3.0), 0.0)
    np.testing.assert_allclose(block.rate(jnp.asarray(3.0), s, 0.0)["x"], 0.0, atol=1e-8)
    np.testing.assert_allclose(block.output(jnp.asarray(3.0), s, 0.0), 3.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("block", "fault"),
    [
        (blocks.TransferFunction([1.0, 0.0, 0.0], [1.0, 2.0]), "degree must not be above"),
        (blocks.TransferFunction([1.0], [0.0, 2.0]), "first number must not be zero"),
        (blocks.TransferFunction(1.0, [0.0, 2.0]), "lists of numbers"),
        (blocks.FirstOrder(0.0), "time_constant must be positive"),
        (blocks.Delay(-1.0), "duration must be positive"),
        (blocks.Delay(1.0, 0), "whole number from 1 to 10"),
        (blocks.StateSpace(np.eye(2), np.eye(2), np.eye(3), np.eye(2)), "are needed"),
        (blocks.FirstOrder(np.nan), "is not a number"),
    ],
)
def test_faults(block, fault):
    assert any(fault in text for text in block.faults())
