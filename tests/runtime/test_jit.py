"""`math.jit`: options of the compiler for programs of the library, and none for parts of the user's programs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.runtime import _jit as module
from jaxmbs.runtime._jit import SMALL, jit, options

X = jnp.array([0.3, 1.2])


@pytest.mark.parametrize("compile", ["full", "quick"])
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
    monkeypatch.setattr(module, "options", lambda compile, backend: {"no_such_option": 1})
    with pytest.raises(jax.errors.JaxRuntimeError, match="no_such_option"):
        jit(lambda x: x + 1.0)(X)


def test_unknown_options_and_those_of_the_user_are_left_out(monkeypatch):
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    level = "xla_backend_optimization_level"
    assert set(options.__wrapped__("full", "cpu").items()) ^ set(options.__wrapped__("quick", "cpu").items()) == {
        (level, 0),
        (level, 1),
    }
    assert options.__wrapped__("full", "cpu", often=True)[level] == 3
    assert options.__wrapped__("quick", "cpu", often=True)[level] == 0
    monkeypatch.setattr(module, "_FULL", {"no_such_option": 1, "xla_backend_optimization_level": 1})
    assert options.__wrapped__("full", "cpu") == {"xla_backend_optimization_level": 1}
    assert options.__wrapped__("full", "gpu") == {}
    monkeypatch.setenv("XLA_FLAGS", f"--{level}=0")
    assert options.__wrapped__("full", "cpu") == {}


def test_quick_programs_are_small_ones():
    """Whatever was traced before, and whichever kind a part of them has of itself."""
    part = jit(lambda x: x + (100.0 if SMALL.value else 0.0))
    quick, full = (
        jit(lambda x: part(x) + (10.0 if SMALL.value else 1.0), compile=kind) for kind in ("quick", "full")
    )
    for _ in range(2):
        assert float(part(1.0)) == 1.0 and float(full(1.0)) == 2.0 and float(quick(1.0)) == 111.0
    assert float(jax.jit(quick)(1.0)) == 2.0  # part of a program of the user's
    assert not SMALL.value
    with SMALL(True):  # a process whose programs are all to be small, as those of the command line
        assert float(full(1.0)) == 111.0


def test_unknown_kind():
    with pytest.raises(ValueError, match="'full' or 'quick'"):
        jit(lambda x: x, compile="slow")
