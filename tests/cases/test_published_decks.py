"""Benchmarks of NAFEMS as decks: the published frequencies."""

import jax
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.io import read_nastran
from tests.io.published import PUBLISHED, Published, rhombic_plate

QUICK = ("FV4 off-centre masses",)


@jax.jit
def matrices(model):
    system = model.system
    return system.stiffness, system.mass


def errors(case: Published, tmp_path):
    """Relative differences of the frequencies from the published ones."""
    (tmp_path / "deck.bdf").write_text(case.deck)
    K, M = map(np.asarray, matrices(read_nastran(tmp_path / "deck.bdf")))
    last = case.first + len(case.frequencies)
    values = scipy.linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, last - 1])
    assert np.all(values[: case.first] < 1e-6 * values[-1])
    return np.sqrt(values[case.first :]) / (2 * np.pi) / np.array(case.frequencies) - 1


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in PUBLISHED])
def test_published_frequencies(name, tmp_path):
    case = PUBLISHED[name]
    assert np.max(np.abs(errors(case, tmp_path))) < case.tolerance


@pytest.mark.slow
def test_finer_meshes_of_the_rhombic_plate_come_nearer(tmp_path):
    """The worst of our decks: errors fall as the square of the mesh, what they fall to is published.

    But for the fourth frequency, whose published value is 2 % higher; other codes have it exact on coarse meshes on
    which the others are 4 to 11 % too high.
    """
    case = PUBLISHED["FV22 rhombic plate"]
    coarse, fine = (1 + errors(case._replace(deck=rhombic_plate(n)), tmp_path) for n in (8, 16))
    assert np.all(np.abs(fine - 1) < np.abs(coarse - 1) / 3)
    np.testing.assert_allclose(fine + (fine - coarse) / 3, [1.0, 1.0, 1.0, 0.98, 1.0], atol=0.02)
