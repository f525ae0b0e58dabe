"""`minimise` with limits, on optima that are known: in closed form, and published trusses of ten bars."""

import functools
import sys
from types import SimpleNamespace
from unittest.mock import Mock

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tqdm import tqdm

import jaxmbs as mbs
from jaxmbs.design import minimise as minimise_with_bar
from jaxmbs.design._constrained import run_constrained
from jaxmbs.design._problem import trace_problem
from jaxmbs.design._variables import read_variables
from jaxmbs.design._working_set import ConstrainedSearch

minimise = functools.partial(minimise_with_bar, progress=False)


def sides(design):
    return jnp.array([design["x"], design["y"]])


CIRCLE = mbs.Limit("radius", lambda d: jnp.sum(sides(d) ** 2), upper=2.0)
TALL = mbs.Limit("height", lambda d: d["y"], lower=1.2, scale=1.0)


def sum_of(design):
    return -design["x"] - 2.0 * design["y"]


@pytest.mark.parametrize(
    ("optimiser", "gradient"),
    [(None, "reverse"), (None, "forward"), pytest.param("trust-constr", "forward", marks=pytest.mark.long)],
)
def test_a_line_over_a_circle(optimiser, gradient):
    """-x - 2 y in x^2 + y^2 <= 2 is least at sqrt(2/5) (1, 2), and falls by sqrt(5/8) per unit of the limit."""
    best = minimise(sum_of, {"x": 0.1, "y": 0.3}, None, optimiser, limits=[CIRCLE], gradient=gradient, steps=800)
    assert best.ok, best.reason
    np.testing.assert_allclose([best.design["x"], best.design["y"]], np.sqrt(0.4) * np.array([1, 2]), rtol=1e-5)
    (radius,) = best.limits
    assert radius.active and radius.ok and abs(radius.margin) < 1e-6 and best.limit("radius") is radius
    assert radius.price == pytest.approx(-np.sqrt(5 / 8), rel=1e-4)
    assert best.kkt < 1e-5
    assert "active" in best.table() and "<= 2" in best.table()
    with pytest.raises(mbs.UnknownNameError, match="did you mean 'radius'"):
        best.limit("radios")


def test_a_limit_that_is_not_active_has_no_price():
    easy = mbs.Limit("height", lambda d: d["y"], lower=1.0)
    best = minimise(sum_of, {"x": 0.1, "y": 0.3}, limits=[CIRCLE, easy])
    assert best.ok and not best.limit("height").active and best.limit("height").price == 0.0
    assert best.limit("height").margin == pytest.approx(np.sqrt(1.6) - 1.0, rel=1e-5)


@pytest.mark.long
def test_forward_derivatives_take_all_constraints_from_the_start():
    """A hundred tangents of the circle: reverse mode begins with some, forward mode has them for nothing."""
    angle = np.linspace(0.0, np.pi / 2, 100)
    lines = mbs.Limit("tangents", lambda d: jnp.cos(angle) * d["x"] + jnp.sin(angle) * d["y"], upper=np.sqrt(2.0))
    sizes = {}
    for gradient in ("reverse", "forward"):
        variables = read_variables({"x": 0.1, "y": 0.3}, None)
        problem = trace_problem(sum_of, variables, gradient, [lines])
        search = ConstrainedSearch(problem, problem.evaluate, variables, 1e-8, None, tqdm(disable=True))
        sizes[gradient] = len(search.working_set)
    assert sizes == {"reverse": 24, "forward": 100}


def test_bounds_have_prices_too():
    best = minimise(sum_of, {"x": 0.1, "y": 0.3}, {"x": (0.0, 0.5), "y": None}, limits=[CIRCLE])
    y = np.sqrt(1.75)
    assert best.ok and best.design["x"] == 0.5 and best.design["y"] == pytest.approx(y, rel=1e-6)
    assert best.limits[0].price == pytest.approx(-1.0 / y, rel=1e-4)
    assert best.bound_prices[0] == pytest.approx(-1.0 + 1.0 / y, rel=1e-4)  # of x, along the circle
    assert best.bound_prices[1] == 0.0


@pytest.mark.long
def test_no_design_keeps_all_limits():
    """Within the circle of radius sqrt(2), y >= 1.6 is missed; the result lies between, and says by how much."""
    wide = mbs.Limit("height", lambda d: d["y"], lower=1.6)
    best = minimise(sum_of, {"x": 0.1, "y": 0.3}, limits=[CIRCLE, wide], steps=200)
    assert not best.ok and best.reason.startswith("no design found that satisfies all limits: ")
    assert "'height' by" in best.reason and "'radius' by" in best.reason
    missed = -min(limit.margin for limit in best.limits)
    y = 1.6 * (1 - missed)
    assert y**2 == pytest.approx(2.0 * (1 + missed), rel=1e-3)  # both are missed alike, at x = 0
    assert "violated" in best.table()


