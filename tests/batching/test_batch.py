"""`batch` on functions whose values are known, and on a pendulum of which some designs fail."""

import functools
import subprocess
import sys
import threading
from pathlib import Path

import diffrax
import equinox as eqx
import jax
import numpy as np
import pytest
from jax import numpy as jnp

import jaxmbs as mbs
from jaxmbs.batching import _batch as batches
from jaxmbs.batching import _program as programs
from jaxmbs.batching._result import count_steps, design_status
from jaxmbs.runtime import tuning, working_bytes
from jaxmbs.status import Status
from tests import models

batch = functools.partial(mbs.batch, progress=False)


def area(design):
    return {"area": design["a"] * jnp.sum(design["b"])}


def table(number):
    random = np.random.default_rng(number)
    return {"a": random.normal(size=number), "b": random.normal(size=(number, 2))}


# ------------------------------------------------------------------------------------------------- values and order
@pytest.mark.parametrize("number, chunk", [(1, None), (5, None), (7, 3), (8, 4), (300, None), (2, 16)])
def test_values_in_order(number, chunk):
    designs = table(number)
    found = batch(area, designs, chunk=chunk)
    np.testing.assert_allclose(found.values["area"], designs["a"] * designs["b"].sum(1), rtol=1e-15)
    assert found.ok.shape == (number,) and found.ok.all()
    assert isinstance(found.values["area"], np.ndarray)
    assert f"{number} designs, {number} ok" in found.summary() and "ok" in repr(found)


class Frame:
    """What `batch` asks of a pandas DataFrame."""

    columns = ("a", "b")

    def to_dict(self, orient):
        assert orient == "list"
        return {"a": [1.0, 2.0], "b": [3.0, 4.0]}


@pytest.mark.parametrize(
    "designs",
    [Frame(), [{"a": 1.0, "b": 3.0}, {"a": 2.0, "b": 4.0}], {"a": [1.0, 2.0], "b": jnp.array([3.0, 4.0])}],
    ids=["frame", "rows", "columns"],
)
def test_kinds_of_tables(designs):
    found = batch(lambda d: d["a"] + d["b"], designs)
    np.testing.assert_array_equal(found.values, [4.0, 6.0])


@pytest.mark.parametrize(
    "designs, error, text",
    [
        ({"a": np.ones(3), "b": np.ones(4)}, ValueError, "b has 4 designs, a has 3"),
        ({"a": np.ones(3), "b": 1.0}, ValueError, "b .* needs a leading axis"),
        ({"a": np.ones(0)}, ValueError, "there are no designs"),
        ([], ValueError, "there are no designs"),
        ({}, ValueError, "no variables"),
        ({"a": ["steel", "wood"]}, TypeError, "a is not a column of numbers"),
        ([{"a": 1.0}, {"b": 1.0}], ValueError, "design 1"),
    ],
)
def test_wrong_designs_are_named(designs, error, text):
    with pytest.raises(error, match=text):
        batch(area, designs)


def test_several_chunks_of_one_call(monkeypatch):
    """Cheap functions of many designs: values in order, the rest of a call filled up, infeasible designs left out."""
    monkeypatch.setattr(tuning, "CHUNKS_IN_TURN", 4)
    monkeypatch.setattr(batches, "_num_threads", lambda: 2)
    number = 2 * 2 * 4 * tuning.CHUNK + 37
    designs = table(number)
    found = batch(area, designs, feasible=lambda design: design["a"] < 1.7)
    good = designs["a"] < 1.7
    np.testing.assert_array_equal(np.isfinite(found.values["area"]), good)
    np.testing.assert_array_equal(found.status == Status.INFEASIBLE, ~good)
    expected = jax.vmap(area)({name: column[good] for name, column in designs.items()})
    np.testing.assert_allclose(found.values["area"][good], expected["area"], rtol=1e-14)


def test_wrong_chunk():
    with pytest.raises(ValueError, match="chunk"):
        batch(area, table(3), chunk=0)


# ---------------------------------------------------------------------------------------------------- compiled once
def test_compiled_once(monkeypatch):
    traces = []

    def function(design):
        traces.append(1)
        return area(design)

    compile_one = programs.BatchedFunction._compile
    compiled = []
    monkeypatch.setattr(programs.BatchedFunction, "_compile", lambda *args: compiled.append(1) or compile_one(*args))
    for number in (5, 40, 7):
        batch(function, table(number), chunk=8)
    assert len(traces) == len(compiled) == 1
    for number in (1000, 300):
        batch(function, table(number))
    assert len(traces) == 1 and len(compiled) == 2  # the default chunk is another size


def test_chunk_shrinks_where_memory_is_short(monkeypatch):
    def hungry(design):
        x = jnp.cumsum(jnp.ones(1000) * design["a"])
        return jnp.sort(x)

    monkeypatch.setattr(tuning, "CHUNK_BYTES", 100_000)
    found = programs.batched_function(hungry, {"a": np.ones(256)})
    program, chunk = found.program_within_memory(64)
    assert chunk < 16 and working_bytes(program) <= 100_000
    assert found.program_within_memory(64)[0] is program
    np.testing.assert_allclose(batch(hungry, {"a": np.arange(256.0)}).values[:, -1], 1000 * np.arange(256.0))
    monkeypatch.setattr(tuning, "CHUNK_BYTES", 1)
    assert found.program_within_memory(64)[1] == 1


