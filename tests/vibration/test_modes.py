"""Natural and complex modes: chains, beams, a string in closed form; a double cross with its seven-fold values."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.vibration._damping import (
    complex_modes,
    damped_frequency,
    modal_damping,
    rayleigh_damping,
    rayleigh_from_ratios,
    structural_damping,
)
from jaxmbs.vibration._mode_shapes import effective_masses, mac, mode_ratios, participation, track_modes
from jaxmbs.vibration._modes import Modes, complete_group, natural_modes
from tests.structural_matrices import beam, chain, double_cross, kw

CANTILEVER = [1.87510407, 4.69409113, 7.85475744, 10.99554073]
FREE = [4.73004074, 7.85320462, 10.99560784, 14.13716549]
CROSS = 0.125**4 / 12 * 200e9, 0.125**2 * 200e9, 0.125**2 * 8000.0


@pytest.mark.parametrize("ends", [1, 2])
def test_chain(ends):
    """S2: frequencies and shapes to 1e-9."""
    n, k, m = 24, 3.0, 2.0
    modes = natural_modes(**kw(chain(n, k, m, ends)))
    j = np.arange(1, n + 1)
    angle = j * np.pi / (2 * (n + 1)) if ends == 2 else (2 * j - 1) * np.pi / (2 * (2 * n + 1))
    np.testing.assert_allclose(modes.omega, 2 * np.sqrt(k / m) * np.sin(angle), rtol=1e-9)
    shapes = np.sin(np.outer(j, 2 * angle))
    np.testing.assert_allclose(mode_ratios(modes), shapes / shapes[:1], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("fixed", "expected"), [(2, CANTILEVER), pytest.param(0, FREE, marks=pytest.mark.slow)])
def test_beam(fixed, expected):
    """S1: beta L of the first four modes to 1e-7; two rigid modes apart."""
    modes = natural_modes(**kw(beam(110, fixed=fixed)))
    assert modes.num_rigid == 2 - fixed
    elastic = modes.select(slice(modes.num_rigid, modes.num_rigid + 4))
    np.testing.assert_allclose(jnp.sqrt(elastic.omega), expected, rtol=1e-7)


def test_effective_masses_sum_to_the_mass():
    K, M = beam(12, rhoA=3.0, fixed=2)
    rigid = jnp.stack(
        [jnp.tile(jnp.array([1.0, 0.0]), 12), jnp.ravel(jnp.stack([jnp.arange(1, 13) / 12, jnp.ones(12)], 1))], 1
    )
    modes = natural_modes(K=K, M=M)
    np.testing.assert_allclose(
        jnp.sum(effective_masses(modes, M, rigid), axis=0), jnp.diagonal(rigid.T @ M @ rigid), rtol=1e-9
    )
    shares = effective_masses(modes, M, rigid)[:2, 0] / 3.0
    np.testing.assert_allclose(shares, [0.6131, 0.1883], atol=1e-3)  # the uniform cantilever's textbook shares
    np.testing.assert_allclose(jnp.abs(participation(modes, M, rigid)[:2, 0]), np.sqrt(3 * shares), rtol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize(("centre_held", "split"), [(True, [7]), (False, [2, 5])])
def test_double_cross(centre_held, split):
    """S10: frequencies within 1 %; seven-fold where the centre cannot move, two and five where the arms stretch.

    The derivatives of each group's sum by bending and axial stiffness and mass equal differences and scaling laws.
    """

    def cross(scales):
        return natural_modes(**kw(double_cross(4, *(scales * jnp.asarray(CROSS)), centre_held=centre_held)))

    modes = cross(jnp.ones(3))
    sizes = [1, *split] * 2
    np.testing.assert_allclose(modes.frequencies[:16], [11.336, *[17.709] * 7, 45.345, *[57.390] * 7], rtol=0.01)
    np.testing.assert_array_equal(modes.groups[:16], np.repeat(np.arange(len(sizes)), sizes))
    assert complete_group(modes.values, 4) == 8

    @jax.jit
    def sums(scales):
        return jnp.stack([jnp.sum(v) for v in jnp.split(cross(scales).values[:16], np.cumsum(sizes)[:-1])])

    J = jax.jit(jax.jacrev(sums))(jnp.ones(3))
    for i, e in enumerate(1e-4 * np.eye(3)):
        np.testing.assert_allclose(J[:, i], (sums(1 + e) - sums(1 - e)) / 2e-4, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(J[:, 0] + J[:, 1], sums(jnp.ones(3)), rtol=1e-8)
    np.testing.assert_allclose(J[:, 2], -sums(jnp.ones(3)), rtol=1e-8)


@pytest.mark.long
def test_tracking_follows_modes_that_cross():
    """Two beams in two planes, one stiffening: the modes cross, their names stay."""

    def planes(ratio):
        (K1, M1), (K2, M2) = beam(4, fixed=2), beam(4, EI=ratio, fixed=2)
        K = jnp.block([[K1, jnp.zeros((8, 8))], [jnp.zeros((8, 8)), K2]])
        return K, jnp.block([[M1, jnp.zeros((8, 8))], [jnp.zeros((8, 8)), M2]])

    before, after = natural_modes(**kw(planes(0.9))), natural_modes(**kw(planes(1.1)))
    followed = track_modes(before, after, planes(1.0)[1])
    np.testing.assert_allclose(followed.values / before.values, np.tile([11 / 9, 1.0], 8), rtol=1e-6)
    assert np.all(np.abs(after.values / before.values - 1.1 / 0.9) > 0.05)
    np.testing.assert_allclose(followed.shapes, before.shapes, atol=1e-6)
    np.testing.assert_allclose(mac(before.shapes, followed.shapes, planes(1.0)[1]), np.eye(16), atol=1e-9)


@pytest.mark.long
def test_tracking_turns_modes_of_equal_frequency():
    """Where the two planes are alike the vectors are any of their space: they are turned to the reference's."""
    (K, M), I = beam(3, fixed=2), jnp.eye(2)
    reference = natural_modes(K=jnp.kron(jnp.diag(jnp.array([1.0, 1.1])), K), M=jnp.kron(I, M))
    turn = jnp.array([[0.6, 0.8], [-0.8, 0.6]])
    found = natural_modes(K=jnp.kron(I, K), M=jnp.kron(I, M))
    pairs = found.shapes.reshape(12, 6, 2) @ turn
    mixed = Modes(found.values, pairs.reshape(12, 12), found.is_rigid)
    np.testing.assert_allclose(track_modes(reference, mixed, jnp.kron(I, M)).shapes, reference.shapes, atol=1e-7)
    with pytest.raises(ValueError, match="the reference has 12 modes"):
        track_modes(reference, found.select(slice(0, 4)))


