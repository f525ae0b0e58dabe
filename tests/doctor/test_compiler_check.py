"""The compiler computes what NumPy does; the check sees it where it does not."""

import jax
import numpy as np
import pytest

from jaxmbs.doctor import _compiler_check as check
from jaxmbs.doctor._compiler_programs import COMPILER_PROGRAMS


def _check(name):
    assert [str(wrong) for wrong in check.wrong_ways(name)] == []


@pytest.mark.parametrize("name", COMPILER_PROGRAMS)
def test_a_program_is_right(name):
    """With the flags of the tests."""
    _check(name)


@pytest.mark.user
@pytest.mark.parametrize("name", COMPILER_PROGRAMS)
def test_a_program_is_right_as_users_compile_it(name):
    _check(name)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1.001])
def test_one_wrong_lane_is_seen(monkeypatch, wrong):
    def compile_wrongly(program, x):
        found = program.numpy(x).copy()
        found[-1] *= wrong
        return found

    monkeypatch.setattr(check, "WAYS", {"a way": compile_wrongly})
    (found,) = check.wrong_ways("cumulative sum")
    assert (found.name, found.way, found.wrong, found.size) == ("cumulative sum", "a way", 1, 20_000)


def test_it_runs_in_double_precision_and_leaves_the_precision_as_it_is():
    given = jax.config.values["jax_enable_x64"]
    try:
        jax.config.update("jax_enable_x64", False)
        assert (
            list(check.wrong_ways("turned force, squared and summed")) == []
            and not jax.config.values["jax_enable_x64"]
        )
    finally:
        jax.config.update("jax_enable_x64", given)