def test_an_infeasible_start_comes_home():
    best = minimise(sum_of, {"x": 4.0, "y": -5.0}, limits=[CIRCLE, TALL])
    assert best.ok and best.value == pytest.approx(-np.sqrt(10.0), rel=1e-6)


def test_answers_of_the_objective_serve_the_limits():
    calls = []

    def both(design):
        calls.append(1)
        return sum_of(design), {"radius": jnp.sum(sides(design) ** 2)}

    limit = mbs.Limit("circle", "radius", upper=2.0)
    best = minimise(both, {"x": 0.1, "y": 0.3}, limits=[limit])
    assert best.ok and best.value == pytest.approx(-np.sqrt(10.0), rel=1e-6)
    assert len(calls) == 1  # shapes, values and gradients come from one trace
    assert minimise(lambda d: (jnp.sum(sides(d) ** 2), {}), {"x": 0.1, "y": 0.3}).value < 1e-9


def rod_over_a_turn(design):
    """Slider-crank of the published case: mass of the rod, pin force and compression at every degree of the crank."""
    length, diameter = design["length"], design["diameter"]
    radius, slider, rate, pull = 0.05, 1.2, 300.0, 1500.0
    area = jnp.pi * diameter**2 / 4.0
    mass = 7850.0 * area * length
    angle = jnp.asarray(np.radians(np.arange(360.0)))

    def place(t):
        """Of the slider, and the angle of the rod."""
        lean = jnp.arcsin(radius / length * jnp.sin(angle + rate * t))
        return radius * jnp.cos(angle + rate * t) + length * jnp.cos(lean), lean

    def twice(f):
        velocity = lambda t: jax.jvp(f, (t,), (jnp.ones_like(t),))[1]
        return jax.jvp(velocity, (0.0 * length,), (jnp.ones_like(length),))[1]

    lean = place(0.0)[1]
    along = slider * twice(lambda t: place(t)[0]) - pull  # force of the rod on the slider, along its way
    centre = twice(lambda t: place(t)[0] - length / 2.0 * jnp.cos(place(t)[1]))
    lift = twice(lambda t: length / 2.0 * jnp.sin(place(t)[1]))
    turn = twice(lambda t: -place(t)[1])
    # moments about the crank pin give the force across
    c, s = jnp.cos(lean), jnp.sin(lean)
    moment = mass * length**2 / 12.0 * turn + mass * length / 2.0 * (c * lift + s * centre)
    across = (-along * s * length - moment) / (length * c)
    force = jnp.sqrt(along**2 + across**2)
    press = along * c - across * s
    buckling = 5.0 * press / (jnp.pi**3 * 210e9 * diameter**4 / 64.0 / length**2)
    return mass, {"pin": force, "buckling": buckling}


PIN = mbs.Limit("wrist pin", "pin", upper=8000.0)
STABLE = mbs.Limit("buckling", "buckling", upper=1.0)
ROD = {"length": 0.3, "diameter": 0.012}, {"length": (0.12, 0.5), "diameter": (0.004, 0.02)}


def test_the_rod_of_a_slider_crank():
    """Of 720 limits the search differentiates 24; two hold the optimum, their prices are those of the case."""
    best = minimise(rod_over_a_turn, *ROD, limits=[PIN, STABLE], gradient="forward")
    assert best.ok, best.reason
    np.testing.assert_allclose(best.design["length"], 0.24545454545454534, rtol=1e-6)
    np.testing.assert_allclose(best.design["diameter"], 0.009542129664069593, rtol=1e-6)
    assert best.value == pytest.approx(0.13779112454716813, rel=1e-6)
    pin, stable = best.limits
    assert pin.worst == (0,) and stable.worst == (180,)
    assert pin.prices[0] == pytest.approx(-2.201079002506711 / 8000.0, rel=1e-4)
    assert stable.prices[180] == pytest.approx(-0.0688955622735841, rel=1e-4)
    assert np.count_nonzero(pin.prices) == np.count_nonzero(stable.prices) == 1


