"""`minimise` from many first designs at once."""

import functools
import threading

import jax
import numpy as np
import optax
import pytest
from jax import numpy as jnp

from jaxmbs.design import Limit
from jaxmbs.design import _multistart as meeting
from jaxmbs.design import minimise as minimise_with_bar
from tests.marks import cases

minimise = functools.partial(minimise_with_bar, progress=False)
OPTIMISERS = [None, optax.adam(0.05)]


def two_wells(design):
    """Minima near x = -1 (value about -0.2) and x = 1 (about 0.2); no value below x = -2."""
    x, y = design["x"], design["y"]
    return (x**2 - 1.0) ** 2 + 0.2 * x + jnp.sum(y**2) + 0.0 * jnp.sqrt(x + 2.0)


def first(x):
    return {"x": np.array(x), "y": np.tile([0.3, -0.2], (len(x), 1))}


@pytest.mark.parametrize("optimiser", cases(OPTIMISERS, long=OPTIMISERS[1:]))
def test_the_best_start_wins_and_all_are_kept(optimiser):
    best = minimise(two_wells, first([1.1, -0.5, 0.9]), optimiser=optimiser, steps=400, starts="stacked")
    assert best.design["x"] == pytest.approx(-1.0241, abs=1e-3) and best.design["y"].shape == (2,)
    assert [round(float(found.design["x"]), 1) for found in best.starts] == [1.0, -1.0, 1.0]
    assert best.value == best.starts[1].value == min(found.value for found in best.starts)
    assert best.initial_design["x"] == -0.5
    lines = best.starts_table().splitlines()
    assert len(lines) == 4 and "best" in lines[2] and "best" not in lines[1]


@pytest.mark.parametrize("optimiser", OPTIMISERS)
def test_each_start_goes_as_it_would_alone(optimiser):
    designs = first([1.5, -0.5])
    together = minimise(two_wells, designs, {"x": (-1.5, 2.0), "y": None}, optimiser, steps=20, starts="stacked")
    for k, found in enumerate(together.starts):
        one = jax.tree.map(lambda leaf, k=k: leaf[k], designs)
        alone = minimise(two_wells, one, {"x": (-1.5, 2.0), "y": None}, optimiser, steps=20)
        np.testing.assert_allclose(found.history.values, alone.history.values, rtol=1e-9)
        assert found.reason == alone.reason


@pytest.mark.parametrize("optimiser", cases(OPTIMISERS, long=OPTIMISERS[1:]))
def test_impossible_starts_are_left_out(optimiser):
    best = minimise(two_wells, first([-3.0, 0.5, -0.5]), optimiser=optimiser, steps=300, starts="stacked")
    assert best.design["x"] == pytest.approx(-1.0241, abs=1e-2)
    assert np.isnan(best.starts[0].value) and best.starts[0].reason.startswith("no search can start")
    assert all(np.isfinite(found.history.values).all() for found in best.starts[1:])
    with pytest.raises(ValueError, match="any of the 2 first designs"):
        minimise(two_wells, first([-3.0, -4.0]), optimiser=optimiser, starts="stacked")


def test_steps_into_a_region_without_values_are_halved_for_that_start_alone():
    jump = optax.sgd(1.2)  # from 0.9 it leads below zero
    best = minimise(lambda x: x - 0.1 * jnp.log(x), np.array([0.9, 0.11]), optimiser=jump, steps=3, starts="stacked")
    assert np.isfinite(best.starts[0].history.values).all() and len(best.starts[0].history.values) == 4


@pytest.mark.parametrize("optimiser", [None, optax.sgd(0.1)])
def test_all_starts_are_one_compiled_program(optimiser):
    traced = []

    def objective(x):
        traced.append(1)
        return jnp.sum((x - 1.0) ** 2)

    minimise(objective, np.zeros((5, 2)), optimiser=optimiser, steps=10, starts="stacked")
    assert len(traced) <= 3


@pytest.mark.parametrize("number", [3, 4, 5])
def test_a_leaf_as_long_as_there_are_starts_is_one_design(number):
    """Whatever the lengths of the leaves: designs are stacked where the user says so."""
    design, bounds = {"x": np.zeros(4), "y": 1.0}, {"x": (-5.0, 5.0), "y": (-1.0, 2.0)}
    distance = lambda d: jnp.sum((d["x"] - jnp.arange(4.0)) ** 2) + d["y"] ** 2
    best = minimise(distance, design, bounds, starts=number)
    assert len(best.starts) == number and best.value < 1e-9
    np.testing.assert_allclose(best.design["x"], np.arange(4.0), atol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("optimiser", ["SLSQP", "trust-constr", "interior point"])
def test_searches_with_limits_side_by_side(optimiser):
    """Each as it would alone, though one ends long before the others."""
    inside = Limit("distance", lambda d: d["x"] ** 2 + jnp.sum(d["y"] ** 2), upper=0.5)
    designs, steps = first([0.9, -0.5, 0.70710678]), 60
    together = minimise(two_wells, designs, None, optimiser, steps, starts="stacked", limits=[inside])
    for k, found in enumerate(together.starts):
        one = jax.tree.map(lambda leaf, k=k: leaf[k], designs)
        alone = minimise(two_wells, one, None, optimiser, steps, limits=[inside])
        np.testing.assert_allclose(found.design["x"], alone.design["x"], rtol=1e-6)
        assert found.reason == alone.reason and found.limits[0].ok
    assert together.design["x"] == pytest.approx(-np.sqrt(0.5), abs=1e-4)


def test_an_error_in_one_search_ends_all():
    """Of the user's callback, in the thread of a search; nothing waits for ever."""

    def callback(step, design, value):
        if step == 2:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        minimise(two_wells, first([1.5, -0.5, 0.4]), starts="stacked", callback=callback)
    assert threading.active_count() < 10


def test_an_error_of_the_batch_ends_all(monkeypatch):
    def fails(*args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr(meeting, "batch", fails)
    with pytest.raises(KeyboardInterrupt):
        minimise(two_wells, first([1.5, -0.5, 0.4]), starts="stacked")


@pytest.mark.parametrize(
    ("design", "starts", "message"),
    [
        (first([1.0, 2.0]), 3, r"both bounds of every variable: y\[0,0\].*say starts='stacked'"),
        ({"x": 1.0, "y": np.zeros((1, 2))}, "stacked", r"x has shape \(\): 1 stacked starts need"),
        ({"x": 1.0, "y": 2.0}, "stacked", r"x has shape \(\)"),
        ({"x": np.zeros(0), "y": np.zeros((0, 2))}, "stacked", "axis is empty"),
        (first([1.0, 9.0]), "stacked", "start 1: x: 9 lies outside"),
        (first([1.0]), 0, "starts must be a positive whole number"),
        (first([1.0]), "many", "'many'"),
    ],
)
def test_faults(design, starts, message):
    with pytest.raises(ValueError, match=message):
        minimise(two_wells, design, {"x": (-2.0, 3.0), "y": None}, starts=starts)
