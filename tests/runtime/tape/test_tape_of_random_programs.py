"""Random programs have on tapes the answers that XLA gives."""

import jax
import numpy as np
import pytest

from jaxmbs.runtime.tape import Tape, UnsupportedError, is_available

from .random_programs import in_a_scan, in_lanes, random_program, slope

pytestmark = pytest.mark.skipif(not is_available(), reason="this installation was made without a C compiler")
FORMS = {"plain": lambda f: f, "scan": in_a_scan, "lanes": in_lanes, "slope": slope}


@pytest.fixture(autouse=True)
def any_types():
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield


def compare(seed, form):
    """True if the tape took the program."""
    function, args = random_program(seed)
    function = FORMS[form](function)
    try:
        found = Tape(jax.make_jaxpr(function)(*args))(*args)
    except UnsupportedError:
        return False
    for a, b in zip(found, jax.tree.leaves(jax.jit(function)(*args)), strict=True):
        b = np.asarray(b)
        assert (a.shape, a.dtype) == (b.shape, b.dtype)
        scale = np.max(np.abs(b), initial=1.0, where=np.isfinite(b))
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11 * scale)
    return True


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_random_programs_are_those_of_xla(form):
    assert sum(compare(seed, form) for seed in range(2)) >= 1


@pytest.mark.long
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("block", range(10))
def test_many_random_programs_are_those_of_xla(form, block):
    assert sum(compare(seed, form) for seed in range(25 * block, 25 * block + 25)) >= 15