@pytest.mark.long
def test_aggregated_limits_stay_on_the_safe_side():
    soft = [mbs.Limit(limit.name, limit.value, upper=limit.upper, sharpness=400.0) for limit in (PIN, STABLE)]
    best = minimise(rod_over_a_turn, *ROD, limits=soft, gradient="forward")
    assert best.ok, best.reason
    assert all(limit.ok and 0.0 < limit.gap <= np.log(360) / 400.0 for limit in best.limits)
    assert best.limits[0].margin == pytest.approx(best.limits[0].gap, rel=1e-3)
    dearer = 2.201079 * best.limits[0].gap + 0.068896 * best.limits[1].gap  # to first order, by the known prices
    assert best.value == pytest.approx(0.13779112 + dearer, rel=5e-3)
    assert best.limits[0].price == pytest.approx(-2.201079 / 8000.0, rel=0.15)


NODES = np.array([[720.0, 360, 0], [720, 0, 0], [360, 360, 0], [360, 0, 0], [0, 360, 0], [0, 0, 0]])
BARS = [(4, 2), (2, 0), (5, 3), (3, 1), (2, 3), (0, 1), (4, 3), (5, 2), (2, 1), (3, 0)]
HELD = {"4": "x y z", "5": "x y z"} | {str(k): "z" for k in range(4)}
LENGTHS = np.array([np.linalg.norm(NODES[a] - NODES[b]) for a, b in BARS])


def truss(areas, nodes, young, density, masses=0.0):
    rods = [mbs.elements.Rod(young, area, density) for area in areas]
    elements = {"bars": (rods, BARS)}
    if masses:
        elements["masses"] = (mbs.elements.PointMass(masses), [(k,) for k in range(4)])
    return mbs.fem.Structure(nodes, elements, HELD)


def weight(areas):
    """Of the loaded truss [lb, in, psi], with stresses and the displacements of its free nodes."""
    structure = truss(areas, NODES, 1e7, 0.1)
    system = mbs.fem.assemble(structure)
    rest = mbs.equilibrium(system, {"1 y": -1e5, "3 y": -1e5})
    stresses = mbs.fem.element_stresses(structure, rest.displacement)["bars"][..., 0]
    return 0.1 * jnp.sum(areas * LENGTHS), {"stress": stresses, "displacements": rest.displacement}


@pytest.mark.long
def test_ten_bars_under_stress_and_displacement():
    """5 060.85 lb, published; the prices are the multipliers of the case over the limits."""
    limits = [mbs.Limit("stress", "stress", -25e3, 25e3), mbs.Limit("displacement", "displacements", -2.0, 2.0)]
    best = minimise(weight, np.full(10, 20.0), (0.1, None), limits=limits, steps=300)
    assert best.ok, best.reason
    assert best.value == pytest.approx(5060.853660338411, rel=1e-5)
    areas = [30.5218068, 0.1, 23.1998879, 15.2229069, 0.1, 0.5513556, 7.4572003, 21.0364279, 21.5284417, 0.1]
    np.testing.assert_allclose(best.design, areas, rtol=1e-3)
    stress, moved = best.limits
    assert stress.worst == (4,) and stress.price == pytest.approx(-123.2444862865154 / 25e3, rel=1e-3)
    assert moved.price == pytest.approx(4882.979654308266 / 2.0, rel=1e-3)  # the lower limit: a larger one costs
    assert best.bound_prices[[1, 4, 9]] == pytest.approx([96.1303897, 229.1786771, 220.9861134], rel=1e-3)
    assert best.kkt < 1e-6 * best.value


def mass(areas):
    """Of the truss with masses [kg], and its frequencies [Hz]; areas in cm^2."""
    nodes, lengths, areas = 9.144 / 360.0 * NODES, 9.144 / 360.0 * LENGTHS, areas * 1e-4
    system = mbs.fem.assemble(truss(areas, nodes, 6.89e10, 2770.0, 454.0))
    return 2770.0 * jnp.sum(areas * lengths), {"f": mbs.modes(system).frequencies}


@pytest.mark.parametrize(
    "sharpness", [pytest.param(None, marks=pytest.mark.long), pytest.param(4000.0, marks=pytest.mark.long)]
)
def test_ten_bars_with_frequencies_that_meet(sharpness):
    """532.03 kg, published; at the optimum two modes have 20 Hz and no gradient each, their smooth sum has one."""
    lower = np.array([7.0, 15.0, *np.full(6, 20.0)])
    limit = mbs.Limit("frequency", "f", lower, sharpness=sharpness)
    best = minimise(mass, np.full(10, 20.0), (0.645, 50.0), limits=[limit], starts=8, steps=200)
    assert best.value == pytest.approx(532.0298092157224, rel=5e-4 if sharpness else 1e-6)
    if sharpness:
        assert best.ok and best.kkt < 1e-6 * best.value
    prices = best.limit("frequency").prices
    assert prices[0] == pytest.approx(126.33497696800903, rel=1e-2)
    assert prices[2] + prices[3] == pytest.approx(14.64372600323514, rel=2e-2)
    values = np.array([found.value for found in best.starts])
    assert len(values) == 8 and np.all(values > 532.029)


