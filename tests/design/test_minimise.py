"""`minimise` on functions whose minima are known."""

import functools
import pickle

import jax
import numpy as np
import optax
import pytest
from jax import numpy as jnp

from jaxmbs.design import Limit, SearchError
from jaxmbs.design import minimise as minimise_with_bar

minimise = functools.partial(minimise_with_bar, progress=False)
LONG_FIRST_STEP = optax.sgd(optax.piecewise_constant_schedule(2.0, {1: 0.025}))
QUADRATIC_BOUNDS = {"stiffness": (0.0, 2.0), "sides": (np.array([-1.0, 0.5]), None)}


def rosenbrock(design):
    x, y = design["x"], design["y"]
    return (1.0 - x) ** 2 + 100.0 * (y - x**2) ** 2


def quadratic(design):
    """Minimum at stiffness 3, sides (-0.5, -1); within the bounds at 2, (-0.5, 0.5)."""
    sides = design["sides"] - jnp.array([-0.5, -1.0])
    return (design["stiffness"] - 3.0) ** 2 + jnp.sum(sides**2) + 1.0


def start():
    return {"stiffness": 1.0, "sides": np.array([0.0, 4.0])}


@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_rosenbrock(gradient):
    best = minimise(rosenbrock, {"x": -1.2, "y": 1}, gradient=gradient)
    assert best.ok
    np.testing.assert_allclose([best.design["x"], best.design["y"]], [1.0, 1.0], atol=1e-4)
    assert best.initial_value == pytest.approx(24.2)
    assert best.value == best.history.values.min() < 1e-9
    assert best.history.evaluations[-1] >= len(best.history.values) > 10


@pytest.mark.parametrize(
    ("optimiser", "steps"),
    [
        (None, 50),
        ("L-BFGS-B", 50),
        (optax.adam(0.1), 600),
        (optax.sgd(0.2), 200),
        pytest.param(optax.lbfgs(), 50, marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_active_bounds(optimiser, steps, gradient):
    best = minimise(quadratic, start(), QUADRATIC_BOUNDS, optimiser, steps=steps, gradient=gradient)
    assert best.ok
    assert jax.tree.structure(best.design) == jax.tree.structure(start())
    assert best.design["stiffness"] == 2.0
    assert best.design["sides"][1] == 0.5
    np.testing.assert_allclose(best.design["sides"][0], -0.5, atol=1e-6)
    assert best.value == pytest.approx(1.0 + 1.0 + 2.25, abs=1e-9)
    assert best.history.gradient_norms[-1] < 1e-6


def test_table_shows_bounds_that_are_active():
    table = minimise(quadratic, start(), QUADRATIC_BOUNDS).table()
    rows = {line.split()[0]: line for line in table.splitlines()}
    assert list(rows) == ["variable", "sides[0]", "sides[1]", "stiffness", "objective"]
    assert rows["stiffness"].split()[1:] == ["1", "2", "0", "2", "at", "upper"]
    assert rows["sides[1]"].endswith("inf  at lower")
    assert "at" not in rows["sides[0]"].split()
    assert rows["objective"].endswith("converged")


def test_search_does_not_depend_on_units():
    values = [
        minimise(lambda d, s=s: s * quadratic({"stiffness": d["stiffness"] / s, "sides": d["sides"]}),
                 {"stiffness": 1.0 * s, "sides": np.array([0.0, 4.0])},
                 {"stiffness": (0.0, 2.0 * s), "sides": (-1.0, 5.0)}).history.values / s
        for s in (1.0, 1e9, 1e-9)
    ]  # fmt: skip
    assert values[0][-1] == pytest.approx(2.0, rel=1e-9)
    np.testing.assert_allclose(values[1], values[0], rtol=1e-9)
    np.testing.assert_allclose(values[2], values[0], rtol=1e-9)


@pytest.mark.parametrize(("optimiser", "steps"), [(None, 60), (LONG_FIRST_STEP, 200), (optax.adam(0.5), 400)])
def test_region_without_values_is_avoided(optimiser, steps):
    """log needs x > 0; first steps of these optimisers lead beyond it."""
    trials = []

    def objective(x):
        value = x - 0.1 * jnp.log(x)
        jax.debug.callback(lambda v: trials.append(float(v)), value)
        return value

    best = minimise(objective, 0.9, optimiser=optimiser, steps=steps)
    jax.effects_barrier()
    assert best.design == pytest.approx(0.1, rel=1e-3)
    assert not np.all(np.isfinite(trials))
    assert np.all(np.isfinite(best.history.values))


@pytest.mark.parametrize("optimiser", [None, optax.sgd(0.1)])
def test_best_design_survives_a_region_without_gradients(optimiser):
    """Below 1 the objective is finite and lower, but its gradient is not."""

    def objective(x):
        return jnp.where(x < 1.0, jnp.sqrt(x - 1.0) * 0.0, x**2)

    best = minimise(objective, 3.0, optimiser=optimiser, steps=500)
    assert best.reason in ("non-finite", "no further descent", "step limit", "converged")
    assert 1.0 <= float(best.design) < 1.01
    assert best.value == pytest.approx(float(best.design) ** 2)


def test_bare_number_and_array_designs():
    assert minimise(lambda x: (x - 2.0) ** 2, 5.0, (3.0, None)).design == 3.0
    best = minimise(lambda x: jnp.sum((x - jnp.arange(4.0)) ** 2), np.zeros(4), (None, 2.0))
    np.testing.assert_allclose(best.design, [0, 1, 2, 2], atol=1e-9)


def test_starting_at_the_minimum_is_converged():
    best = minimise(rosenbrock, {"x": 1.0, "y": 1.0})
    assert (best.reason, len(best.history.values)) == ("converged", 1)


@pytest.mark.parametrize("optimiser", [None, optax.adam(0.1)])
def test_steps_and_callback_stop_the_search(optimiser):
    best = minimise(rosenbrock, {"x": -1.2, "y": 1.0}, optimiser=optimiser, steps=3)
    assert (best.reason, len(best.history.values)) == ("step limit", 4)
    seen = []
    stop = minimise(
        rosenbrock, {"x": -1.2, "y": 1.0}, optimiser=optimiser,
        callback=lambda step, design, value: seen.append((step, float(design["x"]), value)) or step == 2,
    )  # fmt: skip
    assert stop.reason == "stopped by callback"
    assert [step for step, _, _ in seen] == [1, 2]
    assert [value for _, _, value in seen] == list(stop.history.values[1:])


def test_progress_bar(capsys):
    minimise_with_bar(rosenbrock, {"x": 0.0, "y": 0.0}, steps=2)
    assert "minimise" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"bounds": {"x": (0.0, 1.0), "y": None}}, ValueError, "x: -1.2 lies outside its bounds"),
        ({"bounds": {"x": (1.0, 0.0), "y": None}}, ValueError, "x: the bounds cross"),
        ({"bounds": {"x": (0.0, 1.0)}}, ValueError, "structure of design0.*: y is missing$"),
        ({"bounds": {"x": None, "why": None}}, ValueError, "no variable 'why'.*; y is missing$"),
        ({"bounds": [(0.0, 1.0), None]}, ValueError, "structure of design0"),
        ({"bounds": {"x": 1.0, "y": None}}, ValueError, "x: bounds must be"),
        ({"bounds": {"x": (np.zeros(2), None), "y": None}}, ValueError, "x: bounds .* do not fit"),
        ({"design0": {"x": "long", "y": 1.0}}, TypeError, "x is not a number"),
        ({"design0": {}}, ValueError, "no variables"),
        ({"objective": lambda d: jnp.stack([d["x"], d["y"]])}, ValueError, "real scalar.* an array of 2 numbers"),
        ({"objective": lambda d: d}, ValueError, "real scalar.* of the type dict"),
        ({"objective": lambda d: jnp.sqrt(d["x"]) + d["y"]}, ValueError, "nan, its gradient .* for x$"),
        ({"optimiser": "Newton"}, ValueError, "unknown optimiser 'Newton'"),
        ({"optimiser": 3}, TypeError, "optimiser"),
        ({"gradient": "central"}, ValueError, "'central'"),
    ],
)
def test_faults(change, error, message):
    arguments = {"objective": rosenbrock, "design0": {"x": -1.2, "y": 1.0}} | change
    with pytest.raises(error, match=message):
        minimise(**arguments)