def test_threads_give_the_same_bits(monkeypatch):
    def function(design):
        return jax.lax.fori_loop(0, 50, lambda _, x: jnp.sin(x) + design["a"], design["b"])

    many = batch(function, table(101), chunk=4).values
    monkeypatch.setattr(batches, "_num_threads", lambda: 1)
    np.testing.assert_array_equal(many, batch(function, table(101), chunk=4).values)


_DEVICES = """
import jax, numpy as np, jaxmbs as mbs
jax.config.update("jax_enable_x64", True)
f = lambda d: jax.lax.while_loop(lambda x: x < 10.0, lambda x: x + d, d)
d = np.linspace(0.1, 3.0, 37)
one = mbs.batch(f, d, progress=False)
assert len(jax.devices()) == 2
two = mbs.batch(f, d, progress=False, devices=jax.devices(), chunk=7)
np.testing.assert_array_equal(one.values, two.values)
np.testing.assert_array_equal(one.values, mbs.batch(f, d, progress=False, devices=jax.devices()).values)
"""


@pytest.mark.long
def test_devices_of_one_host():
    environment = {"XLA_FLAGS": "--xla_force_host_platform_device_count=2", "JAX_PLATFORMS": "cpu"}
    root = Path(__file__).parent.parent.parent
    done = subprocess.run([sys.executable, "-c", _DEVICES], cwd=root, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


# ---------------------------------------------------------------------------------------------- failures and errors
def test_a_design_that_is_not_finite():
    found = batch(lambda d: (jnp.sqrt(d), d), np.array([1.0, -1.0, 4.0]))
    np.testing.assert_array_equal(found.ok, [True, False, True])
    np.testing.assert_array_equal(found.status, [0, Status.NOT_FINITE, 0])
    assert "3 designs, 2 ok" in found.summary() and "not finite" in found.summary()


@pytest.mark.long
def test_status_is_the_worst_of_the_motions():
    def fake(result):
        return eqx.tree_at(lambda m: m.result, _motion(), jnp.asarray(result))

    assert design_status([fake(Status.SUCCESS), fake(Status.MAX_STEPS)]) == Status.MAX_STEPS
    assert design_status([fake(Status.EVENT), jnp.nan]) == Status.EVENT  # unused entries after the event
    assert design_status([fake(Status.SUCCESS), jnp.nan]) == Status.NOT_FINITE
    assert design_status({"name": 3, "none": None}) == Status.SUCCESS
    steps = _motion().diagnostics.num_steps
    assert steps > 0 and count_steps([_motion(), {"again": _motion()}, 7.0]) == 2 * steps


@functools.cache
def _motion():
    system = pendulum(1.0)
    return mbs.simulate(system, mbs.State.at(system, A=1.0), t1=0.1, ts=[0.0, 0.1])


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_an_error_keeps_what_was_computed(error, monkeypatch):
    monkeypatch.setattr(batches, "_num_threads", lambda: 1)
    running = programs.BatchedFunction.program
    calls = []

    def program(self, chunk, devices=(), turns=1):
        inner = running(self, chunk, devices, turns)

        def call(*columns):
            calls.append(1)
            if len(calls) == 3:
                raise error("boom")
            return inner(*columns)

        return call

    monkeypatch.setattr(programs.BatchedFunction, "program", program)
    with pytest.raises(mbs.BatchError, match="boom") as caught:
        batch(area, {"a": np.arange(10.0), "b": np.ones((10, 1))}, chunk=2)
    found = caught.value.batch
    assert isinstance(caught.value.__cause__, error)
    np.testing.assert_array_equal(found.values["area"][:4], np.arange(4.0))
    assert np.isnan(found.values["area"][4:6]).all()
    assert found.ok[:4].all() and (found.status[4:6] == Status.NOT_RUN).all() and "not run" in found.summary()


def test_progress_says_how_many_and_how_fast(capsys):
    mbs.batch(area, table(9), chunk=3)
    shown = capsys.readouterr().err
    assert "compiling" in shown and "designs/s" in shown and "9/9" in shown


def test_runs_in_another_thread():
    found = []
    thread = threading.Thread(target=lambda: found.append(batch(area, table(4))))
    thread.start()
    thread.join()
    assert found[0].ok.all()


# ------------------------------------------------------------------------------------- infeasible and dear designs
def countdown(design):
    """A loop as long as the design is dear."""
    return jax.lax.while_loop(lambda x: x[0] < design["n"], lambda x: (x[0] + 1, x[1] + jnp.sin(x[1])), (0.0, 0.1))


def test_designs_of_like_cost_share_a_chunk():
    random = np.random.default_rng(3)
    designs = {"n": random.integers(1, 100, 1500).astype(float), "other": random.normal(size=1500)}
    plain = batch(countdown, designs, chunk=8)
    grouped = batch(countdown, designs, chunk=8, cost=lambda values: values[0])
    np.testing.assert_array_equal(grouped.values[1], plain.values[1])
    np.testing.assert_array_equal(grouped.cost, designs["n"])
    assert plain.computed == 0.0  # nothing that it returned is known to be work
    blind = 8 * designs["n"][: 8 * (1500 // 8)].reshape(-1, 8).max(axis=1).sum()
    assert grouped.computed < 1.15 * designs["n"].sum() < 0.7 * blind
    assert f"computed / needed {grouped.computed / designs['n'].sum():.2f}" in grouped.summary()


def test_infeasible_designs_take_no_lane():
    designs = table(50)
    seen = []
    found = batch(
        lambda d: jax.debug.callback(seen.append, d["a"]) or area(d), designs, feasible=lambda d: d["a"] > 0.5
    )
    jax.effects_barrier()
    good = np.asarray(designs["a"]) > 0.5
    assert 0 < good.sum() < 50 and min(seen) > 0.5
    np.testing.assert_array_equal(found.ok, good)
    np.testing.assert_array_equal(found.status == Status.INFEASIBLE, ~good)
    np.testing.assert_array_equal(np.isnan(found.values["area"]), ~good)
    assert "refused by `feasible`" in found.summary()
    none = batch(area, designs, feasible=lambda d: d["a"] > 1e9)
    assert (none.status == Status.INFEASIBLE).all()


def test_infeasible_designs_differentiate_to_nan():
    def total(designs):
        found = batch(lambda d: d["a"] ** 2, designs, feasible=lambda d: d["a"] > 1.5)
        return jnp.sum(found.values), found.ok

    slope, ok = jax.grad(total, has_aux=True)({"a": jnp.arange(4.0)})
    np.testing.assert_array_equal(ok, [False, False, True, True])
    np.testing.assert_array_equal(slope["a"], [np.nan, np.nan, 4.0, 6.0])


# --------------------------------------------------------------------------------------------------------- gradients
def test_values_and_slopes():
    slopes = jax.value_and_grad(lambda d: d["a"] ** 3)
    value, slope = batch(slopes, {"a": np.arange(20.0)}).values
    np.testing.assert_allclose(value, np.arange(20.0) ** 3)
    np.testing.assert_allclose(slope["a"], 3 * np.arange(20.0) ** 2)


@pytest.mark.parametrize("chunk", [None, 3])
@pytest.mark.parametrize("jit", [False, True])
def test_gradient_through_a_batch(jit, chunk):
    def total(designs, factor):
        found = batch(lambda d: factor * jnp.sin(d["a"]) * d["b"], designs, chunk=chunk)
        return jnp.sum(jnp.where(found.ok[:, None], found.values, 0.0))

    gradient = jax.grad(total, argnums=(0, 1))
    designs = table(8)
    slope, by_factor = (jax.jit(gradient) if jit else gradient)(designs, 2.0)
    np.testing.assert_allclose(slope["a"], 2 * np.cos(designs["a"]) * designs["b"].sum(1), rtol=1e-12)
    np.testing.assert_allclose(slope["b"], 2 * np.sin(designs["a"])[:, None] * np.ones((1, 2)), rtol=1e-12)
    np.testing.assert_allclose(by_factor, np.sum(np.sin(designs["a"])[:, None] * designs["b"]), rtol=1e-12)


def test_gradient_through_closed_over_numbers_only():
    designs = table(5)
    slope = jax.grad(lambda k: jnp.sum(batch(lambda d: k * d["a"], designs).values))(2.0)
    np.testing.assert_allclose(slope, designs["a"].sum())


# --------------------------------------------------------------------------------------------------------- mechanism
def pendulum(length, like=None):
    return models.pendulum((length, 0.0, 0.0), pin="A", like=like)


def swing(length):
    """Angle after a quarter second, and the motion."""
    system = pendulum(length, like=pendulum(1.0))
    motion = mbs.simulate(system, mbs.State.at(system, A=1.0), ts=[0.0, 0.25], dt=0.05, solver=diffrax.Tsit5())
    return motion.states.coordinates[-1, 0], motion


@pytest.mark.long
def test_a_batch_of_motions_and_its_gradient():
    lengths = np.array([0.5, 1.0, np.nan, 2.0])
    found = batch(swing, lengths, chunk=4)
    np.testing.assert_array_equal(found.ok, [True, True, False, True])
    good = lengths[found.ok]
    total = jax.jit(jax.value_and_grad(lambda x: jnp.sum(batch(lambda l: swing(l)[0], x, chunk=4).values)))
    (value, slope), h = total(good), 1e-4
    rise = [(total(good + h * e)[0] - total(good - h * e)[0]) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(slope, rise, rtol=1e-6)
    np.testing.assert_allclose(np.sum(found.values[0][found.ok]), value, rtol=1e-12)


def test_programs_of_the_functions_asked_last_are_kept():
    """They hold their functions: of a loop that asks a new one each time the first ones go."""
    programs._CACHE.clear()
    for _ in range(tuning.BATCHED_FUNCTIONS + 3):
        batch(lambda x: x + 1.0, np.ones(2))
    assert len(programs._CACHE) == tuning.BATCHED_FUNCTIONS
