"""A motor on a wheel against its linear equations."""

import jax
import numpy as np
import pytest
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs import forces as F

J, B, R, L, KT, RATIO, VOLTAGE = 0.02, 0.01, 1.5, 0.05, 0.3, 2.0, 12.0
TIMES = np.linspace(0.05, 0.5, 10)


def wheel(voltage=VOLTAGE, inductance=L):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("wheel", mass=1.0, inertia=J)
    b.joint("turn", mbs.Revolute("z"), "ground", "wheel")
    b.force("bearing", mbs.SpringDamper(damping=B), joint="turn")
    b.force("motor", F.Motor(voltage, R, inductance, KT, ratio=RATIO), joint="turn")
    return b.build()


@pytest.mark.long
def test_a_step_of_voltage():
    system = wheel()
    motion = mbs.simulate(system, mbs.State.at(system), ts=TIMES)
    whole = np.zeros((3, 3))
    whole[:2] = [[-B / J, RATIO * KT / J, 0.0], [-KT * RATIO / L, -R / L, VOLTAGE / L]]
    truth = np.array([(expm(whole * t) @ [0.0, 0.0, 1.0])[:2] for t in TIMES])
    np.testing.assert_allclose(motion.states.velocities[:, 0], truth[:, 0], atol=1e-7)
    np.testing.assert_allclose(motion.internal("motor.current"), truth[:, 1], atol=1e-7)
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-7


@pytest.mark.long
def test_poles_are_those_of_its_polynomial():
    system = wheel()
    found = mbs.linearise(system, mbs.State.at(system))
    poles = np.linalg.eigvals(np.asarray(found.state_space.A))
    poles = poles[np.abs(poles) > 1e-9]
    expected = np.roots([J * L, J * R + B * L, B * R + (RATIO * KT) ** 2])
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(expected), rtol=1e-10)


def test_power_balances():
    """Electric power in is heat, the field's energy and the work at the joint."""
    law = F.Motor(VOLTAGE, R, L, KT, ratio=RATIO)
    v, i = 3.0, {"current": 2.5}
    rate = law.rate(0.0, v, i, 0.0)
    stored = jax.jvp(lambda s: law.potential(0.0, s, 0.0), (i,), (rate,))[1]
    spent = law.dissipated(0.0, v, i, 0.0) + stored + law.effort(0.0, v, i, 0.0) * v
    np.testing.assert_allclose(spent, VOLTAGE * 2.5)


def test_faults():
    assert F.Motor(1.0, -1.0, 0.0, 1.0).faults() == ["resistance must not be negative", "inductance must be positive"]
    assert F.Motor(1.0, 1.0, 1.0, 1.0, max_torque=0.0, max_voltage=-1.0, limit_time=0.0).faults() == [
        "limit_time must be positive",
        "max_voltage must be positive",
        "max_torque must be positive",
    ]


def test_torque_and_speed_are_limited():
    """Steady torque: its limit at low speeds, beyond them what the voltage limit leaves; none at the idle speed."""
    law = F.Motor(1e3, R, L, KT, ratio=RATIO, max_voltage=24.0, max_torque=1.5)
    idle = 24.0 / (KT * RATIO)
    for v, current in ((0.0, 5.0), (25.0, 5.0), (35.0, (24.0 - KT * RATIO * 35.0) / R), (idle, 0.0)):
        np.testing.assert_allclose(law.rate(0.0, v, {"current": current}, 0.0)["current"], 0.0, atol=1e-9)
        torque = law.effort(0.0, v, {"current": current}, 0.0)
        np.testing.assert_allclose(torque, RATIO * min(1.5, KT * (24.0 - KT * RATIO * v) / R), atol=1e-12)
    free = F.Motor(1e3, R, L, KT, ratio=RATIO)
    assert free.voltage_at(0.0, {"current": 0.0}, 0.0) == 1e3
    assert (
        law.voltage_at(0.0, {"current": 9.0}, 0.0) == -24.0
    )  # too much current falls as fast as the voltage lets it
    slope = jax.grad(lambda most: law_of(most).rate(0.0, 35.0, {"current": 1.0}, 0.0)["current"])(24.0)
    np.testing.assert_allclose(slope, 1.0 / L)


def law_of(most):
    return F.Motor(1e3, R, L, KT, ratio=RATIO, max_voltage=most, max_torque=1.5)


@pytest.mark.long
def test_a_start_at_the_limits():
    """The current rises to its limit and stays; the wheel speeds up evenly."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("wheel", mass=1.0, inertia=0.5)
    b.joint("turn", mbs.Revolute("z"), "ground", "wheel")
    b.force("motor", F.Motor(60.0, R, L, KT, ratio=RATIO, max_torque=1.5), joint="turn")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 0.5, 51), rtol=1e-8, atol=1e-8)
    current, speed = np.asarray(motion.internal("motor.current")), np.asarray(motion.states.velocities[:, 0])
    assert current.max() < 5.0 + 1e-6
    np.testing.assert_allclose(current[20:], 5.0, atol=1e-6)
    np.testing.assert_allclose(np.diff(speed[20:]) / 0.01, RATIO * 1.5 / 0.5, rtol=1e-6)