@pytest.mark.parametrize("optimiser", [None, "SLSQP", "trust-constr", optax.sgd(1e9)])
@pytest.mark.parametrize("objective", [lambda d: d["x"], lambda d: -(d["x"] ** 2), lambda d: d["x"] + d["y"] ** 2])
def test_an_objective_that_falls_without_end(objective, optimiser):
    best = minimise(objective, {"x": -1.0, "y": 2.0}, {"x": (None, 3.0), "y": (0.0, 4.0)}, optimiser)
    assert not best.ok
    assert best.reason.startswith("unbounded: the objective falls without end along x;") or best.value > -1e11


def test_a_minimum_far_from_the_start_is_one():
    """A variable that has grown a million times has not run away."""
    best = minimise(lambda x: (x - 1e6) ** 2, 1.0)
    assert best.ok and best.design == pytest.approx(1e6)


@pytest.mark.parametrize("optimiser", ["SLSQP", "trust-constr"])
def test_optimisers_that_know_limits_need_none(optimiser):
    best = minimise(quadratic, start(), QUADRATIC_BOUNDS, optimiser, steps=300)
    assert best.value == pytest.approx(4.25, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"steps": -1}, "steps must be"),
        ({"tolerance": np.nan}, "tolerance"),
        ({"tolerance": -1.0}, "tolerance"),
    ],
)
def test_options_out_of_range(options, message):
    with pytest.raises(ValueError, match=message):
        minimise(rosenbrock, {"x": -1.2, "y": 1.0}, **options)


def test_a_design_of_empty_arrays():
    with pytest.raises(ValueError, match="no variables"):
        minimise(lambda x: jnp.sum(x), np.zeros(0))


@pytest.mark.parametrize("limits", [(), (Limit("y", lambda d: d["x"], upper=9.0),)])
def test_an_interrupted_search_keeps_its_best_design(limits):
    """Ctrl-C, or the stop button of a notebook, in the third step."""

    def callback(step, design, value):
        if step == 3:
            raise KeyboardInterrupt

    start = {"x": -1.2, "y": 1.0}
    with pytest.raises(SearchError, match="interrupted after 3 steps") as caught:
        minimise(rosenbrock, start, limits=limits, callback=callback)
    best = caught.value.optimum
    assert not best.ok and best.reason == "interrupted" and len(best.history.values) == 4
    assert best.value <= min(best.history.values) < rosenbrock(start)
    np.testing.assert_allclose(rosenbrock(best.design), best.value)
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.optimum.value == best.value
