"""Functions known by what they hold: equal where they do the same, else different."""

import dataclasses
import functools
import importlib
import math
import os
import random
import sys
import threading
import time
import types

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime._content import KnownFunction, UnknownContentError, content_of
from jaxmbs.runtime._fingerprint import fingerprint


def closing(k):
    return lambda x: k * x


def with_array(k):
    weights = np.array([1.0, k])
    return lambda x: weights @ x


def with_default(k):
    return lambda x, k=k: k * x


def with_constant(k):
    return eval(f"lambda x: {k} * x")


def reading(k):
    space = {"K": k, "jnp": jnp, "__name__": "users"}
    exec("def f(x): return jnp.sin(K * x)", space)
    return space["f"]


def nested(k):
    inner = closing(k)
    return lambda x: [inner(y) for y in x]


def partial(k):
    return functools.partial(lambda k, x: k * x, k)


def compiled(k):
    return jax.jit(lambda x: k * x)


def with_rule(k):
    f = jax.custom_jvp(lambda x: 2.0 * x)
    f.defjvp(lambda primals, tangents: (f(*primals), k * tangents[0]))
    return f


def attribute(k):
    return (lambda x: x.real) if k > 2.5 else (lambda x: x.imag)


KINDS = [closing, with_array, with_default, with_constant, reading, nested, partial, compiled, with_rule, attribute]


@pytest.mark.parametrize("kind", KINDS)
def test_content_decides(kind):
    two, again, three = (KnownFunction(kind(k)) for k in (2.0, 2.0, 3.0))
    assert two == again and hash(two) == hash(again) and two.function is not again.function
    assert two != three and two != two.function


def reading_clock(x):
    return x * time.time()


def reading_environment(x):
    return x * float(os.environ["FACTOR"])


def reading_file(x):
    return x * np.loadtxt("factors.txt")


def reading_names(x):
    return x * eval("math.pi")


def importing(x):
    import secrets

    return x * secrets.randbelow(3)


def setting(x):
    global _TIMES
    _TIMES = x
    return x


UNKNOWN = [
    *(reading_clock, reading_environment, reading_file, reading_names, importing, setting, time.time, os.getenv),
    *(lambda x: random.random() * x, lambda x: np.random.rand() * x, lambda x: x * hash("name"), random.random),
    *(lambda x: mbs.io.load_model("crane.toml"), lambda x: mbs.tuning, lambda x: jax.config.jax_enable_x64),
    np.frompyfunc(lambda x: x, 1, 1),
]


@pytest.mark.parametrize("function", UNKNOWN, ids=range(len(UNKNOWN)))
def test_what_reads_more_than_its_arguments_is_like_itself_alone(function):
    with pytest.raises(UnknownContentError):
        content_of(function)
    assert KnownFunction(function) == KnownFunction(function) and not KnownFunction(function).is_known


def test_what_may_change_is_like_itself_alone():
    """A module that is no file, an object that is known by its identity alone, a lock."""
    module = types.ModuleType("settings")
    space = {"settings": module, "__name__": "users"}
    exec("def f(x): return settings.k * x", space)
    for thing in (object(), threading.Lock(), open):
        with pytest.raises(UnknownContentError):
            content_of(lambda x, thing=thing: thing)
    with pytest.raises(UnknownContentError):
        content_of(space["f"])


def law_class(k, base=eqx.Module, default=1.0, helper=math.sin):
    class Law(base):
        stiffness: float = default

        def __call__(self, x):
            return k * helper(x) * self.stiffness

    return Law


def test_classes_and_their_objects_are_known_by_what_they_do():
    """Methods, bases, defaults of fields; what an object holds, its own attributes too."""
    kinds = [law_class(2.0), law_class(3.0), law_class(2.0, default=2.0), law_class(2.0, helper=math.cos)]
    kinds += [law_class(2.0, base=dataclasses.dataclass(type("Base", (), {"__call__": lambda self, x: x})))]
    assert len({content_of(kind) for kind in kinds}) == 5
    assert (
        content_of(law_class(2.0)) == content_of(kinds[0]) != content_of(kinds[0](1.0)) != content_of(kinds[0](3.0))
    )
    plain = type("Plain", (), {"__call__": lambda self, x: self.k * x})
    one, two = plain(), plain()
    one.k, two.k = 1.0, 2.0
    assert content_of(one) != content_of(two)
    two.k = 1.0
    assert content_of(one) == content_of(two)
    table = {"a": 1}
    before = content_of(table.get)
    table["a"] = 2
    assert content_of(table.get) != before


