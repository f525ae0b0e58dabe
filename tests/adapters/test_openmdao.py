"""Components of OpenMDAO: values, derivatives both ways, names, units, bounds, and failures as drivers know them."""

import importlib.util
import re

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.adapters.openmdao import component
from jaxmbs.errors import ModelError, UnknownNameError

pytestmark = pytest.mark.skipif(importlib.util.find_spec("openmdao") is None, reason="needs openmdao")
DESIGN = {"rod": {"length [m]": 2.0}, "loads [N]": np.array([1.0, 2.0, 3.0])}


def stress(design):
    length, loads = design["rod"]["length [m]"], design["loads [N]"]
    return {"moment [N*m]": loads * length**2, "angle [deg]": jnp.sin(loads.sum() * length)}


def problem(part, mode="auto", **inputs):
    import openmdao.api as om

    whole = om.Problem(reports=None)
    whole.model.add_subsystem("part", part, promotes=["*"])
    whole.setup(mode=mode, check=False)
    for name, value in inputs.items():
        whole.set_val(name.replace("__", ":"), value)
    return whole


def totals(whole):
    whole.run_model()
    return whole.compute_totals(of=["moment", "angle"], wrt=["rod:length", "loads"])


@pytest.mark.parametrize("mode", ["fwd", "rev"])
@pytest.mark.parametrize("partials", ["matrix-free", "dense"])
def test_totals_are_the_closed_form(partials, mode):
    whole = problem(component(stress, DESIGN, partials=partials), mode)
    for length in (2.0, 1.5):  # a second point needs a second linearisation
        whole.set_val("rod:length", length)
        found = totals(whole)
        loads, c = DESIGN["loads [N]"], np.cos(6.0 * length)
        np.testing.assert_allclose(whole.get_val("moment"), loads * length**2, rtol=1e-15)
        np.testing.assert_allclose(found["moment", "rod:length"][:, 0], 2 * loads * length, rtol=1e-14)
        np.testing.assert_allclose(found["moment", "loads"], length**2 * np.eye(3), rtol=1e-14)
        np.testing.assert_allclose(found["angle", "rod:length"], [[6.0 * c]], rtol=1e-13)
        np.testing.assert_allclose(found["angle", "loads"], np.full((1, 3), length * c), rtol=1e-13)


def test_check_partials_of_openmdao_to_1e_8():
    """By its own central differences, of the step that is best for them."""
    whole = problem(component(stress, DESIGN))
    whole.run_model()
    found = whole.check_partials(out_stream=None, method="fd", form="central", step=1e-5)["part"]
    errors = [max(entry["abs error"].forward, entry["abs error"].reverse) for entry in found.values()]
    assert len(errors) == 4 and max(errors) < 1e-8 * 12.0  # of the largest entry
    assert all(entry["abs error"].fwd_rev < 1e-14 for entry in found.values())


@pytest.mark.parametrize("mode", ["fwd", pytest.param("rev", marks=pytest.mark.long)])
def test_products_at_one_point_share_a_linearisation(mode):
    """Of many directions, which are not worth a Jacobian."""
    part = component(stress, DESIGN)
    part.evaluator._is_narrow = {"fwd": False, "rev": False}
    count = []

    def counted(call):
        return lambda x: count.append(1) or call(x)

    for name in ("_linearise", "_pull_back"):
        setattr(part.evaluator, name, counted(getattr(part.evaluator, name)))
    for length, calls in ((2.0, 1), (3.0, 2)):
        found = totals(problem(part, mode, rod__length=length))
        assert len(count) == calls
        np.testing.assert_allclose(found["moment", "loads"], length**2 * np.eye(3), rtol=1e-14)
        np.testing.assert_allclose(found["angle", "loads"], np.full((1, 3), length * np.cos(6 * length)), rtol=1e-13)


def test_units_of_names_are_converted():
    whole = problem(component(stress, DESIGN, units={"loads": "kN"}))
    whole.set_val("rod:length", 300.0, units="cm")
    whole.run_model()
    np.testing.assert_allclose(whole.get_val("moment", units="N*mm"), 9e3 * np.array([1.0, 2.0, 3.0]), rtol=1e-14)
    np.testing.assert_allclose(whole.get_val("loads", units="N"), [1e3, 2e3, 3e3])
    np.testing.assert_allclose(whole.get_val("angle", units="rad"), np.deg2rad(np.sin(18.0)), rtol=1e-13)


