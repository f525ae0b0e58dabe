"""Rank of mass matrices: rows whose mass follows from that of others, whatever the scales."""

import numpy as np
import pytest

from jaxmbs.linear._mass_rank import dependent_rows


def random_mass(n, rank, decades, draw):
    """A positive semidefinite matrix of a rank, its rows in units that differ by decades."""
    unit = 10.0 ** draw.uniform(-decades, decades, n)
    A = draw.standard_normal((n, rank))
    return (A * unit[:, None]) @ (A * unit[:, None]).T


@pytest.mark.parametrize("decades", [0, 3, 6])
@pytest.mark.parametrize(("n", "rank"), [(2, 1), (6, 3), (6, 6), (12, 5), (40, 31)])
def test_as_many_rows_depend_as_the_rank_lacks(n, rank, decades):
    draw = np.random.default_rng(7)
    M = random_mass(n, rank, decades, draw)
    found = dependent_rows(M, range(n))
    assert len(found) == n - rank
    rest = [k for k in range(n) if k not in found]
    size = np.sqrt(np.diagonal(M))[rest]
    assert np.linalg.cond(M[np.ix_(rest, rest)] / size / size[:, None]) < 1e9


def test_neither_a_ratio_of_masses_nor_a_small_inertia_is_a_lack_of_rank():
    assert dependent_rows(np.diag([1e13, 1.0, 1e-13]), range(3)) == []
    m, e, own = 3.0, 0.2, 1e-9
    beside = np.array([[m, m * e], [m * e, m * e**2 * (1.0 + own)]])
    assert dependent_rows(beside, range(2)) == []
    assert dependent_rows(np.array([[m, m * e], [m * e, m * e**2]]), range(2)) == [1]


def test_a_mass_that_is_not_positive_is_left_to_those_who_refuse_it():
    assert dependent_rows(np.array([[1.0, 2.0], [2.0, 1.0]]), range(2)) == []


def test_rows_left_out_do_not_count():
    m, e = 3.0, 0.2
    assert dependent_rows(np.array([[m, m * e], [m * e, m * e**2]]), [1]) == []