@pytest.mark.long
def test_string_with_viscous_and_structural_damping():
    """S5: the published complex roots; g = 0.1, b = 6.28318, on the 40 lowest natural modes."""
    K, M = chain(499, 1e7, 10.0)
    shapes = natural_modes(K=K, M=M, num=40).shapes
    K, M, C = shapes.T @ K @ shapes, jnp.eye(40), 6.28318 * (shapes.T @ shapes)
    roots = np.asarray(complex_modes(K=structural_damping(K, 0.1), C=C, M=M).roots)
    roots = roots[roots.imag > 0]
    expected = [-0.6283 + 6.2832j, -0.9419 + 12.578j, -1.2556 + 18.870j, -1.5693 + 25.162j]
    np.testing.assert_allclose(roots[np.argsort(roots.imag)][:4], expected, rtol=1e-3)
    w = 2000 * np.sin(np.arange(1, 5) * np.pi / 1000)
    exact = -0.314159 + 1j * np.sqrt(w**2 * (1 + 0.1j) - 0.314159**2)
    np.testing.assert_allclose(roots[np.argsort(roots.imag)][:4], exact, rtol=1e-9)


def viscous(t):
    K, M = chain(5)
    return K, M * 1.5, t[0] * jnp.eye(5).at[0, 0].set(3.0) + t[1] * K