@pytest.mark.parametrize(
    "unit, theirs",
    [("m^2", "m**2"), ("m**2", "m**2"), ("kg m^2", "kg*m**2"), ("m/s2", "m/s**2"), ("N m s / rad", "N*m*s/rad")]
    + [("(m/s^2)^2/Hz", "(m/s**2)**2/Hz"), ("m\u00b2", "m**2"), ("1/s^2", "1/s**2"), ("deg", "deg")],
)
def test_units_with_powers_are_those_of_openmdao(unit, theirs):
    whole = problem(component(lambda d: {f"y [{unit}]": 2.0 * d["x"]}, {"x": 1.5}))
    whole.run_model()
    assert whole.get_val("y", units=theirs) == 3.0


@pytest.mark.parametrize("unit", ["furlongs", "m^", "m^x", "__import__('os')", "m m/"])
def test_what_is_no_unit_is_told_in_words(unit):
    with pytest.raises(ModelError, match="OpenMDAO has no unit"):
        component(lambda d: {f"y [{unit}]": 2.0 * d["x"]}, {"x": 1.5})


def test_bounds_make_design_variables():
    bounds = {"rod": {"length [m]": (1.0, 3.0)}, "loads [N]": (None, np.array([4.0, 5.0, 6.0]))}
    variables = problem(component(stress, DESIGN, bounds)).model.get_design_vars()
    assert set(variables) == {"rod:length", "loads"}
    length = variables["rod:length"]
    assert [length[name][0] for name in ("lower", "upper", "ref0", "ref")] == [1.0, 3.0, 1.0, 3.0]
    np.testing.assert_array_equal(variables["loads"]["upper"], [4.0, 5.0, 6.0])


def test_driver_finds_the_optimum_in_closed_form():
    """Least 3 x^2 + (y - 2)^2 with x + y >= 3: x = 1/4, y = 11/4."""
    import openmdao.api as om

    def paraboloid(d):
        return 3 * d["x"] ** 2 + (d["y"] - 2) ** 2, {"sum": d["x"] + d["y"]}

    whole = om.Problem(reports=None)
    bounds = {"x": (-5.0, 5.0), "y": (-5.0, 5.0)}
    whole.model.add_subsystem("part", component(paraboloid, {"x": 1.0, "y": 1.0}, bounds), promotes=["*"])
    whole.model.add_objective("objective")
    whole.model.add_constraint("sum", lower=3.0)
    whole.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-12, disp=False)
    whole.setup()
    whole.run_driver()
    np.testing.assert_allclose([whole["x"][0], whole["y"][0]], [0.25, 2.75], atol=1e-9)


@pytest.mark.parametrize("partials", ["matrix-free", "dense"])
def test_failures_are_analysis_errors(partials):
    from openmdao.api import AnalysisError

    whole = problem(component(lambda d: {"root": jnp.sqrt(d["x"]), "one": d["x"]}, {"x": 1.0}, partials=partials))
    whole.set_val("x", -1.0)
    with pytest.raises(AnalysisError, match="root not finite"):
        whole.run_model()
    whole.set_val("x", 0.0)  # finite, and its slope is not
    whole.run_model()
    with pytest.raises(AnalysisError, match="derivatives are not finite"):
        whole.compute_totals(of=["root"], wrt=["x"])


