"""Loads along a given trajectory, forces of named laws and rows, rates and columns by the names of joints."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, chain_of_bars, four_bar, four_bar_state

LINKS = chain_of_bars(2)
HELD = mbs.State.at(LINKS, pin0=0.3, pin1=0.4, velocities={"pin0": 1.0, "pin1": -2.0})


@pytest.mark.slow
def test_loads_along_a_given_trajectory_of_an_arm():
    """Newton's law of the outer link, and the torques of `inverse_dynamics`."""
    wanted = {"pin0": 2.0, "pin1": -1.0}
    loads = mbs.reactions(LINKS, HELD, accelerations=wanted)
    a = mbs.dynamics.acceleration(LINKS, HELD, ("link1", (0.5, 0.0, 0.0)), wanted)
    assert loads.ok
    np.testing.assert_allclose(loads["pin1"].force, a - np.array(DOWN_Y), atol=1e-10)
    torque = mbs.inverse_dynamics(LINKS, HELD, np.array([2.0, -1.0]))
    np.testing.assert_allclose([loads["pin0"].effort[0], loads["pin1"].effort[0]], torque, atol=1e-10)
    free = mbs.forward_dynamics(LINKS, HELD)[0]
    same = mbs.reactions(LINKS, HELD, accelerations=free)
    np.testing.assert_allclose(same["pin0"].force, mbs.reactions(LINKS, HELD)["pin0"].force, atol=1e-9)
    np.testing.assert_allclose(same["pin0"].effort, 0.0, atol=1e-9)


@pytest.mark.slow
def test_loads_along_a_given_trajectory_of_a_loop():
    """A four-bar held by its crank or by its rocker: the same power; a wrong acceleration is seen."""
    system = four_bar(stiffness=3.0, load=2.0)
    state = four_bar_state(system)
    driven = four_bar(stiffness=3.0, load=2.0, drive=mbs.forces.Polynomial((0.7, 2.0, 0.25)))
    start = mbs.State.at(driven, guess=system.coordinates(state))
    a = mbs.forward_dynamics(driven, start)[0]
    expected = mbs.reactions(driven, start)
    found = mbs.reactions(system, state, accelerations=a, actuators=["A"])
    assert found.ok
    for name in "ABCD":
        np.testing.assert_allclose(found[name].force[:2], expected[name].force[:2], atol=1e-7)
    np.testing.assert_allclose(found["A"].effort, expected["A"].effort, atol=1e-7)
    other = mbs.reactions(driven, start, actuators=["D"])
    u = driven.velocities(start)
    np.testing.assert_allclose(other["D"].effort[0] * u["D"], expected["A"].effort[0] * u["A"], rtol=1e-7)
    assert not mbs.reactions(system, state, accelerations=a + 1.0, actuators=["A"]).ok


@pytest.mark.slow
def test_forces_of_named_laws():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("slide", 1.0)
    b.joint("rail", mbs.Prismatic("x"), "ground", "slide")
    b.force("spring", mbs.SpringDamper(100.0, free_length=0.5), between=(("ground", (0.0, 0.3, 0.0)), "slide"))
    b.force("rail", mbs.SpringDamper(7.0, damping=2.0), joint="rail")
    b.force("mount", mbs.Bushing(stiffness=(1e3,) * 3 + (10.0,) * 3), between=("ground", "slide"))
    b.force("push", mbs.Force((1.0, 2.0, 3.0)), on="slide")
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system, rail=0.4, velocities={"rail": 0.1}))
    np.testing.assert_allclose(loads.law("spring").effort, 0.0, atol=1e-9)  # its length is 0.5
    further = mbs.reactions(system, mbs.State.at(system, rail=jnp.sqrt(0.27)))
    np.testing.assert_allclose(further.law("spring").effort, -10.0, atol=1e-9)  # 0.6 long: pulls
    np.testing.assert_allclose(further.law("spring").force, [-10.0 * np.sqrt(0.27) / 0.6, 5.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(loads.law("rail").effort, -7.0 * 0.4 - 2.0 * 0.1, atol=1e-12)
    np.testing.assert_allclose(loads.law("mount").effort, [-400.0, 0.0, 0.0, 0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(loads.law("push").force, [1.0, 2.0, 3.0], atol=1e-12)
    assert loads.law("rail").force is None
    with pytest.raises(mbs.UnknownNameError, match="'spring'"):
        loads.law("sprng")
    with pytest.raises(mbs.UnknownNameError, match="it is a law"):
        loads["spring"]


class Tooth(mbs.forces.AbstractSignal):
    """Rows that say what the gear says."""

    ratio: jax.Array

    def __call__(self, psi, t):
        return psi[0] - self.ratio * psi[1]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["coupler", "rows"])
def test_loads_of_named_rows(kind):
    """Two wheels geared 1 : 2 under a torque: the tooth's moments stand in that ratio."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name, J in (("pinion", 0.1), ("wheel", 0.4)):
        b.body(name, 1.0, inertia=J)
        b.joint(name, PIN, "ground", name)
    b.force("motor", mbs.Torque((0.0, 0.0, 6.0)), on="pinion")
    law = (
        mbs.Coupler({"pinion": 1.0, "wheel": -2.0})
        if kind == "coupler"
        else mbs.joints.PositionRows(Tooth(jnp.asarray(2.0)))
    )
    b.constraint("gear", law)
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system))
    a = 6.0 / (0.1 + 0.4 / 4.0)  # of the pinion
    gear = loads.row("gear")
    np.testing.assert_allclose(gear.efforts["pinion"], 0.1 * a - 6.0, atol=1e-9)
    np.testing.assert_allclose(gear.efforts["wheel"], 0.4 * a / 2.0, atol=1e-9)
    np.testing.assert_allclose(gear.multipliers, -15.0 / 5.0 * 1.0, atol=1e-9)
    with pytest.raises(mbs.UnknownNameError, match="'gear'"):
        loads.row("gaer")


def test_rates_and_columns_by_name():
    M, a = mbs.mass_matrix(LINKS, HELD), mbs.forward_dynamics(LINKS, HELD)[0]
    assert list(LINKS.columns("pin1")) == [1] and list(LINKS.columns("pin1", "pin0")) == [1, 0]
    np.testing.assert_array_equal(M[:, LINKS.columns("pin1")][:, 0], M[:, 1])
    np.testing.assert_array_equal(LINKS.by_joint(a)["pin1"], a[1])
    np.testing.assert_array_equal(LINKS.by_joint(M)["pin0"], M[:, 0])
    with pytest.raises(mbs.UnknownNameError, match="pin1"):
        LINKS.columns("pin2")
    with pytest.raises(ValueError, match="velocities"):
        LINKS.by_joint(np.zeros(3))
    with pytest.raises(mbs.ModelError, match="'C'"):
        four_bar().columns("C")


def test_accelerations_by_name_are_complete():
    with pytest.raises(ValueError, match="none given for 'pin1'"):
        mbs.reactions(LINKS, HELD, accelerations={"pin0": 1.0})
    with pytest.raises(mbs.UnknownNameError, match="pin1"):
        mbs.inverse_dynamics(LINKS, HELD, {"pin0": 1.0, "pin2": 1.0})
    with pytest.raises(mbs.ModelError, match="actuator"):
        mbs.reactions(LINKS, HELD, actuators=[])
