"""Every parameter of every primitive of tapes changes their answer as it changes XLA's, or is refused, or cannot."""

import collections
import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax._src.core import jaxprs_in_params

from jaxmbs.runtime.tape import (
    Tape,
    UnsupportedError,
    _written,  # noqa: F401  (registers the rules)
    is_available,
    machine_kind,
)
from jaxmbs.runtime.tape import _machine as machines
from jaxmbs.runtime.tape._pair_rules import PAIR_RULES
from jaxmbs.runtime.tape._writer import RULES

from .parameters import CASES, ELSEWHERE, REASONS

pytestmark = pytest.mark.skipif(not is_available(), reason="this installation was made without a C compiler")


@pytest.fixture(autouse=True)
def any_types():
    with jax.numpy_rank_promotion("allow"), jax.numpy_dtype_promotion("standard"):
        yield


def test_every_primitive_has_cases():
    assert {*RULES, *PAIR_RULES} == {*CASES, *ELSEWHERE}


@functools.cache
def traced(name):
    return [jax.make_jaxpr(function)(*args) for function, args in CASES[name]]


def bound(jaxpr, name):
    """Parameters of the primitives of a name in a program and in those inside of it, as text."""
    for equation in jaxpr.eqns:
        if equation.primitive.name == name:
            yield {key: str(value) for key, value in equation.params.items()}
        if equation.params.get("name") == name == "signbit":  # a function of JAX that tapes have whole
            yield {}
        for inner in jaxprs_in_params(equation.params):
            yield from bound(inner, name)


def has_reason(name, key):
    return (name, key) in REASONS or ("*", key) in REASONS


@pytest.mark.parametrize("name", sorted(CASES))
def test_the_cases_have_every_parameter(name):
    """Each takes two values at least, or there is a reason why it cannot change an answer."""
    values = collections.defaultdict(set)
    bindings = [list(bound(program.jaxpr, name)) for program in traced(name)]
    assert any(bindings)
    for key, value in (item for each in bindings for params in each for item in params.items()):
        values[key].add(value)
    assert {key for key, found in values.items() if len(found) < 2 and not has_reason(name, key)} == set()


def answers(tape, args):
    """Results of a tape, None where it leaves them to the compiler."""
    try:
        return tape()(*args)
    except UnsupportedError:
        return None


def same(found, want, name):
    """To rounding; infinities, NaN, signs of zero and whole numbers to the bit."""
    for a, b in zip(found, want, strict=True):
        assert (a.shape, a.dtype) == (b.shape, b.dtype)
        scale = np.max(np.abs(b), initial=0.0, where=np.abs(b) < 1e5)
        exact = b.dtype.kind in "biu"
        np.testing.assert_allclose(a, b, rtol=0.0 if exact else 1e-12, atol=0.0 if exact else 1e-14 * scale)
        if b.dtype.kind == "f" and name not in ("fft", "svd", "eigh", "qr", "schur", "householder_product"):
            np.testing.assert_array_equal(np.signbit(a)[b == 0.0], np.signbit(b)[b == 0.0])


@functools.cache
def by_xla(name):
    arguments = [args for _, args in CASES[name]]
    found = jax.jit(lambda every: [f(*args) for (f, _), args in zip(CASES[name], every, strict=True)])(arguments)
    return [[np.asarray(x) for x in jax.tree.leaves(one)] for one in found]


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES))
def test_the_answers_are_those_of_xla(name, monkeypatch):
    """On both machines, and where the arguments are constants, which are folded."""
    for program, (function, args), want in zip(traced(name), CASES[name], by_xla(name), strict=True):
        leaves = [np.asarray(x) for x in jax.tree.leaves(args)]
        constants = jax.tree.map(jnp.asarray, args)
        folded = lambda function=function, args=constants: Tape(jax.make_jaxpr(lambda: function(*args))())
        for kind, tape, given in (("c", None, leaves), ("numpy", None, leaves), ("c", folded, [])):
            monkeypatch.setattr(machines, "ASKED", kind if machine_kind() == "c" else "numpy")
            found = answers(tape or functools.partial(Tape, program), given)
            if found is not None:
                same(found, want, name)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(CASES))
def test_each_parameter_changes_an_answer(name):
    """Of XLA, where two cases differ in it alone: cases that no parameter changes would hold nothing."""
    differ = collections.defaultdict(list)
    cases = list(zip(CASES[name], traced(name), by_xla(name), strict=True))
    for (one, first, answer), (other, second, another) in itertools.combinations(cases, 2):
        if one[1] is not other[1]:
            continue
        params = [next(bound(program.jaxpr, name), {}) for program in (first, second)]
        keys = [key for key in params[0] if params[0][key] != params[1].get(key)]
        if len(keys) == 1:
            differ[keys[0]].append(str(answer) != str(another))
    assert {key for key, found in differ.items() if not any(found) and not has_reason(name, key)} == set()
