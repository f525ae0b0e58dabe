"""Where modes do not solve the equation: critical damping, damping that couples them, free motion."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxmbs.vibration import dense_response, receptance, viscous_receptance
from tests.structural_matrices import beam, chain, kw

OMEGA = jnp.array([0.2, 0.7, 3.1])
ONE = jnp.eye(1)


def critical(c):
    """1 / (k - w^2 m + i w c) of one mass, c = 2 being critical."""
    return viscous_receptance(K=ONE, M=ONE, omega=OMEGA, out=[0], into=[0], C=c * ONE)[:, 0, 0]


def exact(c):
    return 1.0 / lax.complex(1.0 - OMEGA**2, OMEGA * c)


def _derivatives(f):
    """Value, slopes of both parts forward and reverse, second derivative of the size; one program."""

    def answers(c):
        slopes = [
            derivative(lambda c, part=part: part(f(c)))(c)
            for derivative in (jax.jacfwd, jax.jacrev)
            for part in (jnp.real, jnp.imag)
        ]
        return f(c), slopes, jax.grad(jax.grad(lambda c: jnp.sum(jnp.abs(f(c)) ** 2)))(c)

    return jax.jit(answers)


FOUND, EXPECTED = _derivatives(critical), _derivatives(exact)


@pytest.mark.parametrize(
    "distance",
    [
        pytest.param(1e-9, marks=pytest.mark.long),
        *(pytest.param(d, marks=pytest.mark.long) for d in (0.0, 1e-15, 1e-13, 1e-4)),
    ],
)
def test_critical_damping(distance):
    """At a defective root, and beside it: value, slopes forward and reverse, and second derivative."""
    c = 2.0 + distance
    (value, slopes, second), (wanted, wanted_slopes, wanted_second) = FOUND(c), EXPECTED(c)
    np.testing.assert_allclose(value, wanted, rtol=1e-12)
    np.testing.assert_allclose(slopes, wanted_slopes, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(second, wanted_second, rtol=1e-10)
    np.testing.assert_allclose(critical(jnp.asarray(c)), wanted, rtol=1e-12)  # not traced


@pytest.mark.long
def test_critical_damping_in_a_batch():
    """One frequency after the other, and designs of which one only is defective."""
    c = jnp.array([0.5, 2.0, 3.0])
    np.testing.assert_allclose(jax.jit(jax.vmap(critical))(c), jax.vmap(exact)(c), rtol=1e-12)
    slopes = jax.jit(jax.vmap(jax.grad(lambda c: jnp.sum(jnp.abs(critical(c)) ** 2))))(c)
    expected = jax.jit(jax.vmap(jax.grad(lambda c: jnp.sum(jnp.abs(exact(c)) ** 2))))(c)
    np.testing.assert_allclose(slopes, expected, rtol=1e-11)
    single = viscous_receptance(
        **kw((jnp.eye(1, dtype=jnp.float32),) * 2),
        omega=OMEGA,
        out=[0],
        into=[0],
        C=2 * jnp.eye(1, dtype=jnp.float32),
    )
    assert single.dtype == jnp.complex64
    np.testing.assert_allclose(single[:, 0, 0], exact(2.0), rtol=1e-5)


@jax.jit
def by_inverse(K, M, C, omega=OMEGA):
    return jnp.stack([jnp.linalg.inv(lax.complex(K - w**2 * M, w * C)) for w in omega])


@pytest.mark.long
def test_many_defective_roots_and_free_motion():
    """A free chain, every elastic mode critical; two free chains side by side, damped by unlike dampers."""
    K, M = chain(5, 3.0, 1.5, ends=0)
    values, X = np.linalg.eigh(np.asarray(K) / 1.5)
    C = jnp.asarray(1.5 * X @ np.diag(2 * np.sqrt(np.maximum(values, 0.0))) @ X.T)
    every = tuple(range(5))
    np.testing.assert_allclose(
        viscous_receptance(K=K, M=M, omega=OMEGA, out=every, into=every, C=C), by_inverse(K, M, C), rtol=1e-11
    )
    K, M = (jnp.kron(jnp.diag(jnp.array([1.0, 1.3])), A) for A in (K, M))
    C = 0.02 * K + 0.1 * K @ K
    every = tuple(range(10))
    found = viscous_receptance(K=K, M=M, omega=OMEGA, out=every, into=every, C=C)
    np.testing.assert_allclose(found, by_inverse(K, M, C), rtol=1e-11, atol=1e-13)


@pytest.mark.long
def test_loads_and_outputs_of_an_unsymmetric_system():
    """Forward and reverse through both matrices of an unsymmetric system, defective by its follower force."""
    K, M, C = jnp.array([[1.0, 1.0], [0.0, 1.0]]), jnp.eye(2), 0.3 * jnp.eye(2)

    def size(way, t):
        return jnp.sum(
            jnp.abs(way(K + t * jnp.ones((2, 2)), M, C + t * K)) ** 2 * jnp.arange(1.0, 5.0).reshape(1, 2, 2)
        )

    ways = (lambda K, M, C: viscous_receptance(K=K, M=M, omega=OMEGA, out=(0, 1), into=(0, 1), C=C), by_inverse)
    for derivative in (jax.grad, jax.jacfwd):
        found, expected = (jax.jit(derivative(lambda t, way=way: size(way, t)))(0.0) for way in ways)
        np.testing.assert_allclose(found, expected, rtol=1e-11)


def coupling():
    K, M = chain(4, 2.0, 1.0)
    return K, M, jnp.diag(jnp.array([0.4, 0.0, 0.1, 0.9]))


@pytest.mark.long
def test_damping_that_couples_the_modes_under_tracing():
    """The direct solution, with its derivatives; concrete it is refused as before."""
    K, M, C = coupling()
    with pytest.raises(ValueError, match="couples the modes"):
        receptance(K=K, M=M, omega=OMEGA, out=(0, 1, 2, 3), into=(0, 1, 2, 3), C=C)

    def size(way, s):
        return jnp.sum(jnp.abs(way(s * K, M, s**2 * C)) ** 2 * jnp.arange(1.0, 5.0)[None, :, None])

    ways = (lambda K, M, C: receptance(K=K, M=M, omega=OMEGA, out=(0, 1, 2, 3), into=(0, 1, 2, 3), C=C), by_inverse)
    transforms = (lambda f: f, jax.grad, jax.jacfwd, jax.hessian)
    found, expected = (
        jax.jit(lambda s, way=way: [transform(lambda s: size(way, s))(s) for transform in transforms])(1.1)
        for way in ways
    )
    np.testing.assert_allclose(found, expected, rtol=1e-10)
    scales = jnp.array([0.5, 1.0, 1.7])
    found, expected = (jax.jit(jax.vmap(lambda s, way=way: way(s * K, M, C)))(scales) for way in ways)
    np.testing.assert_allclose(found, expected, rtol=1e-11)


@pytest.mark.long
def test_large_matrices_are_solved_by_lapack():
    """More coordinates than are inverted by elimination, one of the frequencies in need."""
    K, M = chain(40, 2.0, 1.0)
    C = 0.1 * jnp.eye(40).at[3, 3].set(4.0)
    found = jax.jit(jax.vmap(lambda s: receptance(K=s * K, M=M, omega=OMEGA, out=(0, 7), into=(3,), C=C)))(
        jnp.array([1.0, 1.2])
    )
    np.testing.assert_allclose(found[1], by_inverse(1.2 * K, M, C)[:, jnp.array([0, 7])][:, :, 3:4], rtol=1e-10)


def test_unsymmetric_matrices_under_tracing():
    """Not a number, where they are refused when concrete."""
    K, M, _ = coupling()
    ask = jax.jit(lambda K, M: receptance(K=K, M=M, omega=OMEGA, out=(0,), into=(0,)))
    assert np.all(np.isfinite(ask(K, M)))
    assert np.all(np.isnan(ask(K.at[0, 3].add(0.5), M)))
    assert np.all(np.isnan(ask(K, M.at[0, 3].add(0.1))))


def refined(Z, right):
    """Solution with residuals in extended precision."""
    wide, x = Z.astype(np.clongdouble), np.zeros(right.shape, np.clongdouble)
    for _ in range(8):
        x = x + np.linalg.solve(Z, (right - wide @ x).astype(complex))
    return x.astype(complex)


@pytest.mark.long
@pytest.mark.parametrize("way", [pytest.param("direct", marks=pytest.mark.long), "modal", "viscous"])
def test_a_beam_of_many_states(way):
    """A cantilever of 174 elements: digits as far as half a rounding of its entries lets them, some times over."""
    K, M = beam(174, fixed=2)
    C = 1e-3 * M + 1e-6 * K
    omega = np.array([0.5, 30.0, 400.0])
    tip = 346
    K_, M_, C_ = (np.asarray(A) for A in (K, M, C))
    right = np.eye(348)[:, [tip]]
    uneven = np.random.default_rng(0).uniform(-1, 1, K_.shape)
    data = (K_, K_ * (1 + 1.1e-16 * (uneven + uneven.T) / 2))
    expected, other = (np.stack([refined(K + 1j * w * C_ - w**2 * M_, right)[tip, 0] for w in omega]) for K in data)
    if way == "direct":
        found = dense_response(K=K, M=M, load=jnp.asarray(right), omega=omega, C=C, out=jnp.asarray(right).T)
    else:
        found = {"modal": receptance, "viscous": viscous_receptance}[way](
            K=K, M=M, C=C, omega=omega, out=(tip,), into=(tip,)
        )
    doubt = np.abs(other - expected)
    assert np.all(np.abs(found[:, 0, 0] - expected) < {"direct": 5.0}.get(way, 20.0) * doubt)
