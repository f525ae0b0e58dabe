"""Rank, null spaces and least-norm solutions of sparse rows against singular value decompositions."""

import numpy as np
import pytest
import scipy.sparse

from jaxmbs.constraints._sparse_rank import damped_solver, least_norm_solution, sparse_spaces


def banded(n, rank_loss, seed, smallest=1e-4):
    """Rows (m, n) of three neighbours each, some of them repeated combinations, and one small singular value."""
    random = np.random.default_rng(seed)
    A = np.zeros((n - 4, n))
    for k in range(n - 4):
        A[k, k : k + 3] = random.normal(size=3)
    A[3, 3:6] *= smallest
    return np.concatenate([A, random.normal(size=(rank_loss, n - 4)) @ A])


@pytest.mark.parametrize("n, rank_loss", [(40, 0), (40, 3), (60, 12), (9, 2)])
def test_spaces_are_those_of_the_singular_values(n, rank_loss):
    A = banded(n, rank_loss, n)
    rank, Z, Y = sparse_spaces(scipy.sparse.csr_array(A), 1e-7, 1e-3)
    assert rank == n - 4 == np.linalg.matrix_rank(A)
    np.testing.assert_allclose(Z.T @ Z, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(A @ Z, 0.0, atol=1e-12)
    assert Y.shape == (len(A), min(8, rank_loss))
    np.testing.assert_allclose(A.T @ Y, 0.0, atol=1e-9)
    if 0 < rank_loss < 8:
        assert np.linalg.matrix_rank(Y, 1e-6) == rank_loss


@pytest.mark.parametrize("size, counts", [(1e-5, True), (1e-9, False)])
def test_a_singular_value_counts_by_its_size(size, counts):
    """Both sides of the tolerance, one of them below what the normal matrix of the rows can show."""
    random = np.random.default_rng(2)
    Q, P = (np.linalg.qr(random.normal(size=(30, 30)))[0] for _ in range(2))
    A = Q @ np.diag(np.r_[np.ones(29), size]) @ P
    assert sparse_spaces(scipy.sparse.csr_array(A), 1e-7, 1e-3)[0] == 29 + counts


@pytest.mark.parametrize("rank_loss", [0, 5])
def test_least_norm_solutions_are_those_of_the_pseudo_inverse(rank_loss):
    A = banded(40, rank_loss, 3, smallest=1.0)
    gap = A @ np.random.default_rng(1).normal(size=40)
    expected = np.linalg.pinv(A, rcond=1e-12) @ gap  # the default may keep what rounding leaves of a zero
    np.testing.assert_allclose(least_norm_solution(scipy.sparse.csr_array(A), gap, 1e-7), expected, atol=1e-8)


def test_damped_solver():
    A, damping = banded(20, 2, 5), np.linspace(0.1, 1.0, 20)
    right = np.arange(20.0)
    expected = np.linalg.solve(A.T @ A + np.diag(damping), right)
    np.testing.assert_allclose(damped_solver(scipy.sparse.csr_array(A), damping)(right), expected, rtol=1e-10)
