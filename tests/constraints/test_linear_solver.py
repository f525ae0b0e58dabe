"""The build chooses the solver by size and front; the user may name one."""

import pytest

import jaxmbs as mbs
from tests.cases import models
from tests.models import four_bar_builder
from tests.zoo import SPECIMENS


def test_small_systems_are_dense_and_long_rows_frontal():
    assert models.n_four_bar(3).topology.linear_solver == "dense"
    system = models.n_four_bar(12)
    assert system.topology.linear_solver == "frontal"
    assert "linear solver: frontal" in system.describe()
    assert SPECIMENS["tree"].system.topology.linear_solver == "dense"


@pytest.mark.slow
def test_the_user_names_one_and_like_keeps_it():
    system = four_bar_builder().build(linear_solver="frontal")
    assert four_bar_builder().build(like=system).topology.linear_solver == "frontal"
    with pytest.raises(mbs.ModelError, match="linear_solver must be one of 'auto', 'dense'"):
        four_bar_builder().build(linear_solver="sparse")