@pytest.mark.long
def test_status_of_a_motion_is_judged():
    """A swing that the solver leaves after two steps; motions and states are no outputs."""
    from openmdao.api import AnalysisError

    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(1.0, 0.0, 0.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    system = b.build()

    def swing(design, steps):
        start = mbs.State.at(system, pin=design["pin"])
        motion = mbs.simulate(system, start, t1=design["time"], throw=False, max_steps=steps, gradient="forward")
        return {"end": motion.end.coordinates[0], "motion": motion}

    whole = problem(component(lambda d: swing(d, 1000), {"pin": 0.3, "time": 1.0}), "fwd")
    whole.run_model()
    assert [part.name for part in whole.model.part.evaluator.question.outputs] == ["end"]
    found = whole.compute_totals(of=["end"], wrt=["pin", "time"])
    step = 1e-5
    for name, value in (("pin", 0.3), ("time", 1.0)):
        ends = []
        for sign in (1, -1):
            whole.set_val(name, value + sign * step)
            whole.run_model()
            ends.append(whole.get_val("end")[0])
        whole.set_val(name, value)
        np.testing.assert_allclose(found["end", name][0, 0], (ends[0] - ends[1]) / (2 * step), rtol=1e-6)
    with pytest.raises(AnalysisError, match="maximum number of steps"):
        problem(component(lambda d: swing(d, 2), {"pin": 0.3, "time": 1.0})).run_model()


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"partials": "sparse"}, ValueError, "'matrix-free' or 'dense'"),
        ({"gradient": "reverse"}, ValueError, "partials='dense'"),
        ({"partials": "dense", "gradient": "sideways"}, ValueError, "'forward' or 'reverse'"),
        ({"units": {"lenght": "m"}}, UnknownNameError, "lenght"),
        ({"units": {"angle": "degrees of arc"}}, ModelError, "angle: OpenMDAO has no unit"),
        ({"example": DESIGN | {"rod": {"length [m]": "two"}}}, TypeError, "rod.length"),
        ({"bounds": {"rod": {"length [m]": (3.0, 4.0)}, "loads [N]": None}}, ValueError, "outside its bounds"),
        ({"function": lambda d: {"count": jnp.array(3)}}, TypeError, "count is of type int"),
        ({"function": lambda d: {}}, ValueError, "no results"),
        ({"function": lambda d: {"a [m]": 1.0 * d["loads [N]"], "a [N]": d["loads [N]"]}}, ValueError, "'a'"),
        ({"function": lambda d: {"loads": d["loads [N]"]}}, ModelError, "names of their own"),
    ],
)
def test_misuses_are_refused_by_name(change, error, words):
    with pytest.raises(error, match=re.escape(words)):
        component(**({"function": stress, "example": DESIGN} | change))


def test_without_openmdao(monkeypatch):
    import builtins

    from jaxmbs.adapters import openmdao

    openmdao._component_class.cache_clear()
    real = builtins.__import__

    def missing(name, *rest):
        if name.startswith("openmdao"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(ImportError, match=re.escape("jaxmbs[openmdao]")):
        component(stress, DESIGN)


@pytest.mark.long
def test_wishbone_is_optimised_as_by_minimise(monkeypatch):
    """The double wishbone of the benchmark: the same largest member load by OpenMDAO's SLSQP and by `minimise`."""
    monkeypatch.syspath_prepend("benchmarks")
    import openmdao_component as benchmark

    load, excess, *_ = benchmark.optimum(quick=False)
    assert abs(load.value / load.peer_value - 1.0) < 1e-6
    assert excess.value < 1e-6


@pytest.mark.long
def test_check_partials_of_the_wishbone_to_1e_8(monkeypatch):
    """Of the benchmark's 51 results by 21 variables, by OpenMDAO's central differences; both modes to rounding."""
    monkeypatch.syspath_prepend("benchmarks")
    import wishbone_limits

    whole = problem(component(wishbone_limits.study, wishbone_limits.first_design(), compile="quick"))
    whole.run_model()
    found = whole.check_partials(out_stream=None, method="fd", form="central", step=2e-6)["part"]
    sizes = {}
    for (of, _), entry in found.items():
        sizes[of] = max(sizes.get(of, 0.0), float(np.max(np.abs(entry["J_fwd"]))))
    assert sum(entry["J_fwd"].size for entry in found.values()) == 51 * 21
    for (of, wrt), entry in found.items():
        np.testing.assert_allclose(
            entry["J_fwd"], entry["J_fd"], atol=1e-8 * sizes[of], rtol=0, err_msg=f"{of} {wrt}"
        )
        np.testing.assert_allclose(entry["J_fwd"], entry["J_rev"], atol=1e-13 * sizes[of], rtol=0)
