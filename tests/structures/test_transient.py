"""Modal motions against closed forms and SciPy: exact at the samples whatever the step."""

import jax
import jax.numpy as jnp
import numpy as np
import scipy.integrate

from jaxmbs.structures.modes import natural_modes
from jaxmbs.structures.transient import base_load, modal_motion
from tests.structural_matrices import chain

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


def test_gradient_and_single_precision():
    def energy(s):
        return jnp.sum(modal_motion(s * W, Z, LOADS, 0.5, Q0, V0).displacement ** 2)

    f = jax.jit(jax.value_and_grad(energy))
    np.testing.assert_allclose(f(1.0)[1], (f(1 + 1e-6)[0] - f(1 - 1e-6)[0]) / 2e-6, rtol=1e-6)
    low = [jnp.asarray(a, jnp.float32) for a in (W, Z, LOADS)]
    found = modal_motion(*low, 0.5)
    assert found.displacement.dtype == jnp.float32
    np.testing.assert_allclose(found.displacement, modal_motion(W, Z, LOADS, 0.5).displacement, rtol=1e-3, atol=1e-4)


def test_base_that_jumps():
    """A mass whose base takes a constant acceleration swings from rest to twice its static sag."""
    K, M = chain(1, 4.0, 1.0, 1)
    modes = natural_modes(K, M)
    load = base_load(M, jnp.ones((1, 1)), 3.0 * jnp.ones((1, 41)))
    motion = modal_motion(modes.angular_frequencies, 0.0, (modes.shapes.T @ load).T, np.pi / 40)
    x = motion.displacement @ modes.shapes.T
    np.testing.assert_allclose(x[:, 0], -0.75 * (1 - np.cos(2 * np.pi / 40 * np.arange(41))), atol=1e-12)
