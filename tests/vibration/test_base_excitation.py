"""The table of acceleration gains of a structure on a moving base, against its transmissibility and by NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.vibration import (
    acceleration_gain,
    gain_from_mobility,
    generalised_stiffness,
    mobility_from_gain,
    modal_damping,
    resonance_gains,
    transmissibility,
)
from tests.structural_matrices import beam

#: A beam of four elements on a base that moves it up and turns it; six modes of damping each its own.
K, M = (np.asarray(A) for A in beam(4, rhoA=3.0))
BASE, OUT, RATIOS = (0, 1), (4, 8, 9), np.linspace(0.01, 0.06, 8)
INNER = np.arange(2, 10)


@jax.jit
def table(K, M):
    return resonance_gains(K=K, M=M, base=BASE, out=OUT, ratios=jnp.asarray(RATIOS))


def relative():
    """Motion T with the base, modes with the base held and their participation, by SciPy."""
    T = np.zeros((10, 2))
    T[0::2, 0], T[0::2, 1], T[1::2, 1] = 1.0, np.arange(5) / 4, 1.0
    values, Phi = scipy.linalg.eigh(K[np.ix_(INNER, INNER)], M[np.ix_(INNER, INNER)])
    return T, np.sqrt(values), Phi, Phi.T @ (M @ T)[INNER]


def test_each_gain_is_the_share_of_its_mode_at_its_resonance():
    """`q''_ik / x''_C` (45): one oscillator for each mode under the inertia of its participation."""
    found = table(K, M)
    T, w, Phi, L = relative()
    np.testing.assert_allclose(found.omega, w, rtol=1e-9)
    reference = np.array([0.3 - 0.1j, 2.0])  # acceleration of the base, of either coordinate alone
    for k in range(8):
        q = -L[k] * reference / (w[k] ** 2 - w[k] ** 2 + 2j * RATIOS[k] * w[k] ** 2)
        measured = -(w[k] ** 2) * np.outer(Phi[np.array(OUT) - 2, k], q)
        np.testing.assert_allclose(found.gains[k], acceleration_gain(measured, reference), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found.mass, np.diag(T.T @ M @ T), rtol=1e-9)  # 3 kg, and 1 kg m^2 about the base
    np.testing.assert_allclose(found.mass, [3.0, 1.0], rtol=1e-9)


@pytest.mark.long
def test_the_sum_over_the_table_is_the_transmissibility():
    """(43)-(45): at any frequency, for damping inside of the structure, by the function, and by NumPy's inverse."""
    omega = np.array([0.3, 1.9, 2.1, 40.0])
    T, w, *_ = relative()
    P = np.hstack([-T[2:], np.eye(8)])
    inner_C = np.asarray(
        modal_damping(K=K[np.ix_(INNER, INNER)], M=M[np.ix_(INNER, INNER)], ratios=jnp.asarray(RATIOS))
    )
    C = P.T @ inner_C @ P
    found = table(K, M).transmissibility(omega)
    for at, v in zip(found, omega, strict=True):
        Z = K + 1j * v * C - v**2 * M
        exact = -np.linalg.solve(Z[np.ix_(INNER, INNER)], Z[np.ix_(INNER, BASE)])
        np.testing.assert_allclose(at, exact[np.array(OUT) - 2], rtol=1e-7, atol=1e-9)
    direct = transmissibility(K=jnp.asarray(K), M=jnp.asarray(M), C=jnp.asarray(C), omega=omega, base=BASE, out=OUT)
    np.testing.assert_allclose(found, direct, rtol=1e-6, atol=1e-9)


def test_mobilities_of_the_table():
    """(44): velocity of the mode over the inertia force `M x''_C` of the whole; (45) leads back to the gains."""
    found = table(K, M)
    w, mass = np.asarray(found.omega)[:, None, None], np.array([3.0, 1.0])
    velocity, force = np.asarray(found.gains) / w, mass  # per unit acceleration of the base, sizes
    np.testing.assert_allclose(found.mobilities, velocity / force, rtol=1e-9)
    np.testing.assert_allclose(generalised_stiffness(mass, w), mass * w**2, rtol=1e-12)
    np.testing.assert_allclose(mobility_from_gain(found.gains, mass, w), velocity / force, rtol=1e-9)
    np.testing.assert_allclose(gain_from_mobility(found.mobilities, mass, w), found.gains, rtol=1e-9)
    np.testing.assert_allclose(mobility_from_gain(25.0, 2.0, 3.0), 25 / 6, rtol=1e-12)  # numbers too


@pytest.mark.long
def test_light_damping_makes_one_mode_the_whole():
    """At a resonance of 0.1 % the transmissibility is the gain of that mode but for the others' part of a percent."""
    found = resonance_gains(K=jnp.asarray(K), M=jnp.asarray(M), base=BASE, out=OUT, ratios=1e-3, num=2)
    whole = found.transmissibility(found.omega)
    np.testing.assert_allclose(whole[0], found.gains[0], rtol=0.01)
    assert np.all(np.abs(whole[0]) > 100) and found.gains.shape == (2, 3, 2)


@pytest.mark.long
def test_gradient_of_a_gain():
    """Of the tip's gain in the first mode by stiffness and by mass, against differences."""

    def gain(t):
        stiff, heavy = jnp.asarray(K).at[:4, :4].multiply(t[0]), jnp.asarray(M).at[8, 8].add(t[1])
        found = resonance_gains(K=stiff, M=heavy, base=BASE, out=[8], ratios=0.02, num=1)
        return jnp.abs(found.mobilities[0, 0, 0])

    t, f = jnp.array([1.0, 0.3]), jax.jit(jax.value_and_grad(gain))
    for i, e in enumerate(1e-5 * np.eye(2)):
        np.testing.assert_allclose(f(t)[1][i], (f(t + e)[0] - f(t - e)[0]) / 2e-5, rtol=1e-5)


def test_bad_input():
    with pytest.raises(ValueError, match="undamped mode has no finite gain"):
        resonance_gains(K=jnp.asarray(K), M=jnp.asarray(M), base=BASE, out=OUT, ratios=0.0)
    with pytest.raises(ValueError, match="outside the base"):
        resonance_gains(K=jnp.asarray(K), M=jnp.asarray(M), base=BASE, out=(0,), ratios=0.02)
