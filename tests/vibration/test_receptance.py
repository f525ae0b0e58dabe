"""Modal transfer functions against inverses, closed forms and published magnitudes; derivatives of repeated modes."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from jax import lax

from jaxmbs.vibration import (
    accelerance,
    mobility,
    modal_receptance,
    receptance,
    superpose,
    transmissibility,
    viscous_receptance,
)
from jaxmbs.vibration._damping import modal_damping, rayleigh_damping
from jaxmbs.vibration._modes import natural_modes
from tests.structural_matrices import beam, chain

SIDE = 3
OMEGA = jnp.array([0.3, 1.1, 1.9])
OUT, INTO = (0, 4), (1, 3, 8)


def plate(t):
    """A square lattice with exact pairs; t[0] splits them, t[1] stiffens, t[2] is the mass of one corner."""
    T = jnp.asarray(2 * np.eye(SIDE) - np.eye(SIDE, k=1) - np.eye(SIDE, k=-1))
    I = jnp.eye(SIDE)
    return t[1] * (jnp.kron(T, I) + (1 + t[0]) * jnp.kron(I, T)), jnp.eye(9).at[0, 0].add(t[2])


@jax.jit
def direct(K, M, omega, C=None, loss=0.0):
    C = jnp.zeros_like(K) if C is None else C
    Z = jnp.stack([lax.complex(K - w**2 * M, loss * K + w * C) for w in omega])
    return jnp.linalg.inv(Z)[:, np.array(OUT)][:, :, np.array(INTO)]


def size(H):
    return jnp.sum(jnp.abs(H) ** 2 * jnp.arange(1.0, 4.0)[None, None])


def parameters(t):
    K, M = plate(t)
    return K, M, rayleigh_damping(K=K, M=M, by_mass=t[3], by_stiffness=0.01), t[4]


T0 = jnp.array([0.0, 1.3, 0.0, 0.05, 0.02])


def modal_size(t):
    K, M, C, loss = parameters(t)
    return size(receptance(K=K, M=M, omega=OMEGA, out=OUT, into=INTO, C=C, loss=loss))


def direct_size(t):
    K, M, C, loss = parameters(t)
    return size(direct(K, M, OMEGA, C, loss))


@pytest.mark.long
def test_value_and_gradient_where_modes_repeat():
    """By splitting, stiffness, mass, damping and loss: those of the inverse."""
    found, expected = (jax.jit(jax.value_and_grad(f))(T0) for f in (modal_size, direct_size))
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-10)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-9, atol=1e-9)


@pytest.mark.long
def test_second_derivatives_where_modes_repeat():
    found, expected = (jax.jit(jax.hessian(f))(T0) for f in (modal_size, direct_size))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


def some_modes(t, residual=True):
    K, M, C, loss = parameters(t)
    return size(receptance(K=K, M=M, omega=OMEGA[:1], out=OUT, into=INTO, C=C, loss=loss, num=3, residual=residual))


@pytest.mark.long
def test_some_modes_with_residual_terms():
    """Three of nine modes (a single one and a pair): what residual terms bring; derivatives through the cut."""
    exact = float(size(direct(*plate(T0), OMEGA[:1], parameters(T0)[2], 0.02)))
    with_, without = (abs(float(some_modes(T0, r)) / exact - 1) for r in (True, False))
    assert with_ < 0.02 and without > 5 * with_
    K, M, C, loss = (np.asarray(A) for A in parameters(T0))
    values, X = scipy.linalg.eigh(K, M)
    w, lowest = float(OMEGA[0]), slice(0, 3)
    z = values * (1 + 1j * loss) - w**2 + 1j * w * np.diag(X.T @ C @ X)
    alone = X[np.array(OUT)][:, lowest] / z[lowest] @ X[np.array(INTO)][:, lowest].T
    options = {"C": jnp.asarray(C), "loss": loss, "num": 3}
    found = receptance(
        K=jnp.asarray(K), M=jnp.asarray(M), omega=OMEGA[:1], out=OUT, into=INTO, residual=False, **options
    )
    np.testing.assert_allclose(found[0], alone, rtol=1e-8, atol=1e-10)
    rest = X[np.array(OUT)][:, 3:] / values[3:] @ X[np.array(INTO)][:, 3:].T / (1 + 1j * loss)
    kept = receptance(K=jnp.asarray(K), M=jnp.asarray(M), omega=OMEGA[:1], out=OUT, into=INTO, **options)
    np.testing.assert_allclose(kept[0], alone + rest, rtol=1e-8, atol=1e-10)
    f = jax.jit(jax.value_and_grad(some_modes))
    slope = f(T0)[1]
    assert np.all(np.isfinite(slope))
    for i, e in enumerate(1e-4 * np.eye(5)):
        np.testing.assert_allclose(slope[i], (f(T0 + e)[0] - f(T0 - e)[0]) / 2e-4, rtol=1e-4, atol=1e-6)


@pytest.mark.long
def test_asked_pairs_and_loads_in_chunks():
    K, M, C, _ = parameters(T0)
    pairs = receptance(K=K, M=M, omega=OMEGA, out=OUT, into=INTO, C=C, chunk=2)
    columns = receptance(K=K, M=M, omega=OMEGA, out=OUT, into=jnp.eye(9)[:, np.array(INTO)], C=C)
    np.testing.assert_allclose(pairs, direct(K, M, OMEGA, C), rtol=1e-10)
    np.testing.assert_allclose(columns, pairs, rtol=1e-12)


@pytest.mark.long
def test_modal_damping_as_printed():
    """A ratio for every mode: the printed sum over modes equals the matrix C that has these ratios."""
    K, M = beam(4, fixed=2)
    modes = natural_modes(K=K, M=M)
    ratios = jnp.linspace(0.01, 0.05, 8)
    omega = jnp.array([2.0, 21.0, 70.0])
    printed = modal_receptance(
        modes.omega, modes.shapes[np.array(OUT)], modes.shapes[np.array(INTO[:2])], omega, ratios
    )
    np.testing.assert_allclose(
        receptance(K=K, M=M, omega=omega, out=OUT, into=INTO[:2], C=modal_damping(K=K, M=M, ratios=ratios)),
        printed,
        rtol=1e-8,
    )


@pytest.mark.long
def test_modal_masses_and_damping_over_frequency():
    """(40) with m_k other than 1 and eta_k(w): shapes of any size, a ratio for each mode and frequency."""
    K, M = beam(4, fixed=2)
    modes = natural_modes(K=K, M=M)
    size = jnp.linspace(0.5, 3.0, 8)
    shapes, masses = modes.shapes * size[None], size**2
    ratios, omega = jnp.asarray(np.random.default_rng(0).uniform(0.01, 0.2, (3, 8))), jnp.array([2.0, 21.0, 70.0])
    found = modal_receptance(
        modes.omega, shapes[np.array(OUT)], shapes[np.array(INTO[:2])], omega, ratios, modal_masses=masses
    )
    for at, w, z in zip(found, np.asarray(omega), ratios, strict=True):
        Z = np.asarray(K) - w**2 * np.asarray(M) + 1j * w * np.asarray(modal_damping(K=K, M=M, ratios=z))
        np.testing.assert_allclose(at, np.linalg.inv(Z)[np.ix_(OUT, INTO[:2])], rtol=1e-8)


@pytest.mark.long
def test_viscous_damping_of_any_kind():
    """Value and gradient of the inverse; a damping that couples modes is refused by the other function."""

    def matrices(t):
        K, M = plate(t)
        return K, M, t[3] * K + t[4] * jnp.diag(jnp.arange(9.0))

    def found(t):
        K, M, C = matrices(t)
        return size(viscous_receptance(K=K, M=M, omega=OMEGA, out=OUT, into=INTO, C=C))

    def expected(t):
        K, M, C = matrices(t)
        return size(direct(K, M, OMEGA, C))

    values = [jax.jit(jax.value_and_grad(f))(T0) for f in (found, expected)]
    np.testing.assert_allclose(values[0][0], values[1][0], rtol=1e-9)
    np.testing.assert_allclose(values[0][1], values[1][1], rtol=1e-8, atol=1e-9)
    K, M, C = matrices(T0)
    with pytest.raises(ValueError, match="couples the modes"):
        receptance(K=K, M=M, omega=OMEGA, out=OUT, into=INTO, C=C)


def test_rates():
    B = jnp.array([[[1.0 + 2.0j]], [[3.0 + 0.0j]]])
    np.testing.assert_allclose(mobility(B, jnp.array([2.0, 3.0])), [[[-4.0 + 2.0j]], [[9.0j]]])
    np.testing.assert_allclose(accelerance(B, jnp.array([2.0, 3.0])), [[[-4.0 - 8.0j]], [[-27.0]]])


@pytest.mark.long
def test_transmissibility():
    """A mass on a spring and damper in closed form; a chain between two bases against the partitioned inverse."""
    k, c, m, w = 5.0, 0.3, 2.0, np.array([0.5, 1.6, 4.0])
    K, C = (jnp.array([[a, -a], [-a, a]]) for a in (k, c))
    M = jnp.diag(jnp.array([0.1, m]))
    found = transmissibility(K=K, M=M, omega=jnp.asarray(w), base=(0,), out=(1,), C=C)
    np.testing.assert_allclose(found[:, 0, 0], (k + 1j * w * c) / (k + 1j * w * c - m * w**2), rtol=1e-10)
    with pytest.raises(ValueError, match="outside the base"):
        transmissibility(K=K, M=M, omega=jnp.asarray(w), base=(0,), out=(0,))
    with pytest.raises(ValueError, match=r"\[2\] must be among 0 ... 1"):
        receptance(K=K, M=M, omega=jnp.asarray(w), out=(2,), into=(0,))
    K, M = chain(6, ends=0)
    found = transmissibility(
        K=K,
        M=M,
        omega=jnp.asarray(w),
        base=(0, 5),
        out=(2, 3),
        C=rayleigh_damping(K=K, M=M, by_mass=0.1, by_stiffness=0.02),
        loss=0.03,
    )
    inner, base = np.arange(1, 5), np.array([0, 5])
    for i, wi in enumerate(w):
        Z = np.asarray(K) * (1 + 0.03j + 0.02j * wi) + np.asarray(M) * (0.1j * wi - wi**2)
        exact = -np.linalg.solve(Z[np.ix_(inner, inner)], Z[np.ix_(inner, base)])
        np.testing.assert_allclose(found[i], exact[1:3], rtol=1e-9, atol=1e-12)


def test_superposition_of_a_free_motion():
    """(43): every mode on its own, put together, is the motion of the chain by the exponential of its matrix."""
    K, M = chain(4, 3.0, 2.0, 1)
    modes, start, t = natural_modes(K=K, M=M), np.array([1.0, -0.5, 0.3, 0.2]), 0.8
    q = (modes.shapes.T @ M @ start) * jnp.cos(modes.omega * t)
    zero, eye = np.zeros((4, 4)), np.eye(4)
    A = np.block([[zero, eye], [-np.linalg.solve(M, K), zero]])
    moved = scipy.linalg.expm(A * t) @ np.r_[start, np.zeros(4)]
    np.testing.assert_allclose(superpose(modes.shapes, q), moved[:4], rtol=1e-9)
    both = superpose(modes.shapes, jnp.stack([q.astype(complex), 2j * q.astype(complex)], axis=1))
    np.testing.assert_allclose(both[:, 1], 2j * moved[:4], rtol=1e-9)


#: S15: building and module of a space station of the SLICOT benchmark examples (Chahlaoui and Van Dooren 2002).
SLICOT = np.load(Path(__file__).parent / "slicot.npz")


@pytest.mark.long
def test_building_of_slicot():
    """Published magnitudes to 1e-8; its unsymmetric stiffness is noticed."""
    K, C, load, omega, magnitude = (
        jnp.asarray(SLICOT[f"building_{name}"]) for name in ("stiffness", "damping", "load", "omega", "magnitude")
    )
    H = viscous_receptance(K=K, M=jnp.eye(24), omega=omega, out=(0,), into=load, C=C)
    np.testing.assert_allclose(jnp.abs(mobility(H, omega))[:, 0, 0], magnitude, rtol=1e-8)
    for refused in (
        lambda: natural_modes(K=K, M=jnp.eye(24)),
        lambda: receptance(K=K, M=jnp.eye(24), omega=omega, out=(0,), into=(0,)),
    ):
        with pytest.raises(ValueError, match="the stiffness is unsymmetric by 0.01"):
            refused()


@pytest.mark.long
def test_space_station_of_slicot():
    """135 modes of 0.5 % damping, three inputs and three velocities: published magnitudes to 1e-8, both ways."""
    frequencies, into, out, omega, magnitude = (
        jnp.asarray(SLICOT[f"iss_{name}"]) for name in ("frequencies", "into", "out", "omega", "magnitude")
    )
    printed = modal_receptance(frequencies, out, into.T, omega, 0.005)
    K, C = jnp.diag(frequencies**2), jnp.diag(0.01 * frequencies)
    for H in (printed, receptance(K=K, M=jnp.eye(135), omega=omega, out=out, into=into, C=C)):
        found = jnp.abs(mobility(H, omega)).transpose(0, 2, 1).reshape(-1, 9)
        np.testing.assert_allclose(found, magnitude, rtol=1e-8)


@pytest.mark.long
def test_single_precision_and_batches():
    K, M, C, _ = (jnp.asarray(a, jnp.float32) for a in parameters(T0))
    H = jax.jit(jax.vmap(lambda s: receptance(K=s * K, M=M, omega=OMEGA, out=OUT, into=INTO, C=C)))(
        jnp.array([1.0, 1.1], jnp.float32)
    )
    assert H.dtype == jnp.complex64
    K, M, C, _ = parameters(T0)
    np.testing.assert_allclose(H[0], direct(K, M, OMEGA, C), rtol=1e-4)
