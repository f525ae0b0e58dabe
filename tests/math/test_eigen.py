"""Eigenproblems of a square lattice, whose values repeat exactly, against SciPy, differences and direct solves."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
from jax import lax

from jaxmbs.math._eigen import eig, eigh, same, spectral

SIDE = 3
T = 2 * np.eye(SIDE) - np.eye(SIDE, k=1) - np.eye(SIDE, k=-1)
WEIGHTS = np.outer(np.arange(1.0, 10.0), np.ones(9)) + np.diag(np.arange(9.0))


def lattice(t):
    """t[0] splits the pairs, t[1] and t[2] keep them, t[3] loads one corner: pairs leave it as groups."""
    I = jnp.eye(SIDE, dtype=t.dtype)
    T_ = jnp.asarray(T, t.dtype)
    corner = jnp.zeros((9, 9), t.dtype).at[0, 0].set(1.0)
    return jnp.kron(T_, I) + (1 + t[0]) * jnp.kron(I, T_) + t[1] * jnp.eye(9, dtype=t.dtype), (
        t[2] * jnp.eye(9, dtype=t.dtype) + t[3] * corner
    )


REPEATED = np.array([0.0, 0.1, 1.3, 0.0])


def test_values_and_vectors_are_those_of_scipy():
    rng = np.random.default_rng(0)
    A, B = rng.normal(size=(2, 7, 7))
    K, M = A @ A.T, B @ B.T + np.eye(7)
    values, X = map(np.asarray, jax.jit(eigh)(jnp.asarray(K), jnp.asarray(M)))
    np.testing.assert_allclose(values, scipy.linalg.eigh(K, M, eigvals_only=True), rtol=1e-9)
    np.testing.assert_allclose(X.T @ M @ X, np.eye(7), atol=1e-9)
    np.testing.assert_allclose(K @ X, M @ X * values, atol=1e-8)


def differences(f, t, directions=range(4), e=1e-5):
    return [(f(t + e * np.eye(4)[i]) - f(t - e * np.eye(4)[i])) / (2 * e) for i in directions]


def pair(t):
    return jnp.sum(eigh(*lattice(t))[0][1:3])


def projector(t):
    X = eigh(*lattice(t))[1][:, 1:3]
    return jnp.sum((X @ X.T) * WEIGHTS)


@pytest.mark.slow
@pytest.mark.parametrize(("invariant", "directions"), [(pair, range(4)), (projector, range(4))])
def test_invariants_of_groups_have_right_derivatives(invariant, directions):
    """Sums and projectors of a group that stays or parts."""
    t = jnp.asarray(REPEATED)
    assert int(jnp.sum(same(eigh(*lattice(t))[0]))) > 9
    slope = np.asarray(jax.jit(jax.grad(invariant))(t))[list(directions)]
    expected = differences(jax.jit(invariant), t, directions)
    np.testing.assert_allclose(slope, expected, rtol=1e-5, atol=1e-7)


@pytest.mark.long
def test_single_values_have_second_derivatives():
    t, e = jnp.asarray([0.21, 0.1, 1.3, 0.2]), 1e-5 * np.array([1.0, -0.5, 0.7, 0.3])
    slopes = jax.jit(jax.grad(lambda t: jnp.sum(eigh(*lattice(t))[0][:3] ** 2)))
    hessian = jax.jit(jax.hessian(lambda t: jnp.sum(eigh(*lattice(t))[0][:3] ** 2)))(t)
    np.testing.assert_allclose(hessian @ e, (slopes(t + e) - slopes(t - e)) / 2, rtol=1e-6, atol=1e-9)


def test_a_single_vector_of_a_group_is_refused():
    """In reverse mode, also in a batch with one such member; a vector of a single value is not."""
    slope = jax.jit(jax.vmap(jax.grad(lambda t, k: eigh(*lattice(t))[1][3, k] ** 2), (0, None)))
    apart, pair = jnp.asarray([0.21, 0.1, 1.3, 0.2]), jnp.asarray(REPEATED)
    assert np.all(np.isfinite(slope(jnp.stack([apart, apart]), 1)))
    assert np.all(np.isfinite(slope(jnp.stack([apart, pair]), 0)))
    with pytest.raises((RuntimeError, ValueError), match="a group of equal eigenvalues has no derivative"):
        jax.block_until_ready(slope(jnp.stack([apart, pair]), 1))


def receptance(values, s, loss):
    return 1.0 / lax.complex(values - s, loss * values)


@pytest.mark.parametrize("loss", [0.0, 0.1])
def test_spectral_function_equals_the_direct_inverse(loss):
    """In value and derivative, by the matrices and by the function's parameters."""

    def modal(t, s, loss):
        return jnp.sum(spectral(receptance, *lattice(t), s, loss).real * WEIGHTS)

    def direct(t, s, loss):
        K, M = lattice(t)
        return jnp.sum(jnp.linalg.inv(lax.complex(K - s * M, loss * K)).real * WEIGHTS)

    arguments = jnp.asarray(REPEATED), jnp.asarray(0.77), jnp.asarray(loss)
    found, expected = (jax.jit(jax.value_and_grad(f, (0, 1, 2)))(*arguments) for f in (modal, direct))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10), found, expected)


