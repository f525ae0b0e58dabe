"""The bar of a motion: another thread looks at the tape, and the program calls nothing."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import ON_TAPE


def pendulum():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=2.0, com=(0.0, -0.8, 0.0))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    return b.build()


def move(progress, **options):
    system = pendulum()
    return mbs.simulate(system, mbs.State.at(system, pin=1.0), t1=3.0, progress=progress, **options)


def test_a_motion_on_a_tape_shows_how_far_it_is(capfd):
    quiet = move(False)
    assert "%" not in capfd.readouterr().err
    with_bar = move(True)
    assert "simulate: 100%" in capfd.readouterr().err
    np.testing.assert_array_equal(with_bar.states.coordinates, quiet.states.coordinates)


def test_a_motion_that_fails_ends_its_bar_where_it_stopped(capfd):
    with pytest.raises(mbs.SimulationError, match="max_steps"):
        move(True, max_steps=5)
    last = capfd.readouterr().err.rsplit("\r", 1)[-1]
    assert "simulate:" in last and "100%" not in last


def callbacks(on_tape):
    with ON_TAPE(on_tape):
        return str(jax.make_jaxpr(lambda: move(True).states.coordinates)()).count("callback")


@pytest.mark.slow
def test_programs_of_tapes_call_nothing():
    assert callbacks(True) == 0
    assert callbacks(False) > 0


def test_a_bar_of_times_that_are_traced_is_none(capfd):
    system = pendulum()
    end = mbs.jit(lambda t1: mbs.simulate(system, mbs.State.at(system, pin=1.0), t1=t1, progress=True).end.t)(1.0)
    assert float(end) == 1.0
    assert "%" not in capfd.readouterr().err
