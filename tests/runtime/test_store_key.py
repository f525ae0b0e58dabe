"""A key of the store that misses something is a wrong answer: one thing is changed at a time."""

import contextlib
import sys
import types

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import _store_key, tuning, without_tricks
from jaxmbs.runtime._store_key import question_key

from ..models import pendulum


def key_of(function, *args, **kwargs):
    return question_key(function, *eqx.partition((args, kwargs), eqx.is_array))


X = jnp.ones(3)


def function(code, **space):
    """A function of a user's module with these globals."""
    names = {"jnp": jnp, "np": np, "__name__": "users", "__builtins__": __builtins__, **space}
    exec(code, names)
    return names["f"]


def closing(value):
    return lambda x: value * x


def default(value):
    return lambda x, k=value: k * x


def keyword_default(value):
    return lambda x, *, k=value: k * x


def reading(value):
    return function("def f(x): return K * x", K=value)


def calling(value):
    return function("def f(x): return g(x)", g=closing(value))


def in_module(value):
    module = types.ModuleType("rods")
    module.__file__ = "rods.py"
    exec(f"def area(x): return {value} * x", vars(module))
    return function("def f(x): return rods.area(x)", rods=module)


def in_package(value):
    package, module = types.ModuleType("shop"), types.ModuleType("shop.rods")
    for one in (package, module):
        one.__file__ = "rods.py"
    package.rods, module.K = module, value
    return function("def f(x): return shop.rods.K * x", shop=package)


def array(value):
    return closing(np.array([1.0, value, 2.0]))


def device_array(value):
    return closing(jnp.array([1.0, value, 2.0]))


def captured_model(value):
    system = pendulum(mass=value)
    return lambda x: mbs.State.at(system).coordinates + x


def dictionary(value):
    return function("def f(x): return TABLE['k'] * x", TABLE={"k": value})


def method(value):
    kind = type("Law", (), {"__init__": lambda self, k: setattr(self, "k", k), "of": lambda self, x: self.k * x})
    return kind(value).of


def nested(value):
    inner = closing(value)
    return lambda x: (lambda y: inner(y))(x)


def derivative(value):
    return jax.grad(lambda x: jnp.sum(value * x**2))


def constant(value):
    return function(f"def f(x): return {value} * x")


CONTENTS = [closing, default, keyword_default, reading, calling, in_module, in_package, array, device_array]
CONTENTS += [captured_model, dictionary, method, nested, derivative, constant]


@pytest.mark.parametrize("kind", CONTENTS, ids=lambda kind: kind.__name__)
def test_what_a_function_holds_is_in_its_key(kind):
    same, again, other = (key_of(kind(k), X) for k in (2.0, 2.0, 2.5))
    assert same is not None and same == again != other


ARGUMENTS = {
    "shape": jnp.ones(4),
    "type": jnp.ones(3, np.int64),
    "weak type": jnp.asarray(1.0) if jnp.asarray(1.0).weak_type else jax.lax.full((3,), 1.0),
    "structure": (X,),
    "static": 3.0,
    "another static": 4.0,
    "name": "three",
    "function": closing(2.0),
    "another function": closing(3.0),
    "model": pendulum(),
    "model with another setting": eqx.tree_at(lambda s: s.gravity, pendulum(), 9.81),
}


def test_what_the_arguments_are_is_in_the_key_and_not_their_numbers():
    keys = {name: key_of(closing(2.0), argument) for name, argument in ARGUMENTS.items() if name != "weak type"}
    assert None not in keys.values() and len(set(keys.values())) == len(keys)
    assert key_of(closing(2.0), X) == key_of(closing(2.0), 2.0 * X) != key_of(closing(2.0), x=X)
    weak = jax.jit(lambda: 1.0)()
    assert weak.weak_type and key_of(closing(2.0), weak) != key_of(closing(2.0), jnp.zeros(()))


def flags(monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_enable_fast_math=true")


def number_of_the_library(monkeypatch):
    monkeypatch.setattr(tuning, "EXPANDED_PRODUCT", 7)


def another_cpu(monkeypatch):
    monkeypatch.setattr(_store_key, "cpu_name", lambda: "another")


def another_jax(monkeypatch):
    monkeypatch.setattr(_store_key, "_others", lambda: iter(["jax-0.99.0.dist-info"]))


def another_python(monkeypatch):
    monkeypatch.setattr(sys, "version", "4.0")


def edited_library(monkeypatch):
    monkeypatch.setattr(_store_key, "_sources", lambda folder: iter([]))


@pytest.mark.parametrize(
    "change", [flags, number_of_the_library, another_cpu, another_jax, another_python, edited_library]
)
def test_what_the_process_is_in_is_in_the_key(change, monkeypatch):
    _store_key._library.cache_clear()
    before = key_of(closing(2.0), X)
    change(monkeypatch)
    _store_key._library.cache_clear()
    after = key_of(closing(2.0), X)
    monkeypatch.undo()
    _store_key._library.cache_clear()
    assert before is not None and after is not None and before != after == after and key_of(closing(2.0), X) == before


CONTEXTS = {
    "x64": lambda: jax.enable_x64(False),
    "precision": lambda: jax.default_matmul_precision("float32"),
    "ranks": lambda: jax.numpy_rank_promotion("allow"),
    "types": lambda: jax.numpy_dtype_promotion("standard"),
    "generator": lambda: jax.default_prng_impl("rbg"),
    "tricks": lambda: without_tricks("tree_sums"),
}


@pytest.mark.parametrize("context", CONTEXTS.values(), ids=CONTEXTS)
def test_settings_of_jax_are_in_the_key(context):
    before = key_of(closing(2.0), X)
    with context():
        assert key_of(closing(2.0), X) not in (before, None)
    assert key_of(closing(2.0), X) == before


def test_a_library_that_is_changed_while_it_runs_has_no_keys(monkeypatch):
    _store_key._library.cache_clear()
    monkeypatch.setattr(_store_key, "_START", 0.0)
    assert key_of(closing(2.0), X) is None
    _store_key._library.cache_clear()


def test_what_is_not_known_has_no_key():
    with contextlib.suppress(ImportError):
        import random

        assert key_of(lambda x: random.random() * x, X) is None
    assert key_of(lambda x: np.loadtxt("k") * x, X) is None
    assert key_of(closing(2.0), object()) is None
    assert key_of(jax.make_jaxpr(jnp.sin)(X), X) is None


@pytest.mark.parametrize(
    "code",
    [
        "def f(x): return of(rods, x)",
        "def f(x): return getattr(rods, 'K') * x",
        "def f(x): return rods.__dict__['K'] * x",
        "def f(x): return of(shop.rods, x)",
        "def f(x): return (lambda m: m.K)(rods) * x",
    ],
)
def test_entries_of_a_module_that_are_read_out_of_sight_have_no_key(code):
    modules = {name: types.ModuleType(name) for name in ("rods", "shop")}
    for module in modules.values():
        module.__file__ = "rods.py"
    modules["rods"].K, modules["shop"].rods = 2.0, modules["rods"]
    assert key_of(function(code, of=function("def f(m, x): return m.K * x"), **modules), X) is None
    assert key_of(function("def f(x): return shop.rods.K * rods.K * x", **modules), X) is not None
