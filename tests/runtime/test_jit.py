"""`runtime.jit`: options of the compiler for programs of the library, and none for parts of the user's programs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime import SMALL_PROGRAM, jit
from jaxmbs.runtime import _compiler_options as options
from jaxmbs.runtime import _jit as module
from jaxmbs.runtime._compiler_options import compiler_options
from jaxmbs.runtime.tape import Tape, UnsupportedError
from jaxmbs.runtime.tape._flatten import parts_of_scan

pytestmark = pytest.mark.usefixtures("tricks_on")

X = jnp.array([0.3, 1.2])


@pytest.mark.parametrize("compile", ["auto", "tape", "quick", "full"])
def test_values_and_every_transformation(compile):
    @jit(compile=compile)
    def f(x, name, scale=1.0):
        assert name == "static"
        return scale * jnp.sum(jnp.sin(x))

    np.testing.assert_allclose(f(X, "static", scale=2.0), 2.0 * np.sum(np.sin(X)), rtol=1e-15)
    np.testing.assert_allclose(jax.grad(f)(X, "static"), np.cos(X), rtol=1e-15)
    np.testing.assert_allclose(jax.jit(lambda x: f(x, "static"))(X), np.sum(np.sin(X)), rtol=1e-15)
    np.testing.assert_allclose(jax.vmap(lambda x: f(x, "static"))(X), np.sin(X), rtol=1e-15)
    np.testing.assert_allclose(jax.jacfwd(jax.grad(lambda x: f(x, "static")))(X), -np.diag(np.sin(X)), rtol=1e-15)
    np.testing.assert_allclose(jax.grad(lambda a: a * f(X, "static"))(3.0), np.sum(np.sin(X)), rtol=1e-15)


def test_options_reach_the_compiler(monkeypatch):
    """One that the compiler does not know is refused."""
    monkeypatch.setattr(module, "compiler_options", lambda compile, backend: {"no_such_option": 1})
    with pytest.raises(jax.errors.JaxRuntimeError, match="no_such_option"):
        jit(lambda x: x + 1.0, compile="full")(X)


@pytest.fixture
def no_flags(monkeypatch):
    """Options are chosen anew, without XLA_FLAGS."""
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    options._chosen.cache_clear()
    yield
    options._chosen.cache_clear()


def test_options_of_each_kind(no_flags):
    level = "xla_backend_optimization_level"
    kinds = {("full", False): 1, ("quick", False): 0, ("full", True): 3, ("quick", True): 0}
    found = {kind: compiler_options(kind[0], "cpu", often=kind[1]) for kind in kinds}
    assert {kind: given[level] for kind, given in found.items()} == kinds
    assert len({frozenset(given.items() - {(level, given[level])}) for given in found.values()}) == 1


def test_unknown_options_and_those_of_the_user_are_left_out(no_flags, monkeypatch):
    level = "xla_backend_optimization_level"
    monkeypatch.setattr(options, "_FULL", {"no_such_option": 1, level: 1})
    assert compiler_options("full", "cpu") == {level: 1}
    assert compiler_options("full", "gpu") == {}
    options._chosen.cache_clear()
    monkeypatch.setenv("XLA_FLAGS", f"--{level}=0")
    assert compiler_options("full", "cpu") == {}


def test_quick_programs_are_small_ones():
    """Whatever was traced before, and whichever kind a part of them has of itself."""
    part = jit(lambda x: x + (100.0 if SMALL_PROGRAM.value else 0.0), compile="full")
    quick, full = (
        jit(lambda x: part(x) + (10.0 if SMALL_PROGRAM.value else 1.0), compile=kind) for kind in ("quick", "full")
    )
    for _ in range(2):
        assert float(part(1.0)) == 1.0 and float(full(1.0)) == 2.0 and float(quick(1.0)) == 111.0
    assert float(jax.jit(quick)(1.0)) == 2.0  # part of a program of the user's
    assert not SMALL_PROGRAM.value
    with SMALL_PROGRAM(True):  # a process whose programs are all to be small, as those of the command line
        assert float(full(1.0)) == 111.0


def test_unknown_kind():
    with pytest.raises(ValueError, match="'auto', 'tape', 'quick' or 'full'"):
        jit(lambda x: x, compile="slow")


def test_releases_whose_programs_tapes_do_not_read_are_compiled(monkeypatch):
    def unknown(params):
        return parts_of_scan({"structures": params})

    monkeypatch.setattr("jaxmbs.runtime.tape._control.parts_of_scan", unknown)
    with pytest.raises(UnsupportedError, match="scans of this release"):
        Tape(jax.make_jaxpr(lambda x: jax.lax.scan(lambda c, r: (c + r, c), 0.0, x))(jnp.arange(3.0)))
    np.testing.assert_array_equal(
        jit(lambda x: jax.lax.scan(lambda c, r: (c + r, c), 0.0, x)[1])(jnp.arange(3.0)), [0.0, 0.0, 1.0]
    )
