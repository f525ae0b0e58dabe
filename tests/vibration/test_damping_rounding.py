"""Signs of complex roots: rounding is no instability, no damping and no soft mode; small true ones are none of it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.vibration._damping import complex_modes


def conservative(kind, seed, n=6):
    """K, C, M of a system whose roots are all imaginary: of one unit, of many, free once, with gyroscopic terms."""
    draw = np.random.default_rng(seed)
    B, G = draw.standard_normal((n - (kind == "free"), n)), draw.standard_normal((n, n))
    unit = np.diag(10 ** draw.uniform(-3, 3, n)) if kind == "units" else np.eye(n)
    M = np.eye(n) + 0.1 * G @ G.T
    C = G - G.T if kind == "gyroscopic" else np.zeros((n, n))
    return [jnp.asarray(unit @ A @ unit) for A in (B.T @ B, C, M)]


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param("plain", marks=pytest.mark.long),
        pytest.param("units", marks=pytest.mark.long),
        "free",
        "gyroscopic",
    ],
)
def test_undamped_systems_neither_grow_nor_decay(kind):
    for seed in range(8):
        K, C, M = conservative(kind, seed)
        modes = complex_modes(K=K, C=C, M=M)
        assert np.any(modes.roots.real != 0)  # rounding is there
        assert not np.any(modes.is_unstable) and np.all(modes.damping_ratios == 0)
        assert modes.num_rigid == (2 if kind == "free" else 0)
        assert np.all(np.asarray(modes.frequencies)[: modes.num_rigid] == 0)


@pytest.mark.parametrize("kind", ["plain", "units", "free", "gyroscopic"])
@pytest.mark.parametrize("ratio", [-1e-9, 1e-9])
def test_a_little_damping_is_seen(kind, ratio):
    """A ratio of 1e-9 of either sign in all elastic modes, by mass: the shift of every root is `-damping / 2`."""
    K, C, M = conservative(kind, 1)
    damping = 2 * ratio * float(complex_modes(K=K, C=C, M=M).omega[-1])
    modes = complex_modes(K=K, C=C + damping * M, M=M)
    elastic = slice(2 if kind == "free" else 0, None)
    assert np.all(np.asarray(modes.is_unstable)[elastic] == (ratio < 0))
    assert np.all(np.sign(modes.damping_ratios)[elastic] == np.sign(ratio))
    if kind != "gyroscopic":
        np.testing.assert_allclose(modes.roots.real[elastic], -damping / 2, rtol=1e-3)


@pytest.mark.long
def test_damping_that_is_rounding_keeps_its_derivative():
    """At no damping the ratio is zero, its slope `1 / (2 w)`."""
    K, M = jnp.diag(jnp.array([1.0, 9.0])), jnp.eye(2)
    slope = jax.jacfwd(lambda c: complex_modes(K=K, C=c * M, M=M).damping_ratios)(0.0)
    np.testing.assert_allclose(slope, [1 / 2, 1 / 2, 1 / 6, 1 / 6], rtol=1e-12)


@pytest.mark.parametrize("scale", [pytest.param(1e-12, marks=pytest.mark.long), 1.0, 1e12])
def test_pairs_stay_side_by_side(scale):
    """Oscillators of one frequency, and of frequencies far below and above one: each root before its conjugate."""
    K = scale**2 * jnp.diag(jnp.array([4.0, 4.0, 4.0 * (1 + 1e-13), 9.0]))
    modes = complex_modes(K=K, C=0.1 * scale * jnp.eye(4), M=jnp.eye(4))
    assert np.all(np.asarray(modes.roots)[::2].imag > 0)
    np.testing.assert_array_equal(modes.roots[1::2], np.conj(modes.roots[::2]))
    np.testing.assert_allclose(modes.omega[::2], scale * np.array([2, 2, 2, 3.0]), rtol=1e-9)


@pytest.mark.long
def test_a_hanging_pendulum_is_stable_and_a_standing_one_is_not():
    """Three links without damping: their roots have real parts of 1e-16; stood on its end each link falls."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    for k, parent in enumerate(("ground", "one", "two")):
        name = ("one", "two", "three")[k]
        b.body(name, mass=1.0, com=(0.5, 0, 0), inertia=1 / 12)
        b.joint(f"pin {name}", mbs.Revolute("z"), parent, name, parent_frame=(1.0 if k else 0.0, 0, 0))
    system = b.build()
    for angle, falling in ((-np.pi / 2, 0), (np.pi / 2, 3)):
        modes = mbs.modes(system, mbs.State.at(system, {"pin one": angle}))
        assert int(np.sum(modes.is_unstable)) == falling and modes.num_rigid == 0
        assert ("unstable" in repr(modes)) == (falling > 0)
    b.body("free", mass=2.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "free")
    system = b.build()
    modes = mbs.modes(system, mbs.State.at(system, {"pin one": -np.pi / 2}))
    assert modes.num_rigid == 2 and not np.any(modes.is_unstable)
