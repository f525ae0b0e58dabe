"""Flow and torque of a pump, at a given speed and on a shaft."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import hydraulics as H


def test_power_of_the_shaft_is_that_of_the_oil_without_leakage():
    pump = H.Pump(displacement=1e-5, leakage=2e-12)
    flow = pump.output(jnp.array([1e5, 2e7, 150.0]), {}, 0.0)
    np.testing.assert_allclose(flow, 1e-5 * 150.0 - 2e-12 * 1.99e7)
    ideal = H.Pump(1e-5)
    np.testing.assert_allclose(ideal.torque(-1.99e7) * 150.0, ideal.flow(-1.99e7, 150.0) * 1.99e7)


def test_faults():
    assert len(H.Pump(0.0, -1.0, -1.0).faults()) == 3


def test_torque_of_a_shaft_with_drag():
    np.testing.assert_allclose(H.Pump(1e-5, drag=0.02).torque(-1e7, 50.0), 1e-5 * 1e7 + 0.02 * 50.0)


DRIVE, MOTOR, LOAD = H.Pump(5e-6, 2e-12, 0.01), H.Pump(8e-6, 3e-12, 0.02), 0.3


def transmission(drive, motor, like=None):
    """A pump at 100 rad/s that drives a motor, whose shaft turns a damper."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("rotor", mass=1.0, inertia=0.05)
    b.joint("turn", mbs.Revolute("z"), "ground", "rotor")
    b.force("load", mbs.SpringDamper(damping=LOAD), joint="turn")
    b.hydraulic("tank", H.Tank())
    b.hydraulic("pressure", H.Volume(1e-3, pressure=1e5))
    b.hydraulic("pump", drive, ports={"a": "tank", "b": "pressure"}, signal=100.0)
    b.hydraulic("motor", motor, ports={"a": "pressure", "b": "tank"}, shaft="turn")
    return b.build(like=like)


def steady_speed(drive, motor):
    """From `D1 w1 = D2 w + (L1 + L2) p` and `D2 p = (drag + load) w`."""
    resistance = motor.drag + LOAD
    slip = (drive.leakage + motor.leakage) * resistance / motor.displacement
    return drive.displacement * 100.0 / (motor.displacement + slip)


@pytest.mark.long
def test_a_hydraulic_motor_reaches_its_steady_speed():
    system = transmission(DRIVE, MOTOR)
    ts = np.array([0.0, 5.0])

    def speed(leakage, drag):
        made = transmission(DRIVE, H.Pump(8e-6, leakage, drag), like=system)
        motion = mbs.simulate(made, mbs.State.at(made), ts=ts, rtol=1e-9, atol=1e-9)
        return motion.states.velocities[-1, 0], motion

    (found, motion), slope = mbs.jit(jax.value_and_grad(speed, 1, has_aux=True))(3e-12, 0.02)
    np.testing.assert_allclose(found, steady_speed(DRIVE, MOTOR), rtol=1e-7)
    h = 1e-4
    ends = [steady_speed(DRIVE, H.Pump(8e-6, 3e-12, 0.02 + sign * h)) for sign in (1, -1)]
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * h), rtol=1e-5)
    p = motion.internal("pressure.p")[-1]
    np.testing.assert_allclose(8e-6 * p, (0.02 + LOAD) * found, rtol=1e-6)
    work = motion.diagnostics.work["motor shaft"]
    assert motion.ok and work[-1] > 0.0 and np.abs(motion.diagnostics.energy_residual[-1]) < 1e-6 * work[-1]
    flow, torque = mbs.signals(system, jax.tree.map(lambda x: x[-1], motion.states))["motor"]
    np.testing.assert_allclose([flow, torque], [8e-6 * found + 3e-12 * p, 8e-6 * p - 0.02 * found], rtol=1e-9)


def test_faults_of_a_shaft():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("rotor", mass=1.0, inertia=0.05)
    b.joint("float", mbs.Free(), "ground", "rotor")
    b.measure("both speed", joint="float", of="velocity")
    for name in ("one", "two"):
        b.hydraulic(name, H.Volume(1e-3))
    ports = {"a": "one", "b": "two"}
    b.hydraulic("slit", H.Orifice(1e-6), ports, shaft="float")
    b.hydraulic("both", H.Pump(1e-6), ports, signal=1.0, shaft="float")
    b.hydraulic("lost", H.Pump(1e-6), ports, shaft="flaot")
    b.hydraulic("tank", H.Tank(), shaft="float")
    expected = [
        "'slit': shaft= goes with a Pump, not with a Orifice",
        "'both': give its speed as a signal, or the joint of its shaft, not both",
        "'both': shaft: joint 'float' does not have exactly one coordinate",
        "'both': its shaft needs the name 'both speed'",
        "'lost': shaft: there is no joint 'flaot'",
        "'tank': a node is on no shaft",
    ]
    with pytest.raises(mbs.ModelError) as caught:
        b.build()
    for part in expected:
        assert part in str(caught.value), part
