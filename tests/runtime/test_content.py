"""Functions known by what they hold: equal where they do the same, else different."""

import functools
import math
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


class Own(eqx.Module):
    k: float

    def __call__(self, x):
        return self.k * x


def test_what_may_change_is_like_itself_alone():
    """A module of the user's, an object, a class: nobody knows what they will do."""
    module, thing, own = types.ModuleType("settings"), object(), Own(2.0)
    space = {"settings": module, "__name__": "users"}
    exec("def f(x): return settings.k * x", space)
    for function in (space["f"], lambda x: thing, lambda x: own(x), lambda x: Own(1.0)(x)):
        assert KnownFunction(function) == KnownFunction(function)
        with pytest.raises(UnknownContentError):
            content_of(function)
    assert content_of(own, strict=False) != content_of(Own(3.0), strict=False)


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
