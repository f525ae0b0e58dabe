"""Exported FMUs: validated and simulated by fmpy, beside `simulate` and JAX's derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks
from jaxmbs.adapters.fmi import _export, export_fmu
from jaxmbs.adapters.fmi._parameters import Parameters
from jaxmbs.adapters.fmi._program import FlatMechanism

from .mechanisms import cart, compiler_or_skip, instance, needs_compiler, pendulum, rates, slider_crank

TIMES = np.linspace(0.0, 1.0, 51)


def simulated(path, **options):
    fmpy = needs_compiler()
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(path)) == []
    options = {"stop_time": 1.0, "output_interval": 0.02, "relative_tolerance": 1e-10} | options
    return fmpy.simulate_fmu(str(path), **options)


def expected(system, state, joint):
    motion = mbs.simulate(system, state, ts=TIMES, rtol=1e-11, atol=1e-11)
    return np.asarray(system.coordinates(motion.states)[joint]).reshape(-1)


@pytest.fixture(scope="module")
def swing():
    compiler_or_skip()
    return pendulum()


@pytest.mark.parametrize(
    "words, options",
    [
        (r"kind must be 'ME' \(model exchange\) or 'CS'", {"kind": "both"}),
        ("'dtt' is no option of a step", {"kind": "CS", "dtt": 0.1}),
        ("rtol: options of a step are those of kind='CS'", {"rtol": 1e-3}),
        (r"outputs: names are given in a list, \['height'\]", {"outputs": "height"}),
        (r"inputs: names are given in a list, \['motor'\]", {"inputs": "motor"}),
        ("no joint or signal 'heigh': did you mean 'height'", {"outputs": ["heigh"]}),
        ("no input 'moto.function': did you mean 'motor.function'", {"inputs": ["moto.function"]}),
        ("units: there is no input, output or parameter 'x'", {"units": {"x": "m"}}),
        ("path must be the name of a file, not 3", {"path": 3}),
    ],
)
def test_wrong_options_are_told_before_any_program_is_made(swing, words, options, tmp_path, monkeypatch):
    monkeypatch.setattr(_export, "serialised_programs", lambda *args: pytest.fail("a program was made"))
    valid = {"inputs": ["motor"], "outputs": ["height"], "path": tmp_path / "one.fmu"}
    system, state = swing
    with pytest.raises((mbs.ModelError, mbs.UnknownNameError), match=words):
        export_fmu(system, **valid | {"state": state} | options)
    assert not (tmp_path / "one.fmu").exists()


def test_single_precision_and_samples_are_refused(swing, tmp_path, monkeypatch):
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.5, 0.0, 0.0), inertia=0.01)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("motor", mbs.Actuator(0.0), joint="pin")
    b.measure("angle", joint="pin")
    b.block("loop", blocks.PI(1.0, 0.0, target=0.0), reads="angle", drives="motor", every=0.1)
    with pytest.raises(mbs.ModelError, match="loop"):
        export_fmu(b.build(), [], ["angle"], tmp_path / "one.fmu")
    with jax.enable_x64(False), pytest.raises(mbs.ModelError, match="jax_enable_x64"):
        export_fmu(swing[0], [], ["height"], tmp_path / "one.fmu", state=swing[1])


def test_names_of_c():
    assert [_export._identifier(stem) for stem in ("arm 2", "2nd-arm", "ä")] == ["arm_2", "_2nd_arm", "_"]


@pytest.mark.long
@pytest.mark.parametrize("kind, tolerance", [("ME", 2e-7), ("CS", 1e-8)])
@pytest.mark.parametrize("make, joint, output", [(pendulum, "pin", "height"), (slider_crank, "A", "slide")])
def test_motions_are_those_of_simulate(make, joint, output, kind, tolerance, tmp_path):
    needs_compiler()
    system, state = make()
    path = export_fmu(system, ["motor"], [joint, output], tmp_path / "one.fmu", kind, state=state)
    found = simulated(path)
    name = f"output {joint}"
    np.testing.assert_allclose(found[name], expected(system, state, joint), atol=tolerance)
    assert np.ptp(found[output]) > 0.05


@pytest.mark.long
@pytest.mark.parametrize("kind", ["ME", "CS"])
def test_inputs_push_a_cart(kind, tmp_path):
    """A host that holds an input between its steps makes an error of the first order in their length."""
    needs_compiler()
    system, state = cart()
    path = export_fmu(system, ["push"], ["rail"], tmp_path / "cart.fmu", kind, state=state, units={"rail": "m"})
    found = simulated(path, start_values={"push.function": 3.0})["output rail"]
    np.testing.assert_allclose(found, expected(*cart(3.0), "rail"), atol=2e-7)
    ramp = np.array([(0.0, 0.0), (1.0, 3.0)], dtype=[("time", float), ("push.function", float)])
    found = simulated(path, input=ramp, output_interval=0.002)["output rail"][::10]
    np.testing.assert_allclose(found, expected(*cart(lambda x, v, t: 3.0 * t), "rail"), atol=2e-3)
    assert found[-1] > 0.1


@pytest.mark.long
def test_derivatives_are_those_of_jax(tmp_path):
    needs_compiler()
    system, state = slider_crank()
    names = ["rod.mass", "spring.stiffness"]
    path = export_fmu(system, ["motor"], ["slide"], tmp_path / "crank.fmu", state=state, parameters=names)
    flat = FlatMechanism(system, Parameters.of(system, names), ("motor.function",), ("slide",), {})
    z = flat.start(state, np.array([1.0]))
    x = np.array([0.7, 1.5])
    z[1:3] = x
    J = np.asarray(jax.jit(jax.jacfwd(flat.instant))(jnp.asarray(z)))[:3, :6]  # by t, A, its rate, motor, two numbers
    rng = np.random.default_rng(0)
    with instance(path) as (fmu, places):
        rates(fmu, x)
        knowns = [places[name] for name in ("time", "A", "rate of A", "motor.function", *names)]
        unknowns = [places[name] for name in ("der(A)", "der(rate of A)", "slide")]
        seed, weights = rng.normal(size=6), rng.normal(size=3)
        along = fmu.getDirectionalDerivative(unknowns, knowns, seed)
        back = fmu.getAdjointDerivative(unknowns, knowns, weights, nSensitivity=len(knowns))
        step = 1e-6
        by_difference = (rates(fmu, x + [0.0, step]) - rates(fmu, x - [0.0, step])) / (2 * step)
    np.testing.assert_allclose(along, J @ seed, rtol=1e-12, atol=1e-12 * np.abs(J).max())
    np.testing.assert_allclose(back, weights @ J, rtol=1e-12, atol=1e-12 * np.abs(J).max())
    np.testing.assert_allclose(J[:2, 2], by_difference, rtol=1e-6)


@pytest.mark.long
def test_states_return_and_parameters_are_tuned(tmp_path):
    needs_compiler()
    system, state = pendulum()
    names = ["bob.mass", "spring.stiffness"]
    path = export_fmu(system, ["motor"], ["height"], tmp_path / "one.fmu", state=state, parameters=names)
    with instance(path) as (fmu, places):
        kept = fmu.getFMUState()
        stored = fmu.serializeFMUState(kept)
        first = rates(fmu, [0.3, 0.0])
        fmu.setFloat64([places["spring.stiffness"]], [7.0])
        tuned = rates(fmu, [0.5, 1.0])
        fmu.setFMUState(kept)
        np.testing.assert_array_equal(rates(fmu, [0.3, 0.0]), first)
        fmu.setFloat64([places["spring.stiffness"]], [9.0])
        fmu.setFMUState(fmu.deserializeFMUState(stored))
        np.testing.assert_array_equal(rates(fmu, [0.3, 0.0]), first)
        with pytest.raises(Exception, match="fmi3DeserializeFMUState"):
            fmu.deserializeFMUState(bytes(stored)[:-1] + b"")
    other, _ = pendulum({"stiffness": 7.0})
    there = mbs.State.at(other, pin=0.5, velocities={"pin": 1.0})
    np.testing.assert_allclose(tuned[1], mbs.forward_dynamics(other, there)[0][0], rtol=1e-12)
    found = simulated(path, start_values={"spring.stiffness": 7.0})
    height = mbs.signals(other, mbs.simulate(other, mbs.State.at(other, pin=0.3), ts=TIMES))["height"]
    np.testing.assert_allclose(found["height"], height, atol=1e-7)


@pytest.mark.long
def test_a_function_of_parameters_and_a_function_of_outputs(tmp_path):
    needs_compiler()
    base, state = pendulum()

    def outputs(system, state, time):
        return {"tip": mbs.position(system, state, ("bob", (1.0, 0.0, 0.0))), "twice": 2.0 * time}

    path = export_fmu(
        lambda p: pendulum(p, like=base)[0],
        [],
        outputs,
        tmp_path / "one.fmu",
        state=state,
        parameters={"mass": 1.0, "stiffness": 2.0},
        units={"tip": "m", "mass": "kg"},
    )
    simulated(path)
    with instance(path, start={"mass": 3.0}) as (fmu, places):
        fmu.setTime(0.25)
        found = fmu.getFloat64([places[name] for name in ("tip[1]", "tip[2]", "tip[3]", "twice")])
    np.testing.assert_allclose(found, [np.cos(0.3), 0.0, -np.sin(0.3), 0.5], atol=1e-14)


@pytest.mark.long
def test_failures_are_statuses_and_no_numbers(tmp_path, capfd):
    needs_compiler()
    b = mbs.SystemBuilder()
    for name, length in (("crank", 0.5), ("rod", 0.6)):
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=0.01)
    b.joint("A", mbs.Revolute("y"), "ground", "crank")
    b.joint("B", mbs.Revolute("y"), "crank", "rod", parent_frame=(0.5, 0.0, 0.0))
    b.body("piston", mass=0.7, inertia=0.01)
    b.joint("slide", mbs.Prismatic("x"), "ground", "piston", parent_frame=(0.0, 0.0, 0.3))
    b.joint("C", mbs.Revolute("y"), "rod", "piston", parent_frame=(0.6, 0.0, 0.0))
    system = b.build(guess={"A": 0.1, "B": -0.3}, independent=["A"])
    state = mbs.State.at(system, A=0.1, guess={"B": -0.3, "slide": 1.0})
    path = export_fmu(system, [], ["slide"], tmp_path / "one.fmu", state=state)
    with instance(path) as (fmu, _):
        assert np.all(np.isfinite(rates(fmu, [0.1, 0.0])))
        with pytest.raises(Exception, match="status 2"):
            rates(fmu, [1.5, 0.0])
        with pytest.raises(Exception, match="status 2"):
            rates(fmu, [np.nan, 0.0])
        assert np.all(np.isfinite(rates(fmu, [0.1, 0.0])))
    text = capfd.readouterr().out
    assert "the loops do not close" in text and "A: not finite" in text
