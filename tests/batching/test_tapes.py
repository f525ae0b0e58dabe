"""Batches of few designs on tapes: the numbers of the compiled batch, without the compiler."""

import functools
import threading

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.batching import _program as programs
from jaxmbs.runtime import _eager, _jit, _tiers, tuning
from jaxmbs.status import Status
from jaxmbs.studies import sweep

batch = functools.partial(mbs.batch, progress=False)


@pytest.fixture
def compiled(monkeypatch):
    """What is compiled, in a process that leaves the tier to the cost."""
    found = []
    compile_one = programs.BatchedFunction._compile

    def counted(self, *args):
        found.append(args)
        return compile_one(self, *args)

    monkeypatch.setattr(programs.BatchedFunction, "_compile", counted)
    for module in (_tiers, _jit, _eager):
        monkeypatch.setattr(module, "FIXED", "auto")
    return found


def swing(design):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("bob", mass=design["mass"], com=(0.0, 0.0, -1.0), inertia=(0.1, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, pin=design["angle"]), t1=0.2)
    return {"motion": motion, "load": mbs.reactions(system, motion)["pin"].force}


DESIGNS = {"mass": np.linspace(1.0, 2.0, 5), "angle": np.array([0.1, 0.5, np.nan, 1.0, 1.5])}


@pytest.mark.long
def test_few_designs_on_tapes_are_as_compiled(compiled):
    found = batch(swing, DESIGNS)
    assert not compiled
    other = batch(swing, DESIGNS, compile="full")
    assert compiled
    assert np.array_equal(found.status, other.status) and not found.ok[2] and found.ok.sum() == 4
    assert np.array_equal(found.cost, other.cost)
    for one, two in zip(*(jax.tree.leaves(x.values) for x in (found, other)), strict=True):
        assert one.shape == two.shape and one.dtype == two.dtype
        scale = np.max(np.abs(two), initial=1.0, where=np.isfinite(two)) if one.dtype.kind == "f" else 0.0
        np.testing.assert_allclose(one, two, rtol=1e-12, atol=1e-12 * scale)


def square(design):
    return {"y": design["x"] ** 2}


def columns(number):
    return {"x": np.arange(float(number))}


@pytest.mark.parametrize(
    "options, number, compiles",
    [
        ({}, 1, False),
        ({}, tuning.TAPE_DESIGNS, False),
        ({}, tuning.TAPE_DESIGNS + 1, True),
        ({"compile": "tape"}, 7, False),
        ({"compile": "tape"}, tuning.TAPE_DESIGNS + 1, False),
        ({"compile": "quick"}, 7, False),
        ({"compile": "quick"}, 200, True),
        ({"compile": "full"}, 7, True),
        ({"chunk": 4}, 7, True),
        ({"devices": jax.devices()[:1]}, 7, True),
        ({"feasible": lambda design: design["x"] > 2.0}, 7, False),
    ],
)
def test_what_is_compiled(options, number, compiles, compiled):
    found = batch(lambda design: square(design), columns(number), **options)
    asked = np.arange(number) > 2 if "feasible" in options else np.full(number, True)
    assert bool(compiled) == compiles
    assert np.array_equal(found.values["y"][asked], (np.arange(float(number)) ** 2)[asked])
    assert np.array_equal(found.status == Status.INFEASIBLE, ~asked)


def test_operations_that_tapes_do_not_have_are_compiled(compiled):
    found = batch(
        lambda d: {"y": jax.pure_callback(np.sin, jax.ShapeDtypeStruct((), float), d["x"], vmap_method="sequential")},
        columns(3),
    )
    assert compiled and np.array_equal(found.values["y"], np.sin(np.arange(3.0)))


def test_designs_that_take_longer_than_the_compiler_are_compiled(compiled, monkeypatch):
    monkeypatch.setattr(tuning, "COMPILE_START", 0.0)
    monkeypatch.setattr(tuning, "COMPILE_SECONDS", 0.0)
    batch(lambda design: square(design), columns(3))
    assert compiled


def test_a_batch_that_is_asked_again_and_again_is_compiled_beside(compiled, monkeypatch):
    def function(design):
        return square(design)

    batch(function, columns(3))
    assert not compiled
    tape = programs.batched_function(function, columns(3), compile="tape").traced.on_tape(np.float64(1.0))
    tape.tier._left = -1.0
    batch(function, columns(3))
    for thread in threading.enumerate():
        if thread.name == "jaxmbs compiler":
            thread.join()
    assert compiled and tape.tier.is_compiled
    found = batch(function, columns(4))
    assert np.array_equal(found.values["y"], np.arange(4.0) ** 2)


def test_a_study_keeps_its_kind_of_program(compiled):
    few = sweep(square, columns(10), chunk=4, progress=False)
    assert not compiled and np.array_equal(few["y"], np.arange(10.0) ** 2)
    many = sweep(square, columns(130), chunk=50, progress=False)
    assert len(compiled) == 1 and np.array_equal(many["y"], np.arange(130.0) ** 2)


def test_the_first_error_of_a_design_is_raised():
    def failing(design):
        raise RuntimeError("no such design")

    with pytest.raises(RuntimeError, match="no such design"):
        batch(failing, columns(3))


CONSTANT = {
    "a number": lambda: 3.0,
    "an integer": lambda: jnp.asarray(3),
    "an array": lambda: jnp.asarray([1.0, 2.0]),
    "NumPy's": lambda: np.asarray([True, False]),
    "worked out": lambda: jnp.sin(jnp.ones(2)),
}


@pytest.mark.parametrize("what", CONSTANT)
def test_answers_that_do_not_depend_on_the_design(what):
    answers = lambda design: {"before": CONSTANT[what](), "size": 2.0 * design["a"], "z": CONSTANT[what]()}
    designs = {"a": np.arange(3.0)}
    found, full = (mbs.batch(answers, designs, compile=kind, progress=False).values for kind in ("tape", "full"))
    for name, values in full.items():
        np.testing.assert_array_equal(found[name], values)
        assert found[name].dtype == values.dtype
    np.testing.assert_array_equal(found["size"], 2.0 * designs["a"])