def weighted_root(values, weight):
    return weight * jnp.sqrt(values)


@pytest.mark.long
def test_spectral_function_with_a_number_for_each_mode():
    """The square root, its weight equal in every group, against SciPy's matrix root."""

    def root(t):
        return jnp.sum(spectral(weighted_root, *lattice(t), 0.3 * jnp.ones(9)) * WEIGHTS)

    def exact(t):
        K, M = (np.asarray(a) for a in lattice(t))
        S = np.linalg.inv(M)
        return 0.3 * np.sum(scipy.linalg.sqrtm(S @ K) @ S * WEIGHTS)

    t = jnp.asarray(REPEATED)
    np.testing.assert_allclose(root(t), exact(t), rtol=1e-12)
    np.testing.assert_allclose(jax.jit(jax.grad(root))(t), differences(exact, t), rtol=1e-6, atol=1e-7)


@pytest.mark.long
def test_general_eigenproblem():
    """Roots, and what does not depend on the vectors' scale, of a damped lattice with its pairs."""

    def state(t):
        K, M = lattice(t)
        S = jnp.linalg.inv(M)
        return jnp.block([[jnp.zeros((9, 9)), jnp.eye(9)], [-S @ K, -0.1 * S @ K - 0.02 * jnp.eye(9)]])

    def response(t, kept):
        values, X, Y = eig(state(t))
        return jnp.real(jnp.sum(values[:2]) + jnp.sum(values[:6] ** 2)) + jnp.real((X * kept[None]) @ Y)[0, 12]

    t, whole = jnp.asarray(REPEATED), jnp.asarray([1.0 + 0j] * 2 + [0j] * 16)
    values, X, Y = map(np.asarray, eig(state(t)))
    np.testing.assert_allclose(X * values @ Y, state(t), atol=1e-11)
    gradient, value = jax.jit(jax.grad(response)), jax.jit(response)
    slope = np.asarray(gradient(t, whole))[1:3]
    np.testing.assert_allclose(slope, differences(lambda t: value(t, whole), t, (1, 2)), rtol=1e-6, atol=1e-8)
    with pytest.raises((RuntimeError, ValueError), match="a group of equal eigenvalues has no derivative"):
        jax.block_until_ready(gradient(t, whole.at[2].set(1.0)))  # one of a pair, without its conjugate


def test_residues_of_single_roots():
    """Real and imaginary parts of x_k y_k, which no scale changes, by a real matrix with pairs and a real root."""
    A, B = np.random.default_rng(4).normal(size=(2, 5, 5))

    def residues(t):
        _, X, Y = eig(jnp.asarray(A) + t * jnp.asarray(B))
        products = jnp.einsum("ik,kj->kij", X, Y)
        return jnp.stack([jnp.real(products), jnp.imag(products)])

    value, h = jax.jit(residues), 1e-6
    found = jax.jit(jax.jacfwd(residues))(0.0)
    np.testing.assert_allclose(found, (value(h) - value(-h)) / (2 * h), atol=1e-7)
    assert np.all(np.max(np.abs(found), axis=(1, 2, 3)) > 0.1)


@pytest.mark.long
def test_single_precision_and_batches():
    t = jnp.asarray(np.stack([REPEATED, REPEATED + 0.1]), jnp.float32)
    slopes = jax.jit(jax.vmap(jax.grad(lambda t: jnp.sum(eigh(*lattice(t))[0][:3]))))(t)
    assert slopes.dtype == jnp.float32
    exact = jax.vmap(jax.grad(lambda t: jnp.sum(eigh(*lattice(t))[0][:3])))(t.astype(float))
    np.testing.assert_allclose(slopes, exact, rtol=2e-3, atol=1e-3)
