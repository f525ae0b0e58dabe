"""Friction and inertia of a line; water hammer."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jaxmbs import hydraulics as H

LINE = H.Line(length=2.0, diameter=0.01, density=850.0, viscosity=0.03)


def test_laminar_and_turbulent_friction():
    """Hagen and Poiseuille; Darcy and Weisbach with Blasius' `0.3164 / Re^(1/4)`; a smooth passage between them."""
    q = 1e-6
    np.testing.assert_allclose(LINE.friction(q), 128 * 0.03 * 2.0 * q / (np.pi * 0.01**4), rtol=1e-9)
    w = 60.0
    reynolds = 850.0 * w * 0.01 / 0.03
    blasius = 0.3164 / reynolds**0.25 * 2.0 / 0.01 * 850.0 * w**2 / 2
    np.testing.assert_allclose(LINE.friction(-w * LINE.area), -blasius, rtol=1e-7)
    with_bends = H.Line(2.0, 0.01, 850.0, 0.03, loss=1.5).friction(w * LINE.area)
    np.testing.assert_allclose(with_bends - blasius, 1.5 * 850.0 * w**2 / 2, rtol=1e-5)
    assert jax.grad(LINE.friction)(0.0) > 0.0


def test_friction_brakes_the_flow():
    rate = LINE.rate(jnp.zeros(2), {"q": 1e-5}, 0.0)["q"]
    np.testing.assert_allclose(rate, -LINE.friction(1e-5) * LINE.area / (850.0 * 2.0))


@pytest.mark.long
def test_frequency_of_a_line_and_a_volume():
    """`sqrt(E A / (V rho l))`, from the matrix of rates about rest."""
    volume, thin = H.Volume(1e-3, 1.2e9), H.Line(2.0, 0.01, 850.0, viscosity=1e-9)

    def rates(x):
        q, p = x
        dq = thin.rate(jnp.stack([p, jnp.zeros(())]), {"q": q}, 0.0)["q"]
        return jnp.stack([dq, volume.rate(-q, {"p": p}, 0.0)["p"]])

    omega = np.abs(np.linalg.eigvals(jax.jacfwd(rates)(jnp.array([0.0, 0.0]))).imag)
    np.testing.assert_allclose(omega, np.sqrt(1.2e9 * thin.area / (1e-3 * 850.0 * 2.0)), rtol=1e-6)


@pytest.mark.long
def test_water_hammer_of_a_row_of_lines():
    """Stopped at its end, the flow raises the pressure there by `density c w` (Joukowsky), for `2 l / c`."""
    n, length, modulus, density, w = 60, 30.0, 1.5e9, 850.0, 1.0
    piece = H.Line(length / n, 0.02, density, viscosity=1e-9)
    volume = H.Volume(float(piece.area) * length / n, modulus)

    @jax.jit
    def rates(t, x):
        q, p = x[:n], x[n:]
        before = jnp.concatenate([jnp.zeros(1), p[:-1]])
        dq = jax.vmap(lambda a, b, q: piece.rate(jnp.stack([a, b]), {"q": q}, t)["q"])(before, p, q)
        inflow = q - jnp.append(q[1:], 0.0)
        return jnp.concatenate([dq, volume.rate(inflow, {"p": p}, t)["p"]])

    c = np.sqrt(modulus / density)
    start = np.concatenate([np.full(n, w * float(piece.area)), np.zeros(n)])
    ts = np.linspace(0.0, 3.4 * length / c, 300)
    found = solve_ivp(lambda t, x: np.asarray(rates(t, x)), (0.0, ts[-1]), start, t_eval=ts, rtol=1e-6, atol=1e-9)
    at_end, hammer = found.y[-1], density * c * w
    high = (ts > 0.4 * length / c) & (ts < 1.6 * length / c)
    low = (ts > 2.5 * length / c) & (ts < 3.3 * length / c)
    np.testing.assert_allclose(at_end[high].mean(), hammer, rtol=0.02)
    np.testing.assert_allclose(at_end[low].mean(), -hammer, rtol=0.04)


def test_faults():
    assert len(H.Line(0.0, 0.0, 0.0, 0.0, -1.0).faults()) == 5
    with pytest.raises(TypeError, match="internal state"):
        LINE.flow(1.0)
