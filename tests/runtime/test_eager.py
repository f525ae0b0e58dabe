"""Single operations on tapes are those of JAX: values, types, derivatives, errors; and nothing is compiled."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import not_tracing, tuning
from jaxmbs.runtime._eager import _TAPES, eager_on_tapes
from tests.compilations import compiled

X = jnp.array([[1.0, -2.0, 0.5], [0.0, 3.0, -0.25]])
K = jnp.array([2, 0, 1])


@jax.custom_jvp
def cube(x):
    return x**3


cube.defjvp(lambda primals, tangents: (cube(*primals), 3.0 * primals[0] ** 2 * tangents[0]))

OPERATIONS = {
    "sum": lambda: jnp.sum(X, axis=1),
    "where": lambda: jnp.where(X > 0.0, X, jnp.nan),
    "product": lambda: X @ X.T,
    "einsum": lambda: jnp.einsum("ij,kj->ik", X, X),
    "concatenate": lambda: jnp.concatenate([X, 2.0 * X]),
    "gather": lambda: X[:, K],
    "slice": lambda: X[1, ::-1],
    "set": lambda: X.at[0, 1].set(7.0),
    "add at": lambda: X.at[:, K].add(1.0),
    "argmax": lambda: jnp.argmax(jnp.abs(X), axis=0),
    "sort": lambda: jnp.sort(X, axis=1),
    "cumsum": lambda: jnp.cumsum(X, axis=1),
    "complex": lambda: jnp.sum(jax.lax.complex(X, X) ** 2),
    "whole numbers": lambda: (K + 1) // 2,
    "truth": lambda: jnp.any(X < 0.0) & (K > 0),
    "nan": lambda: jnp.max(jnp.array([1.0, jnp.nan])),
    "solve": lambda: jnp.linalg.solve(X[:, :2], X[:, 2]),
    "gradient": lambda: jax.grad(lambda x: jnp.sum(jnp.sin(x) * x))(X),
    "custom rule": lambda: jax.grad(lambda x: jnp.sum(cube(x)))(X),
    "vmap": lambda: jax.vmap(lambda x: x @ x)(X),
    "jit": lambda: jax.jit(lambda x: jnp.exp(x) + 1.0)(X),
    "loop": lambda: jax.lax.while_loop(lambda x: x[0] < 10.0, lambda x: 2.0 * x, X[0]),
    "scan": lambda: jax.lax.scan(lambda c, x: (c + x, c), jnp.zeros(3), X)[1],
    "jaxpr": lambda: jnp.asarray(len(jax.make_jaxpr(jnp.sin)(X).eqns)),
    "key": lambda: jax.random.normal(jax.random.key(1), (3,)),
    "weak": lambda: jnp.asarray(2.0) * 3.0,
    "empty": lambda: jnp.sum(jnp.zeros((0, 3)), axis=0),
    "numbers": lambda: (2.0 * X - 1) / 3.0 + jnp.maximum(X, 0.5) ** 2,
    "comparison with a number": lambda: (X > 0.25) | (K == 2),
    "linspace": lambda: jnp.linspace(0.0, 1.0, 5),
}
COMPILES = {"loop", "scan", "key", "jit", "weak"}  # loops, random keys, and what has weak types in it


def on_tapes(function):
    with eager_on_tapes(itertools.count()):
        assert not_tracing()
        return function()


@pytest.mark.parametrize("name", OPERATIONS)
def test_an_operation_is_that_of_jax(name):
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        plain, found = OPERATIONS[name](), on_tapes(OPERATIONS[name])
    assert found.dtype == plain.dtype and found.shape == plain.shape and found.weak_type == plain.weak_type
    np.testing.assert_allclose(found, plain, rtol=1e-14, atol=1e-15)


@pytest.mark.slow
def test_operations_compile_nothing():
    jax.clear_caches()
    _TAPES.clear()
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        names = sorted(OPERATIONS.keys() - COMPILES)
        assert len(compiled(lambda: [on_tapes(OPERATIONS[name]) for name in names])) <= 4
        assert len(compiled(lambda: [OPERATIONS[name]() for name in names])) > 40


@pytest.mark.slow
def test_builders_and_results_compile_little(monkeypatch):
    """The first calls of a builder and properties of results, of sizes that no other test has."""
    monkeypatch.setattr(tuning, "EAGER_CALLS", 10**9)  # whatever other tests have called
    section = mbs.forces.BeamSection.of_material(70e9, 26e9, 2700.0, 4e-4, 1.3e-8, 1.3e-8)
    spectrum = mbs.qualification.shock_spectrum(np.sin(np.arange(71.0)), 1e-3, np.linspace(5.0, 80.0, 23))

    def build_and_ask():
        b = mbs.SystemBuilder()
        b.beam("whip", section, [(0, 0, 0), (0, 0.0, 1)], elements=7)
        b.joint("clamp", mbs.Weld(), "ground", "whip.0")
        system = b.build()
        assert system.mass.shape[0] >= 8 and spectrum.negative.shape == spectrum.maximax.shape == (23,)

    assert len(compiled(build_and_ask)) <= 2


def test_within_a_trace_it_is_that_trace():
    def function(x):
        with eager_on_tapes(itertools.count()):
            assert not not_tracing()
            return jnp.sin(x) * 2.0

    np.testing.assert_allclose(jax.jit(jax.grad(function))(0.3), 2.0 * np.cos(0.3), rtol=1e-15)


def test_a_function_that_is_called_often_is_left_to_the_compiler():
    calls = itertools.count(tuning.EAGER_CALLS + 1)
    before = len(_TAPES)
    with eager_on_tapes(calls):
        jnp.sum(X * 1.25, axis=0)
    assert len(_TAPES) == before


def test_errors_are_those_of_jax_and_the_context_ends_with_them():
    with pytest.raises(TypeError, match="incompatible shapes"):
        on_tapes(lambda: jax.lax.add(jnp.ones(2), jnp.ones(3)))
    with pytest.raises(ZeroDivisionError):
        on_tapes(lambda: 1 // 0)
    assert not_tracing() and jnp.sum(X) == 2.25
