"""Modal motions against closed forms and SciPy: exact at the samples whatever the step."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import scipy.signal

from jaxmbs.vibration._modal_equations import base_load, modal_motion
from jaxmbs.vibration._modal_response import modal_response
from jaxmbs.vibration._modes import natural_modes
from tests.structural_matrices import chain, kw

W, Z = jnp.array([0.0, 2.0, 30.0, 4.0]), jnp.array([0.0, 0.02, 0.1, 1.5])
LOADS = jnp.asarray(np.random.default_rng(0).normal(size=(9, 4)))
Q0, V0 = jnp.array([1.0, -0.5, 0.1, 0.2]), jnp.array([0.3, 1.0, 0.0, -1.0])


def test_rough_loads_at_a_coarse_step():
    """Rigid, light, stiff and overdamped modes, step 0.5 s, random loads and start."""
    found = jax.jit(modal_motion)(W, Z, LOADS, 0.5, Q0, V0)
    times = 0.5 * np.arange(9)
    w, z, loads = (np.asarray(a) for a in (W, Z, LOADS))

    def rate(t, y, k):
        f = np.interp(t, times, loads[:, k])
        return [y[1], f - 2 * z[k] * w[k] * y[1] - w[k] ** 2 * y[0]]

    for k in range(4):
        y, options = np.array([Q0[k], V0[k]]), {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
        for i in range(8):
            y = scipy.integrate.solve_ivp(rate, times[i : i + 2], y, args=(k,), **options).y[:, -1]
            np.testing.assert_allclose(
                [found.displacement[i + 1, k], found.velocity[i + 1, k]], y, rtol=1e-8, atol=1e-9
            )
            np.testing.assert_allclose(
                found.acceleration[i + 1, k], rate(times[i + 1], y, k)[1], rtol=1e-7, atol=1e-7
            )


@pytest.mark.long
def test_gradient_and_single_precision():
    def energy(s):
        return jnp.sum(modal_motion(s * W, Z, LOADS, 0.5, Q0, V0).displacement ** 2)

    f = jax.jit(jax.value_and_grad(energy))
    np.testing.assert_allclose(f(1.0)[1], (f(1 + 1e-6)[0] - f(1 - 1e-6)[0]) / 2e-6, rtol=1e-6)
    low = [jnp.asarray(a, jnp.float32) for a in (W, Z, LOADS)]
    found = modal_motion(*low, 0.5)
    assert found.displacement.dtype == jnp.float32
    np.testing.assert_allclose(found.displacement, modal_motion(W, Z, LOADS, 0.5).displacement, rtol=1e-3, atol=1e-4)


@pytest.mark.long
def test_base_that_jumps():
    """A mass whose base takes a constant acceleration swings from rest to twice its static sag."""
    K, M = chain(1, 4.0, 1.0, 1)
    modes = natural_modes(K=K, M=M)
    load = base_load(M, jnp.ones((1, 1)), 3.0 * jnp.ones((41, 1)))
    motion = modal_motion(modes.omega, 0.0, load @ modes.shapes, np.pi / 40)
    x = motion.displacement @ modes.shapes.T
    np.testing.assert_allclose(x[:, 0], -0.75 * (1 - np.cos(2 * np.pi / 40 * np.arange(41))), atol=1e-12)


def lattice(t):
    """A free square lattice, exact pairs and a rigid mode; t parts the pairs, scales, grounds a corner, adds mass."""
    T, I = chain(3, ends=0)
    K = t[1] * (jnp.kron(T, I) + (1 + t[0]) * jnp.kron(I, T))
    return K.at[0, 0].add(t[2]), jnp.eye(9).at[1, 1].add(t[3])


T0, FORCE = jnp.array([0.0, 1.3, 0.0, 0.0]), np.random.default_rng(1).normal(size=(9, 30))


@partial(jax.jit, static_argnums=1)
@jax.value_and_grad
def of_lattice(t, own):
    """A number of the motion of six modes, the others static; damped in proportion, or by ratios."""
    K, M = lattice(t)
    damping = {"C": 0.01 * t[1] * K} if own else {"ratios": jnp.full(9, 0.02).at[0].set(0.0)}
    found = modal_response(K=K, M=M, load=jnp.asarray(FORCE.T), step=0.3, num=6, **damping)
    return jnp.sum((found.displacement + found.velocity)[:, 0] * jnp.arange(30.0))


@pytest.mark.long
@pytest.mark.parametrize("own", [False, True], ids=["ratios", "matrix"])
def test_derivatives_where_frequencies_repeat(own):
    """Pairs that a parameter parts, a rigid mode that a spring holds: against differences of the value."""
    value, slope = of_lattice(T0, own)
    for i, e in enumerate(1e-5 * np.eye(4)):
        ahead, twice, behind = (of_lattice(T0 + k * e, own)[0] for k in (1, 2, -1))
        expected = (4 * ahead - 3 * value - twice) / 2e-5 if i == 2 else (ahead - behind) / 2e-5
        np.testing.assert_allclose(slope[i], expected, rtol=1e-6)


@pytest.mark.long
def test_motion_of_a_structure():
    """All modes and a few with the others static, against SciPy's exact response of the state space."""
    K, M = (np.asarray(A) for A in lattice(T0))
    w2, X = scipy.linalg.eigh(K, M)
    C = M @ X @ np.diag(0.04 * np.sqrt(np.maximum(w2, 0.0))) @ X.T @ M
    A = np.block([[np.zeros((9, 9)), np.eye(9)], [-K, -C]])
    B = np.concatenate([np.zeros((9, 9)), np.eye(9)])
    _, _, y = scipy.signal.lsim((A, B, np.eye(18), np.zeros((18, 9))), FORCE.T, 0.3 * np.arange(30))
    found = modal_response(**kw(lattice(T0)), load=jnp.asarray(FORCE.T), step=0.3, ratios=0.02)
    np.testing.assert_allclose(found.displacement, y[:, :9], atol=1e-9)
    np.testing.assert_allclose(found.velocity, y[:, 9:], atol=1e-9)
    np.testing.assert_allclose(found.acceleration.T, A[9:] @ y.T + FORCE, atol=1e-9)
    with pytest.raises(ValueError, match=r"shape \(9, 30\), not \(times, 9\)"):
        modal_response(**kw(lattice(T0)), load=jnp.asarray(FORCE), step=0.3)
    with pytest.raises(ValueError, match="not finite: a mass that is not positive definite"):
        modal_response(
            K=lattice(T0)[0], M=jnp.eye(9).at[0, 1].set(2.0).at[1, 0].set(2.0), load=jnp.asarray(FORCE.T), step=0.3
        )