@pytest.mark.parametrize("needed, reason", [(1, "converged"), (2, "converged"), (3, "no further descent")])
def test_a_search_that_is_stuck_begins_once_more(needed, reason):
    """It is proven after so many runs of its engine."""
    runs, kept = [], SimpleNamespace(violation=0.0)
    search = Mock(ConstrainedSearch, steps=0, reason="", current=kept, best=kept, residual=1.0)
    search.is_working_set_insufficient.return_value, search.failure_reason.return_value = False, "no further descent"
    search.is_best_optimal.side_effect = lambda: len(runs) >= needed
    run_constrained(search, 10, lambda search, steps: runs.append(steps))
    assert search.reason == reason and len(runs) == min(needed, 2)


@pytest.mark.parametrize("optimiser", ["MMA", "CCSAQ"])
def test_the_optimisers_of_nlopt(optimiser):
    pytest.importorskip("nlopt")
    best = minimise(rod_over_a_turn, *ROD, optimiser, limits=[PIN, STABLE], gradient="forward", steps=300)
    assert best.value == pytest.approx(0.13779112454716813, rel=1e-4)


def test_nlopt_is_asked_for_by_name():
    with pytest.raises(ImportError, match="pip install nlopt"), pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "nlopt", None)
        minimise(sum_of, {"x": 0.1, "y": 0.3}, optimiser="MMA", limits=[CIRCLE])


@pytest.mark.parametrize(
    ("limit", "error", "message"),
    [
        (lambda: mbs.Limit("a", lambda d: d["x"]), ValueError, "needs a lower or an upper bound"),
        (lambda: mbs.Limit("a", lambda d: d["x"], 1.0, sharpness=-2.0), ValueError, "sharpness must be positive"),
        (lambda: mbs.Limit("a", lambda d: d["x"], 1.0, 0.5), ValueError, "its bounds cross"),
        (lambda: mbs.Limit("a", lambda d: d["x"], np.zeros(3)), ValueError, "does not fit a value of shape"),
        (lambda: mbs.Limit("a", lambda d: "x", 1.0), TypeError, "real number or array"),
        (lambda: mbs.Limit("a", "radius", 1.0), ValueError, "returns no dict of answers"),
        (lambda: "radius", TypeError, "Limit"),
    ],
)
def test_faults(limit, error, message):
    with pytest.raises(error, match=message):
        minimise(sum_of, {"x": 0.1, "y": 0.3}, limits=[limit()])


def test_more_faults():
    with pytest.raises(mbs.UnknownNameError, match="radios"):
        limit = mbs.Limit("circle", "radios", upper=2.0)
        minimise(lambda d: (sum_of(d), {"radius": d["x"]}), {"x": 0.1, "y": 0.3}, limits=[limit])
    with pytest.raises(ValueError, match="do not support limits"):
        minimise(sum_of, {"x": 0.1, "y": 0.3}, optimiser="L-BFGS-B", limits=[CIRCLE])
    with pytest.raises(ValueError, match="both bounds of every variable: y"):
        minimise(sum_of, {"x": 0.1, "y": 0.3}, {"x": (0.0, 1.0), "y": (0.0, None)}, starts=4)


def test_a_trial_without_values_is_a_step_back():
    """log(x) has no value below zero; the first step goes there."""
    limit = mbs.Limit("log", lambda d: jnp.log(d["x"]), lower=-3.0, scale=1.0)
    best = minimise(lambda d: d["x"] ** 2 + d["y"] ** 2, {"x": 1.0, "y": 0.5}, limits=[limit])
    assert best.ok, best.reason
    assert best.design["x"] == pytest.approx(np.exp(-3.0), rel=1e-5)


@jax.custom_jvp
def wrong(x):
    return x**2


@wrong.defjvp
def _wrong_jvp(primals, tangents):
    return wrong(*primals), 3.0 * primals[0] * tangents[0]


def test_gradients_are_checked_on_request():
    start = {"x": 1.0, "y": 0.5}
    assert minimise(sum_of, start, limits=[CIRCLE], check=True).ok
    with pytest.raises(ValueError, match="objective by x: gradient 3, difference 2"):
        minimise(lambda d: wrong(d["x"]) + d["y"] ** 2, start, check=True)
    with pytest.raises(ValueError, match="tall by y: gradient .*, difference"):
        limit = mbs.Limit("tall", lambda d: wrong(d["y"]), upper=2.0)
        minimise(sum_of, start, limits=[CIRCLE, limit], check=True)


