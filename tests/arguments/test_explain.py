"""Wrong arguments of any public function: named, where the function fails on them below the library."""

import inspect
import pickle
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.arguments import argument_faults
from jaxmbs.probability import Normal
from tests.cases.models import simple_pendulum

HUGE = 10**400


def gain(x: float, y: np.ndarray | list | None = None, *, names: tuple[str, ...] = ("a",), count: int = 2) -> float:
    return np.asarray(x, float) / count


@pytest.mark.parametrize(
    "args, options, words",
    [
        (("text",), {}, "x must be numbers, not 'text'"),
        ((None,), {}, "x must be given, not None"),
        ((HUGE,), {}, "x is too large: a number of 401 digits"),
        ((1.0, [[HUGE]]), {}, "y is too large"),
        ((1.0,), {"count": "3"}, "count must be a whole number, not '3'"),
        ((1.0,), {"names": 3.0}, "names must be a list, not 3.0"),
        ((np.zeros(0),), {}, "x is empty"),
        ((np.ones(2), np.ones(3)), {}, "these shapes do not fit: x (2,), y (3,)"),
        ((1.0, None), {}, None),
    ],
    ids=str,
)
def test_faults_of_a_call(args, options, words):
    faults = argument_faults(gain, args, options, ValueError("shapes"))
    assert faults == [] if words is None else len(faults) == 1 and words in faults[0]


def test_all_faults_stand_in_one_report():
    assert len(argument_faults(gain, ("a", "b"), {"count": "c"})) == 3


def test_errors_in_the_functions_of_a_user_stay():
    with pytest.raises(KeyError, match="mine"):
        mbs.design.tolerances(lambda d: {}["mine"], {"k": 0.3}, {"k": 0.1})
    with pytest.raises(ZeroDivisionError):
        mbs.batch(lambda x: 1 / 0, jnp.arange(3.0), progress=False)


def test_words_of_the_library_stay():
    with pytest.raises(mbs.UnknownNameError, match="there is no"):
        b = mbs.SystemBuilder()
        b.body("bob", 1.0, com=(0.5, 0.0, 0.0))
        b.joint("pin", mbs.Revolute("y"), "ground", "bob")
        system = b.build()
        mbs.position(system, mbs.State.at(system), "nonesuch")


def test_public_things_stay_what_they_were():
    mac = mbs.vibration.mac
    assert pickle.loads(pickle.dumps(mac)) is mac and mac.__module__.startswith("jaxmbs.vibration")
    assert list(inspect.signature(mac).parameters) == ["first", "second", "M"]
    spring = pickle.loads(pickle.dumps(mbs.SpringDamper(stiffness=3.0)))
    assert float(spring.stiffness) == 3.0

    class Mine(mbs.forces.SpringDamper):
        extra: float = 2.0

    assert Mine(stiffness=1.0, extra=5.0).extra == 5.0
    assert jax.tree.leaves(Mine(stiffness=1.0))


def test_what_takes_anything_takes_text():
    def anything(first: Any, names: Sequence[str]):
        raise AssertionError

    assert argument_faults(anything, ("text", ["a"]), {}) == []
    assert argument_faults(anything, (["text"], "a"), {}) == ["names must be a list, not 'a'"]


@pytest.mark.parametrize(
    "convert",
    [lambda x: jnp.asarray(x), lambda x: np.asarray(x, float), lambda x: np.asarray(x) >= 0, lambda x: int(x)],
)
@pytest.mark.parametrize("value", ["0.x", {"a": "0.x"}, [1.0, "0.x"]])
def test_text_in_what_may_hold_anything_is_named_where_a_conversion_fails(convert, value):
    def anything(first: Any, names: Sequence[str]):
        raise AssertionError

    held = "0.x" if isinstance(value, str) else list(value.values())[0] if isinstance(value, dict) else value[1]
    with pytest.raises((TypeError, ValueError)) as failed:
        convert(held)
    faults = argument_faults(anything, (value, ["a"]), {}, failed.value)
    assert faults == ["first: a number is needed, not the text '0.x'"]
    assert argument_faults(anything, (value, ["a"]), {}, ValueError("another")) == []


def test_an_argument_that_is_none_is_told_from_those_that_are():
    system = simple_pendulum()
    with pytest.raises(TypeError, match="simulate: there is no argument 't': did you mean 'ts' or 't1'"):
        mbs.simulate(system, mbs.State.at(system), t=1.0)
    with pytest.raises(TypeError, match="reactions: there is no argument 'unit'; there are: system, motion"):
        mbs.reactions(system, mbs.State.at(system), unit="N")


ON_THE_HOST = {
    "minimise": lambda x: mbs.minimise(lambda d: (d["a"] - x) ** 2, {"a": 0.3}, progress=False).value,
    "sweep": lambda x: mbs.sweep(lambda d: d["a"] * x, {"a": jnp.arange(3.0)}, progress=False).values,
    "tolerances": lambda x: mbs.design.tolerances(lambda d: d["a"] * x, {"a": 1.0}, {"a": 0.1}),
    "reliability": lambda x: mbs.design.reliability(lambda d: 3.0 * x - d["a"], {"a": Normal(0.0, 1.0)}).index,
}


@pytest.mark.parametrize("name", ON_THE_HOST)
@pytest.mark.parametrize("transform", [jax.jit, mbs.jit, jax.grad], ids=["jit", "mbs.jit", "grad"])
def test_what_computes_on_the_host_says_so_within_a_trace(name, transform):
    with pytest.raises(TypeError, match=f"{name} needs numbers that are known before anything is compiled"):
        transform(ON_THE_HOST[name])(1.5)


def test_a_function_of_the_user_keeps_its_own_error():
    with pytest.raises(TypeError, match="write jnp.sin in place of np.sin"):
        mbs.jit(lambda x: np.asarray(x))(1.5)
