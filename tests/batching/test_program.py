"""`compile="quick"` of the questions of design: it reaches the compiler, and the answers stay."""

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

import jaxmbs as mbs
from jaxmbs.design import pareto, propagate_uncertainty, sensitivities, tolerances
from jaxmbs.runtime import _batch_program as batch_program
from jaxmbs.runtime import _jit as compiling
from jaxmbs.runtime import without_tricks
from tests.marks import cases

DESIGN, BOX = {"a": 1.0, "b": 2.0}, {"a": (0.1, 3.0), "b": (0.1, 3.0)}


def bowl(design):
    return (design["a"] - 0.5) ** 2 + jnp.exp(design["b"]) / design["b"]


def slope(design):
    return (design["a"] - 1.5) ** 2 + design["b"] ** 2


def rows(number):
    return {"a": np.linspace(0.2, 2.0, number), "b": np.linspace(0.5, 1.5, number)}


QUESTIONS = {
    "batch": lambda kind: mbs.batch(lambda d: bowl(d), rows(5), progress=False, compile=kind).values,
    "sweep": lambda kind: mbs.sweep(lambda d: {"x": bowl(d)}, rows(5), progress=False, compile=kind)["x"].values,
    "L-BFGS-B": lambda kind: mbs.minimise(bowl, DESIGN, BOX, progress=False, compile=kind).design,
    "SLSQP": lambda kind: (
        mbs.minimise(
            bowl, DESIGN, BOX, limits=[mbs.Limit("a", slope, upper=2.0)], progress=False, compile=kind
        ).design
    ),
    "optax": lambda kind: (
        mbs.minimise(bowl, rows(3), BOX, optax.adam(0.1), 5, starts="stacked", progress=False, compile=kind).design
    ),
    "pareto": lambda kind: pareto(bowl, slope, DESIGN, BOX, 3, progress=False, compile=kind).designs,
    "first order": lambda kind: propagate_uncertainty(bowl, DESIGN, {"a": 0.1, "b": 0.2}, compile=kind).deviation,
    "samples": lambda kind: (
        propagate_uncertainty(bowl, DESIGN, {"a": 0.1, "b": 0.2}, samples=16, compile=kind).deviation
    ),
    "tolerances": lambda kind: [one.change for one in tolerances(bowl, DESIGN, DESIGN, compile=kind)],
    "sensitivities": lambda kind: sensitivities(bowl, BOX, samples=16, compile=kind),
}


@pytest.fixture
def kinds(monkeypatch):
    """The kinds that the compiler was asked for."""
    asked, before = set(), compiling.compiler_options

    def options(kind, backend, *often, **named):
        asked.add(kind)
        return before(kind, backend, *often, **named)

    for module in (compiling, batch_program):
        monkeypatch.setattr(module, "compiler_options", options)
    return asked


@pytest.mark.parametrize("name", cases(QUESTIONS, long=["pareto"]))
def test_both_kinds_give_the_same_answer(name, kinds):
    question = QUESTIONS[name]
    with without_tricks("tape"):
        found = question("quick")
    # the small program of one search is optimised, since it runs dozens of times
    is_search = name in ("L-BFGS-B", "SLSQP")
    assert kinds == ({"quick", "full"} if is_search else {"quick"})
    again = question("full")
    assert kinds == {"quick", "full"}
    for by_tape in (question("auto"), question("tape"), found):
        for one, other in zip(_leaves(by_tape), _leaves(again), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-5)


def _leaves(found):
    return list(found.values()) if isinstance(found, dict) else [found]


@pytest.mark.parametrize("question", QUESTIONS.values(), ids=QUESTIONS)
def test_another_kind_is_refused(question):
    with pytest.raises(ValueError, match="'auto', 'tape', 'quick' or 'full', got 'fast'"):
        question("fast")


def counted(design):
    """Halvings of a number down to one: a loop that ends by a condition, as a motion's does."""
    return jax.lax.while_loop(lambda c: c[0] > 1.0, lambda c: (0.5 * c[0], c[1] + 1), (design["a"], 0))[1]


@pytest.mark.parametrize("function, level", [(bowl, True), (counted, False)], ids=["evaluation", "motion"])
def test_a_batch_of_what_is_no_motion_compiles_at_the_highest_level(function, level, monkeypatch):
    asked = []
    monkeypatch.setattr(batch_program, "compiler_options", lambda kind, backend, often: asked.append(often) or {})
    mbs.batch(lambda d: function(d), rows(5), progress=False, compile="full")
    assert asked == [level]
