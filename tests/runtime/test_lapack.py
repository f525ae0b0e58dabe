"""Square, positive and eigenproblems one matrix at a time: values, derivatives of two orders, batches."""

import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxmbs.math import _square as square
from jaxmbs.ode._linear_solver import SquareSolver
from jaxmbs.runtime import lapack, tuning
from tests.marks import cases

SIZES = [0, 1, 7, tuning.ELIMINATED_UNKNOWNS, tuning.ELIMINATED_UNKNOWNS + 5]


def _matrix(n, dtype=float, seed=0):
    random = np.random.default_rng(seed)
    A = random.normal(size=(n, n)) + (1j * random.normal(size=(n, n)) if dtype is complex else 0.0)
    return jnp.asarray(A + 2.0 * np.eye(n))


def _definite(n, seed=0):
    A = _matrix(n, seed=seed)
    return A @ A.T + n * jnp.eye(n)


@pytest.mark.parametrize("dtype", [float, complex])
@pytest.mark.parametrize("n", cases(SIZES, long=SIZES[2:]))
def test_general_systems_as_numpy(n, dtype):
    A, B = _matrix(n, dtype), _matrix(n, dtype, 1)[:, : max(1, n // 2)]
    np.testing.assert_allclose(square.solve(A, B), np.linalg.solve(A, B), rtol=1e-9, atol=1e-11)
    b = B.sum(axis=1)  # one right side, of no length for n = 0
    np.testing.assert_allclose(square.solve(A, b), np.linalg.solve(A, b), rtol=1e-9, atol=1e-11)
    P, sign, log = square.inverse_with_determinant(A)
    np.testing.assert_allclose(P, np.linalg.inv(A), rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose((sign, log), np.linalg.slogdet(A), rtol=1e-10, atol=1e-12)


def test_rows_that_must_change_places():
    A = jnp.asarray([[0.0, 0.0, 2.0], [1e-20, 3.0, 1.0], [4.0, 1.0, 1.0]])
    np.testing.assert_allclose(square.solve(A, jnp.eye(3)) @ A, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(square.inverse_with_determinant(A)[1:], np.linalg.slogdet(A), rtol=1e-14)
    assert not np.all(np.isfinite(square.solve(jnp.ones((2, 2)), jnp.ones(2))))


@pytest.mark.long
@pytest.mark.parametrize("n", [4, tuning.ELIMINATED_UNKNOWNS + 2])
def test_derivatives_of_two_orders(n):
    A, S, b = _matrix(n), _definite(n), _matrix(n, seed=1)[:, :2]

    @jax.jit
    def everything(t):
        definite = S + t * jnp.diag(b[:, 0] ** 2)
        return (
            square.solve(A + t * A.T, b + t),
            square.inverse_with_determinant(A + t * A.T)[::2],
            lapack.solve_positive(definite, b + t),
            lapack.solve_triangular(lapack.cholesky(definite), b),
            lapack.solve_triangular(S + t * S.T, b, lower=False, transposed=True),
        )

    check_grads(everything, (0.3,), 2, rtol=2e-5)


@pytest.mark.long
@pytest.mark.parametrize("n", [3, tuning.ELIMINATED_UNKNOWNS + 1])
def test_batches_give_what_single_calls_give(n):
    A = jnp.stack([_matrix(n, seed=k) for k in range(6)]).reshape(2, 3, n, n)
    S, b = jnp.einsum("abij,abkj->abik", A, A) + n * jnp.eye(n)[None, None], A[0, 0]
    twice = lambda f: jax.jit(jax.vmap(jax.vmap(f)))
    for found, right in [
        (twice(lambda A: square.solve(A, b))(A), np.linalg.solve(A, b)),
        (twice(lambda b: square.solve(A[1, 1], b))(A), np.linalg.solve(A[1, 1], A)),
        (twice(lambda b: lapack.solve_positive(S[0, 0], b))(A), np.linalg.solve(S[0, 0], A)),
        (twice(lapack.cholesky)(S), np.linalg.cholesky(S)),
    ]:
        np.testing.assert_allclose(found, right, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(twice(lapack.eigvalsh)(S), np.linalg.eigvalsh(S), rtol=1e-11)
    values, X = twice(lapack.eigh)(S)
    np.testing.assert_allclose(S @ X, X * values[..., None, :], atol=1e-9)
    U, s, Vh = twice(lapack.svd)(A)
    np.testing.assert_allclose((U * s[..., None, :]) @ Vh, A, atol=1e-11)
    values, X = twice(lapack.eig)(A)
    np.testing.assert_allclose(A.astype(X.dtype) @ X, X * values[..., None, :], atol=1e-10)


@pytest.mark.long
@pytest.mark.parametrize("n", [3, tuning.ELIMINATED_UNKNOWNS + 1])
def test_gradients_of_batches(n):
    A = jnp.stack([_matrix(n, seed=k) for k in range(3)])
    found = jax.jit(jax.vmap(jax.grad(lambda A: jnp.sum(square.solve(A, jnp.sin(A)) ** 2))))(A)
    right = jax.vmap(jax.grad(lambda A: jnp.sum(jnp.linalg.solve(A, jnp.sin(A)) ** 2)))(A)
    np.testing.assert_allclose(found, right, rtol=1e-7, atol=1e-9)


@pytest.mark.long
def test_as_a_solver_of_lineax():
    A, b = _matrix(5), jnp.arange(5.0)

    def solve(A, b):
        return lx.linear_solve(lx.MatrixLinearOperator(A), b, SquareSolver()).value

    np.testing.assert_allclose(solve(A, b), np.linalg.solve(A, b))
    check_grads(jax.jit(solve), (A, b), 2, rtol=1e-5)
    with pytest.raises(ValueError, match="square"):
        solve(A[:, :3], b)