def test_a_module_is_known_by_the_entries_that_are_read(tmp_path, monkeypatch):
    """Edited, or set from outside; what is not read does not count."""
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "users_rods.py"
    file.write_text("K = 2.0\nOTHER = 1.0\ndef area(r):\n    return K * r**2\n")
    import users_rods

    def function(x):
        return users_rods.area(x)

    before = content_of(function)
    users_rods.OTHER = 3.0
    assert content_of(function) == before
    users_rods.K = 3.0
    assert content_of(function) != before
    file.write_text("K = 2.0\nOTHER = 1.0\ndef area(r):\n    return K * r**2 / 2.0\n")
    importlib.invalidate_caches()
    file.with_suffix(".py").touch()
    monkeypatch.delitem(sys.modules, "users_rods")
    assert content_of(function) != before


def test_it_is_called_and_named_as_the_function():
    """Also one that calls itself."""

    def factorial(n):
        return 1 if n == 0 else n * factorial(n - 1)

    found = KnownFunction(factorial)
    assert found(4) == math.factorial(4) and found.__name__ == "factorial" and "factorial" in repr(found)
    assert content_of(math.sin) == content_of(math.sin) != content_of(math.cos)


def pendulum(law):
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name in ("one", "two"):
        b.body(name, mass=1.0, com=(0.0, -1.0, 0.0), inertia=(1.0, 1.0, 1.0))
        b.joint(name, mbs.Revolute("z"), "ground", name)
    b.force("spring", mbs.Actuator(law), joint="one")
    b.constraint("gear", mbs.Coupler({"one": 1.0, "two": 2.0}, function=lambda a, b: a - 2.0 * b))
    return b.build()


@pytest.mark.long
def test_a_law_defined_again_compiles_nothing():
    """As a lambda in a loop does; with another number in it the answer is another one."""
    traced = []

    def effort(k):
        def law(x, v, t):
            return -k * x

        return law

    @jax.jit
    def energy(system, state):
        traced.append(1)
        return jnp.sum(mbs.forward_dynamics(system, state)[0] ** 2)

    systems = [pendulum(effort(k)) for k in (2.0, 2.0, 2.0, 5.0)]
    state = mbs.State.at(systems[0], one=0.3)
    found = [float(energy(system, state)) for system in systems]
    assert len(traced) == 2 and found[0] == found[2] != found[3]
    assert len({jax.tree.structure(system) for system in systems}) == 2


def test_programs_are_known_by_what_they_trace():
    """Names do not count, constants do, in loops and derivatives too; rounding does not."""

    def name_of(function):
        return fingerprint(jax.make_jaxpr(function)(jnp.zeros(3)))

    def scanned(table):
        return lambda x: jax.lax.scan(lambda c, row: (c + row @ x, None), 0.0, table)[0]

    def renamed(values):
        return jax.jit(lambda entries: jnp.sin(entries))(values)

    table = np.arange(6.0).reshape(2, 3) / 7.0
    assert name_of(lambda x: jax.jit(jnp.sin)(x)) == name_of(renamed) != name_of(jnp.cos)
    assert name_of(scanned(table)) == name_of(scanned(table * (1.0 + 1e-15)))
    programs = [scanned(table), scanned(table + 1e-9), scanned(table[::-1]), jax.grad(scanned(table))]
    assert len({name_of(program) for program in programs}) == 4
    assert name_of(lambda x: 2.0 * x) != name_of(lambda x: 3.0 * x)
    assert name_of(lambda x: x[0] - x[1]) != name_of(lambda x: x[1] - x[0])
