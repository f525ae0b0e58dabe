"""Pairs of modes against transients, impulses against shocks, sums against each other."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.structures.modes import natural_modes
from jaxmbs.substructures import craig_bampton, join, physical
from jaxmbs.substructures.limits import (
    combine,
    cqc_correlation,
    equivalent_impulse,
    limit_loads,
    modal_pairs,
    peak_response,
)
from tests.structural_matrices import chain


def payload(n=3, k=5.0):
    """A chain on one interface coordinate, which just holds it."""
    K, M = chain(n + 1, k, 0.2, 0)
    return craig_bampton(K, M, (0,), n)


def carrier():
    K, M = chain(4, 40.0, 2.0, 1)
    modes = natural_modes(K, M)
    return K, M, modes


def test_one_pair_is_the_joined_system():
    """One mass on a spring, carrying one mass on a spring: frequencies and the answer to an impulse, exactly."""
    K, M = jnp.array([[40.0]]), jnp.array([[2.0]])
    load = craig_bampton(*chain(2, 5.0, 0.2, 0), (0,), 1)
    joined = join((physical(K, M, (0,)), load), ((0,), (0,)))
    modes = natural_modes(K, M)
    pairs = modal_pairs(modes.angular_frequencies, modes.shapes[:1], load)
    w, _ = pairs.modes()
    np.testing.assert_allclose(w[0, 0], joined.modes().angular_frequencies, rtol=1e-9)
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(joined.mass, joined.stiffness), np.zeros((2, 2))]])
    impulse, t = 0.7, 0.37
    start = np.linalg.solve(joined.mass, [impulse, 0.0])
    q = scipy.linalg.expm(A * t) @ np.r_[0, 0, start]
    found = pairs.response(jnp.array([impulse]) * modes.shapes[0], t)
    np.testing.assert_allclose(found[0, 0], q[1], rtol=1e-9)


def test_peaks_bound_the_responses_of_all_pairs():
    _, _, modes = carrier()
    pairs = modal_pairs(modes.angular_frequencies, modes.shapes[3:], payload())
    J = jnp.array([1.0, -0.5, 0.3, 0.2])
    responses = np.asarray(jax.jit(jax.vmap(lambda t: pairs.response(J, t)))(jnp.linspace(0.0, 200.0, 4001)))
    again = jax.jit(lambda J: modal_pairs(modes.angular_frequencies, modes.shapes[3:], payload()).peaks(J))
    highest, peaks = np.abs(responses).max(axis=0), np.asarray(again(J))
    assert np.all(highest <= peaks * (1 + 1e-12))
    assert np.all(highest > 0.9 * peaks)


def test_limit_values_against_the_transient():
    """An impulse at the carrier's foot: the absolute sum lies above the payload's true peak, not by more than 3."""
    K, M, modes = carrier()
    load = payload()
    pairs = modal_pairs(modes.angular_frequencies, modes.shapes[3:], load)
    joined = join((physical(K, M, (3,)), load), ((0,), (0,)))
    system = joined.modes()
    push = joined.load((jnp.zeros(4).at[0].set(1.0), None))
    t = jnp.linspace(0.0, 120.0, 6001)
    w = system.angular_frequencies
    amplitudes = (system.shapes.T @ push) / w
    q = (system.shapes * amplitudes[None, :]) @ jnp.sin(w[:, None] * t[None, :])
    own = joined.part(q)[1][1:]
    truth = np.abs(own).max(axis=1)
    peaks = pairs.peaks(modes.shapes[0])
    above, srss = (np.asarray(limit_loads(jnp.eye(3), peaks, how)) for how in ("abs", "srss"))
    assert np.all(above > truth) and np.all(above < 3 * truth)
    assert np.all(srss < above)


def test_interface_that_holds_too_much_is_refused():
    K, M = chain(4, 5.0, 0.2, 0)
    with pytest.raises(ValueError, match="statically determinate"):
        modal_pairs(jnp.ones(1), jnp.ones((2, 1)), craig_bampton(K, M, (0, 3), 2))


def test_peak_response_to_a_half_sine():
    """Against the closed form after the pulse; the impulse of equal peak."""
    w, T = 3.0, 0.4
    times = jnp.linspace(0.0, 4.0, 1601)
    force = jnp.where(times < T, jnp.sin(np.pi * times / T), 0.0)
    p = np.pi / T
    closed = abs(2 * p * np.cos(w * T / 2) / (w * (p**2 - w**2)))
    peak = jax.jit(peak_response)(w, force, times[1])
    np.testing.assert_allclose(peak, closed, rtol=1e-4)
    np.testing.assert_allclose(
        equivalent_impulse(w, peak), 2 * T / np.pi * np.cos(w * T / 2) / (1 - (w / p) ** 2), rtol=1e-4
    )
    np.testing.assert_allclose(peak_response(0.0, jnp.ones(3), times[1]), times[2] ** 2 / 2, rtol=1e-9)
    spectrum = jax.vmap(lambda w: peak_response(w, force, times[1], 0.02))(jnp.array([1.0, 3.0]))
    assert np.all(np.isfinite(spectrum)) and spectrum[1] < peak


def test_sums():
    values, w = jnp.array([3.0, -4.0]), jnp.array([1.0, 1.0])
    np.testing.assert_allclose(combine(values, "abs"), 7.0)
    np.testing.assert_allclose(combine(values), 5.0)
    np.testing.assert_allclose(combine(values, weights=jnp.array([2.0, 0.5])), np.sqrt(40.0))
    together = cqc_correlation(w, jnp.full(2, 0.05))
    np.testing.assert_allclose(together, np.ones((2, 2)), rtol=1e-12)
    np.testing.assert_allclose(combine(values, "cqc", correlation=together), 1.0, rtol=1e-12)
    apart = cqc_correlation(jnp.array([1.0, 3.0]), jnp.array([0.02, 0.05]))
    np.testing.assert_allclose(apart, apart.T, rtol=1e-12)
    assert apart[0, 1] < 0.01
    with pytest.raises(ValueError, match="one of"):
        combine(values, "mean")