@pytest.mark.long
def test_general_viscous_damping():
    """Roots against SciPy's pencil, receptance and free motion against direct formulas, derivatives of the roots."""
    design = jnp.array([0.1, 0.05])
    K, M, C = viscous(design)
    modes = complex_modes(K=K, C=C, M=M)
    zero, eye = np.zeros((5, 5)), np.eye(5)
    pencil = scipy.linalg.eigvals(np.block([[zero, eye], [-K, -C]]), np.block([[eye, zero], [zero, M]]))
    by_height = [z[np.argsort(z.imag)] for z in (np.asarray(modes.roots), pencil)]
    np.testing.assert_allclose(*by_height, rtol=1e-9, atol=1e-12)
    s = 0.7j
    K, M, C = (np.asarray(a) for a in (K, M, C))
    shapes, left, roots = (np.asarray(a) for a in (modes.shapes, modes.left, modes.roots))
    np.testing.assert_allclose(
        (shapes / (s - roots)) @ left, np.linalg.inv(K + s * C + s * s * M), rtol=1e-9, atol=1e-12
    )
    x, v = jnp.arange(5.0), jnp.ones(5)
    amplitudes = modes.amplitudes(M=M, C=C, displacement=x, velocity=v)
    np.testing.assert_allclose(
        modes.acceleration(amplitudes, 0.0), -np.linalg.solve(M, C @ v + K @ x), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose((modes.shapes @ amplitudes).real, x, atol=1e-10)
    A = np.block([[zero, eye], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    for t in (0.7, 3.1):
        moved = scipy.linalg.expm(A * t) @ np.r_[x, v]
        np.testing.assert_allclose(modes.acceleration(amplitudes, t), (A @ moved)[5:], rtol=1e-8, atol=1e-11)
    slope = jax.jit(jax.jacfwd(lambda t: (lambda K, M, C: complex_modes(K=K, C=C, M=M).roots)(*viscous(t))))(design)
    e = jnp.array([1e-6, 0.0])
    plus, minus = ((lambda K, M, C: complex_modes(K=K, C=C, M=M).roots)(*viscous(design + d)) for d in (e, -e))
    np.testing.assert_allclose(slope[:, 0], (plus - minus) / 2e-6, rtol=1e-6, atol=1e-8)


@pytest.mark.long
def test_proportional_and_modal_damping():
    """Ratios that come back from the complex roots; two rigid modes stay undamped, a frequency that repeats too."""
    a, b = rayleigh_from_ratios((1.0, 0.02), (3.0, 0.05))
    asked = complex_modes(
        K=jnp.diag(jnp.array([1.0, 9.0])), M=jnp.eye(2), C=jnp.diag(jnp.array([a + b, a + 9 * b]))
    )  # two masses of these frequencies
    np.testing.assert_allclose(asked.damping_ratios, [0.02, 0.02, 0.05, 0.05], rtol=1e-12)
    K, M = chain(6, 2.0, 1.5)
    modes = natural_modes(K=K, M=M)
    w = np.asarray(modes.omega)
    found = complex_modes(K=K, C=rayleigh_damping(K=K, M=M, by_mass=a, by_stiffness=b), M=M)
    np.testing.assert_allclose(found.damping_ratios[::2], a / (2 * w) + b * w / 2, rtol=1e-8)
    np.testing.assert_allclose(found.roots[::2].imag, damped_frequency(w, a / (2 * w) + b * w / 2), rtol=1e-8)
    ratios = jnp.linspace(0.01, 0.06, 6)
    np.testing.assert_allclose(
        complex_modes(K=K, C=modal_damping(K=K, M=M, ratios=ratios), M=M).damping_ratios[::2], ratios, rtol=1e-8
    )
    K, M = beam(4)
    np.testing.assert_allclose(
        modal_damping(K=K, M=M, ratios=0.02) @ natural_modes(K=K, M=M, num=2).shapes, 0.0, atol=1e-6
    )


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda K, M: natural_modes(K=K, M=M.at[1, 1].set(0.0)), r"\[1\] have no mass"),
        (lambda K, M: natural_modes(K=K, M=M.at[:2, :2].set(1.0)), "not positive definite"),
        (lambda K, M: natural_modes(K=K, M=M[:2, :2]), r"and of one size, not of shapes \[\(3, 3\), \(2, 2\)\]"),
        (lambda K, M: natural_modes(K=K.at[0, 0].set(jnp.nan), M=M), "the stiffness is not finite"),
        (lambda K, M: natural_modes(K=K, M=M, num=4), "there are 3 modes"),
        (lambda K, M: mode_ratios(natural_modes(K=K, M=M), 3), r"3 must be one of 0 \.\.\. 2"),
        (lambda K, M: complex_modes(K=K, C=0 * K, M=M.at[2, 2].set(0.0)), r"\[2\] have no mass"),
        (lambda K, M: complex_modes(K=K, C=K[:2, :2], M=M), "must be of one shape"),
        (lambda K, M: natural_modes(K=K, M=M).acceleration(jnp.ones(3), 0.0), "natural modes have no roots"),
        (lambda K, M: rayleigh_from_ratios((1.0, 0.1), (1.0, 0.2)), "two different frequencies"),
    ],
)
def test_bad_input(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong(*chain(3))


@pytest.mark.slow
def test_single_precision_and_batches():
    scales = jnp.array([1.0, 2.0], jnp.float32)
    K, M = (a.astype(jnp.float32) for a in chain(6))
    frequencies = jax.jit(jax.vmap(lambda s: natural_modes(K=s * K, M=M, num=3).frequencies))(scales)
    assert frequencies.dtype == jnp.float32
    np.testing.assert_allclose(frequencies[1], 2**0.5 * frequencies[0], rtol=1e-5)
