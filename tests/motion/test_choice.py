"""The solver of a motion where none is named: what is chosen, why, and what the choice costs."""

import diffrax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.motion import _choice
from tests.models import pendulum


def strut(damping=2e3, stiffness=1e7):
    """A mass of 1 kg that swings on a strut; the strut's own motion has a rate of sqrt(k) and loses c / 2 of it."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("sleeve", mass=0.1, com=(0.1, 0.0, 0.0), inertia=mbs.inertia.rod(0.1, 0.2))
    b.body("mass", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    b.joint("pin", mbs.Revolute("z"), "ground", "sleeve")
    b.joint("slide", mbs.Prismatic("x"), "sleeve", "mass")
    b.force("strut", mbs.SpringDamper(stiffness, damping, free_length=1.0), joint="slide")
    return b.build()


STRUT = strut()
START = mbs.State.at(STRUT, pin=0.0, slide=1.0)


def test_a_stiff_damper_is_stepped_over():
    chosen = mbs.simulate(STRUT, START, ts=[10.0])
    named = mbs.simulate(STRUT, START, ts=[10.0], solver=mbs.ode.Rodas5P())
    np.testing.assert_array_equal(chosen.states.coordinates, named.states.coordinates)
    assert named.solver == "Rodas5P, steps that adapt, rtol = 1e-09, atol = 1e-09"
    rate = np.sqrt(1e7)  # [1/s], of k = 1e7 N/m and 1 kg: the mass swings, the sleeve does not
    reason = (
        f"the fastest motion at the start, {rate:.4g} 1/s, dies out and would bound the steps of Dopri8 all along"
    )
    assert chosen.solver == f"{named.solver}; chosen as {reason}"


@pytest.mark.parametrize(
    ("system", "end", "words"),
    [
        (strut(damping=0.0), 1.0, "nothing dies out"),  # it rings all along, which order eight does best
        (strut(damping=50.0), 1.0, "nothing dies out"),
        (STRUT, 0.5, "nothing dies out"),  # before many steps are made
        (STRUT, 3.0, "bounds its steps too little"),
    ],
)
def test_what_lasts_or_ends_early_is_left_to_dopri8(system, end, words):
    motion = mbs.simulate(system, mbs.State.at(system, pin=0.0, slide=1.0), ts=[end])
    assert motion.solver.startswith("Dopri8") and words in motion.solver


def test_machines_without_a_stiff_damper_pay_no_program(monkeypatch):
    monkeypatch.setattr(_choice, "_rates_around", None)  # not to be called
    system = pendulum()
    motion = mbs.simulate(system, mbs.State.at(system, {system.topology.joint_names[0]: 1.0}), ts=[0.5])
    assert "chosen as nothing dies out" in motion.solver


def test_within_a_trace_it_is_dopri8():
    steps = mbs.jit(lambda start: mbs.simulate(STRUT, start, ts=[0.01]).diagnostics.num_steps)(START)
    named = mbs.simulate(STRUT, START, ts=[0.01], solver=diffrax.Dopri8())
    assert steps == named.diagnostics.num_steps


def test_what_is_named_or_has_fixed_steps_is_not_chosen(monkeypatch):
    monkeypatch.setattr(_choice, "_may_be_stiff", None)  # not to be called
    for options in ({"solver": diffrax.Dopri8()}, {"dt": 1e-4}):
        motion = mbs.simulate(STRUT, START, ts=[0.001], **options)
        assert "chosen" not in motion.solver


def rubbing(model):
    """A block on a guide that rubs: at rest its slopes are steep."""
    b = mbs.SystemBuilder()
    b.body("block", mass=2.0, inertia=(1e-2, 1e-2, 1e-2))
    b.joint("guide", mbs.Prismatic("x"), "ground", "block")
    b.friction("rub", "guide", model)
    b.force("push", mbs.Force((40.0, 0.0, 0.0)), on="block")
    return b.build()


def test_friction_is_steep_at_rest_alone():
    system = rubbing(mbs.friction.SmoothCoulomb(0.3, transition_speed=1e-6))
    assert mbs.simulate(system, mbs.State.at(system, guide=0.0), ts=[0.1]).solver.startswith("Dopri8")


def test_a_motion_without_freedom_says_that_nothing_is_integrated():
    b = mbs.SystemBuilder()
    b.body("arm", mass=1.0, com=(0.2, 0.0, 0.0), inertia=(1e-2, 1e-2, 1e-2))
    b.joint("pin", mbs.Revolute("z"), "ground", "arm", drive=mbs.Ramp(0.0, 2.0))
    system = b.build()
    said = mbs.simulate(system, mbs.State.at(system), ts=[0.1]).solver
    assert said.startswith("the constraints alone give the motion, nothing is integrated but the work: Dopri8")


@pytest.mark.parametrize("exponent", [3, 6, 9])
def test_the_choice_is_the_same_each_time(exponent):
    found = [mbs.simulate(STRUT, START, ts=[8.0], rtol=10.0**-exponent).solver for _ in range(2)]
    assert found[0] == found[1]
