"""Products by wide registers have the bits of those without."""

import ctypes

import jax.numpy as jnp
import numpy as np
import pytest
from jax import make_jaxpr

from jaxmbs.runtime.tape import Tape, _machine
from jaxmbs.runtime.tape._build import build_machine

SUBSCRIPTS = (
    "ij,jk->ik ij,kj->ik ji,jk->ki ij,j->i zij,zjk->zik zji,zkj->izk zpij,zjk->zpik ipj,kpj->ik i,i->".split()
)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The machine built without wide registers."""
    library = tmp_path_factory.mktemp("machine") / "machine.so"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CC", "cc -DIS_WIDE=0")
        if _machine.machine_kind() != "c" or not build_machine(library):
            pytest.skip("no C compiler")
    return ctypes.CDLL(str(library))


def operands(subscripts, rng):
    """Arrays of random sizes, some longer than what is loaded at once, with some that are no numbers."""
    sizes = {letter: int(rng.choice([1, 2, 3, 4, 5, 7, 13])) for letter in "ijkpz"}
    if rng.random() < 0.2:
        sizes["j"] = 150
    terms = subscripts.partition("->")[0].split(",")
    arrays = [rng.normal(size=[sizes[letter] for letter in term]) for term in terms]
    for array in arrays:
        array[rng.random(array.shape) < 0.01] = rng.choice([np.inf, -np.inf, 0.0, -0.0, 1e300])
    return arrays


@pytest.mark.slow
@pytest.mark.parametrize("subscripts", SUBSCRIPTS)
def test_the_bits_are_the_same(subscripts, plain, monkeypatch):
    rng = np.random.default_rng(len(subscripts))
    for _ in range(20):
        arrays = operands(subscripts, rng)
        tape = Tape(make_jaxpr(lambda *x: jnp.einsum(subscripts, *x))(*arrays))
        (wide,) = tape(*arrays)
        with monkeypatch.context() as patch:
            patch.setattr(_machine, "_machine", lambda: plain)
            (narrow,) = tape(*arrays)
        np.testing.assert_array_equal(wide, narrow)
        is_number = ~np.isnan(wide)
        np.testing.assert_array_equal(np.signbit(wide)[is_number], np.signbit(narrow)[is_number])
        with np.errstate(all="ignore"):
            np.testing.assert_allclose(wide, np.einsum(subscripts, *arrays), rtol=1e-12, atol=1e-12)
