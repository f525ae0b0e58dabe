"""FMUs whose model leaves its validity: a status, and a message that names the part, the excess and the time."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.adapters.fmi import export_fmu
from jaxmbs.adapters.fmi._parameters import Parameters
from jaxmbs.adapters.fmi._program import FlatMechanism
from jaxmbs.contact import HuntCrossley, SphereOnPlane
from jaxmbs.forces import Attachment, HydraulicCylinder, Sheave

from .mechanisms import instance, needs_compiler, pendulum

DEPTH = 5e-4


def ball(speed):
    """A sphere on its way into a floor: at a speed v it sinks in by v sin(1000 t) / 1000."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("ball", 1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    b.contact("floor", SphereOnPlane(0.05), "ball", "ground", HuntCrossley(1e6, 1.0), max_depth=DEPTH)
    system = b.build()
    return system, mbs.State.at(system, {"z": 0.05}, {"z": -speed})


def press():
    """Parts of several kinds with ends, one with states, whose names are not in the order in which they are made."""
    b = mbs.SystemBuilder()
    b.body("ram", 1.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "ram")
    b.force("oil", HydraulicCylinder([1e-3, 8e-4], [1e-4, 1e-4], 1e9, varying=True), joint="slide")
    b.contact("floor", SphereOnPlane(0.05), "ram", "ground", HuntCrossley(1e6, 1.0), max_depth=DEPTH)
    over = [Attachment(("ground", (-0.1, 0, 0))), Sheave("ground", 0.05, axis="y"), Attachment(("ram", (0.2, 0, 0)))]
    b.cable("band", over, stiffness=1e3, free_length=0.5)
    system = b.build()
    return system, mbs.State.at(system, slide=0.04)


@pytest.mark.slow
def test_ends_are_named_in_the_order_of_the_margins():
    system, state = press()
    flat = FlatMechanism(system, Parameters.of(system, None), (), ("slide",), {})
    margins = np.asarray(jax.jit(flat.margins)(flat.start(state, np.zeros(0))))
    told = [
        f"{what}, by {-x:.3g} {unit}, first at 0 s"
        for (what, unit), x in zip(flat.ends_of_models, margins, strict=True)
    ]
    truth = mbs.dynamics.validity(system, state)
    assert sorted(x for x, margin in zip(told, margins, strict=True) if margin < 0) == sorted(truth.faults())
    assert any("'floor' is pressed deeper" in x for x in truth.faults())
    assert {what.split("'")[1] for what, _ in flat.ends_of_models} == {"oil", "floor", "band"}


def test_a_mechanism_without_ends_pays_nothing():
    system, _ = pendulum()
    assert FlatMechanism(system, Parameters.of(system, None), (), ("height",), {}).ends_of_models == []


@pytest.mark.long
@pytest.mark.parametrize("kind", ["ME", "CS"])
@pytest.mark.parametrize("speed, is_left", [(0.4, False), (0.8, True)])
def test_a_host_is_told(kind, speed, is_left, tmp_path):
    """A speed of 0.8 m/s reaches the depth at `arcsin(5 / 8)` ms, between the samples at 0.6 and 0.7 ms."""
    fmpy = needs_compiler()
    system, state = ball(speed)
    path, told = export_fmu(system, [], ["z"], tmp_path / "ball.fmu", kind, state=state), []
    options = {"stop_time": 2e-3, "output_interval": 1e-4, "relative_tolerance": 1e-9}
    options["logger"] = lambda environment, status, category, message: told.append((status, message.decode()))
    if not is_left:
        found = fmpy.simulate_fmu(str(path), **options)["output z"]
        assert not told
        np.testing.assert_allclose(np.min(found), 0.05 - 1e-3 * speed, rtol=1e-4)
        return
    with pytest.raises(Exception, match=r"status 2 \(discard\)"):
        fmpy.simulate_fmu(str(path), **options)
    excess = 1e-3 * speed * np.sin(0.7) - DEPTH
    status, message = told[0]
    assert status == 2
    assert message.endswith(f"'floor' is pressed deeper than its max_depth, by {excess:.3g} m, at 0.0007 s")


@pytest.mark.long
def test_stages_may_go_beyond_and_a_smaller_step_goes_on(tmp_path):
    """Rates are given beyond the end, points of the motion are not; the instance then takes others."""
    system, state = ball(0.4)
    path = export_fmu(system, [], ["z"], tmp_path / "ball.fmu", state=state)
    with instance(path) as (fmu, places):
        fmu.updateDiscreteStates()
        fmu.setFloat64([places["z"]], [0.05 - 2 * DEPTH])
        np.testing.assert_allclose(fmu.getFloat64([places["der(rate of z)"]]), 2e6 * DEPTH, rtol=1e-9)
        with pytest.raises(Exception, match=r"status 2 \(discard\)"):
            fmu.completedIntegratorStep()
        fmu.setFloat64([places["z"]], [0.05 - 0.5 * DEPTH])
        fmu.completedIntegratorStep()