HEAVY = mbs.Limit("stress", lambda d: 3.0 / d["m"], upper=1.0)


@pytest.mark.parametrize("optimiser", [None, "trust-constr"])
@pytest.mark.parametrize("starts", [None, 1, 3])
def test_a_start_that_breaks_its_limits(optimiser, starts):
    """The multiplier of a broken limit cancels the objective's slope there: no proof of an optimum."""
    options = {"starts": starts, "limits": HEAVY, "steps": 300}
    best = minimise(lambda d: d["m"], {"m": 1.0}, {"m": (0.1, 10.0)}, optimiser, **options)
    assert best.ok and best.design["m"] == pytest.approx(3.0, rel=1e-6) and best.limits[0].ok


@pytest.mark.parametrize("objective", [lambda d: d["m"] ** 2, lambda d: 0.0 * d["m"], lambda d: jnp.sum(d["m"])])
@pytest.mark.parametrize("start", [0.0, 1.0, 5.0])
def test_where_a_search_starts_does_not_matter(objective, start):
    """At the free minimum, with no slope at all, below the limit and above it."""
    best = minimise(objective, {"m": start}, limits=[mbs.Limit("lift", lambda d: d["m"], lower=4.0)])
    assert best.ok and best.limits[0].ok
    assert best.value == pytest.approx(min(float(objective({"m": 4.0})), float(objective({"m": 5.0}))), rel=1e-6)


@pytest.mark.parametrize("optimiser", [None, pytest.param("trust-constr", marks=pytest.mark.long)])
def test_limits_that_contradict_each_other(optimiser):
    """2 and 4 are missed alike at 8/3, wherever the search starts."""
    limits = [mbs.Limit("low", lambda d: d["m"], upper=2.0), mbs.Limit("high", lambda d: d["m"], lower=4.0)]
    best = minimise(lambda d: d["m"], {"m": 1.0}, {"m": (0.1, 10.0)}, optimiser, limits=limits)
    assert not best.ok and best.reason.startswith("no design found") and best.design["m"] == pytest.approx(8 / 3)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_a_tolerance_is_kept_or_the_search_has_not_converged(tolerance):
    best = minimise(sum_of, {"x": 0.1, "y": 0.3}, limits=[CIRCLE], tolerance=tolerance)
    assert best.ok and best.kkt <= 100.0 * tolerance * np.sqrt(10.0)


def test_a_tolerance_that_rounding_does_not_allow():
    coarse = minimise(rod_over_a_turn, *ROD, limits=[PIN, STABLE], gradient="forward", tolerance=1e-18)
    assert not coarse.ok or coarse.kkt <= 1e-16


def test_the_best_start_leans_on_no_slack():
    """All sixteen end at one optimum; what one gains by the slack of 1e-7 is no merit."""
    bounds = {"x": (-2.0, 2.0), "y": (-2.0, 2.0)}
    best = minimise(sum_of, {"x": 0.1, "y": 0.3}, bounds, limits=[CIRCLE], starts=16, tolerance=1e-5)
    margins = [found.limits[0].margin for found in best.starts]
    assert min(margins) < -1e-9 < best.limits[0].margin
    assert best.value == pytest.approx(-np.sqrt(10.0), rel=1e-7)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ([mbs.Limit("a", lambda d: d["x"], upper=np.inf)], "'a' has infinite bounds only"),
        ([mbs.Limit("a", lambda d: d["x"], -np.inf, np.inf)], "'a' has infinite bounds only"),
        ([mbs.Limit("a", lambda d: d["x"], lower=np.inf)], "'a': a lower bound of infinity"),
        ([mbs.Limit("a", lambda d: d["x"] * jnp.zeros(0), upper=1.0)], "'a': its value is empty"),
        ([mbs.Limit("a", lambda d: d["x"] * jnp.zeros(0), upper=1.0, sharpness=10.0)], "'a': its value is empty"),
        ([mbs.Limit("a", lambda d: d["x"], upper=np.nan)], "'a': its bounds cross or are NaN"),
        ([CIRCLE, CIRCLE], "several limits are named 'radius'"),
    ],
)
def test_limits_that_are_none(limits, message):
    with pytest.raises(ValueError, match=message):
        minimise(sum_of, {"x": 0.1, "y": 0.3}, limits=limits)
