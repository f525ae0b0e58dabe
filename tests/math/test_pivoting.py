"""Pivots and sizes beside LAPACK's QR with column pivoting."""

import numpy as np
import pytest
import scipy.linalg

from jaxmbs.math._pivoting import pivoted_columns


@pytest.mark.parametrize("shape", [(1, 6), (3, 7), (5, 5), (7, 4)])
def test_columns_are_those_of_lapack(shape):
    A = np.random.default_rng(sum(shape)).normal(size=shape)
    order, sizes = pivoted_columns(A)
    R, pivots = scipy.linalg.qr(A, mode="r", pivoting=True)
    np.testing.assert_array_equal(order, pivots[: min(shape)])
    np.testing.assert_allclose(sizes, np.abs(np.diagonal(R)), rtol=1e-12)


def test_of_equal_columns_the_first_is_taken_and_what_depends_has_no_size():
    order, sizes = pivoted_columns(np.array([[0.2, 0.2 * (1.0 + 1e-15), 0.1], [0.0, 0.0, 0.0]]))
    assert order[0] == 0 and sizes[1] < 1e-15
    assert not pivoted_columns(np.zeros((2, 0)))[0].size
