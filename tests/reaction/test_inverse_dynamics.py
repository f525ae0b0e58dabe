"""Efforts of chosen actuators in closed loops: against drives, virtual work and the least norm in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, four_bar_builder

LENGTHS = 1.0, 0.3, 0.9, 0.7  # ground, crank, coupler, rocker


def four_bar(mass=1.0, like=None, **drives):
    rod = lambda mass, length: mbs.inertia.rod(1.0, length)
    return four_bar_builder(LENGTHS, 3 * [mass], rod, **drives).build(like=like)


@pytest.fixture(scope="module")
def driven():
    return four_bar(A=mbs.forces.Polynomial((0.7, 3.0, -1.0)))


@pytest.fixture(scope="module")
def motion(driven):
    start = mbs.State.at(driven, guess={"B": -0.2, "D": 1.2})
    return mbs.simulate(driven, start, ts=np.linspace(0.0, 0.5, 4))


@pytest.mark.long
def test_one_actuator_is_the_drive(driven, motion):
    found = mbs.inverse_dynamics(driven, motion, actuators=["A"])
    assert np.all(found.ok)
    np.testing.assert_allclose(found["A"], mbs.reactions(driven, motion)["A"].effort, rtol=1e-8)


@pytest.mark.long
def test_another_actuator_gives_the_same_power(driven, motion):
    effort = mbs.reactions(driven, motion)["A"].effort[:, 0]
    u = driven.velocities(motion.states)
    found = mbs.inverse_dynamics(driven, motion, actuators=["D"])
    np.testing.assert_allclose(found["D"][:, 0] * u["D"], effort * u["A"], rtol=1e-8)


@pytest.mark.long
def test_two_actuators_share_by_the_least_norm(driven, motion):
    effort, u = mbs.reactions(driven, motion)["A"].effort[:, 0], driven.velocities(motion.states)
    found, ratio = mbs.inverse_dynamics(driven, motion, actuators=["A", "D"]), u["D"] / u["A"]
    assert np.all(found.ok)
    np.testing.assert_allclose(found["A"][:, 0], effort / (1.0 + ratio**2), rtol=1e-7)
    np.testing.assert_allclose(found["D"][:, 0], effort * ratio / (1.0 + ratio**2), rtol=1e-7)


@pytest.mark.long
def test_accelerations_given():
    """Of a state at rest held where it is: the actuator carries the weights."""
    state = mbs.State.at(four_bar(), A=0.7, guess={"B": -0.2, "D": 1.2})
    found = mbs.inverse_dynamics(four_bar(), state, np.zeros(3), ["A"])

    def potential(angle):
        system = four_bar()
        return mbs.dynamics.potential_energy(system, mbs.State.at(system, A=angle, guess={"B": -0.2, "D": 1.2}))

    slope = (potential(0.7 + 1e-5) - potential(0.7 - 1e-5)) / 2e-5
    np.testing.assert_allclose(found["A"][0], slope, rtol=1e-6)


@pytest.mark.long
def test_too_few_actuators_are_said():
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for k in range(2):
        b.body(f"link{k}", 1.0, (0.5, 0.0, 0.0), (0.01, 0.1, 0.1))
        b.joint(f"pin{k}", PIN, f"link{k - 1}" if k else "ground", f"link{k}", parent_frame=(float(k > 0), 0.0, 0.0))
    system = b.build()
    state = mbs.State.at(system, pin0=0.3, pin1=0.4)
    short, enough = (
        mbs.inverse_dynamics(system, state, np.zeros(2), names) for names in (["pin1"], ["pin0", "pin1"])
    )
    assert not short.ok and short.gap > 0.1 and enough.ok
    np.testing.assert_allclose(
        np.concatenate(list(enough.efforts.values())), mbs.inverse_dynamics(system, state, np.zeros(2)), rtol=1e-9
    )


@pytest.mark.long
def test_slope_by_a_mass(driven, motion):
    state = motion.states

    def torque(mass):
        system = four_bar(mass, like=driven, A=mbs.forces.Polynomial((0.7, 3.0, -1.0)))
        return mbs.inverse_dynamics(system, state, actuators=["A", "D"])["D"][1, 0]

    value, slope = jax.jit(lambda m: (torque(m), jax.grad(torque)(m)))(1.0)
    steps = jax.jit(jax.vmap(torque))(jnp.array([1.0 + 1e-5, 1.0 - 1e-5]))
    np.testing.assert_allclose(slope, (steps[0] - steps[1]) / 2e-5, rtol=1e-6)
    assert np.isfinite(value)


@pytest.mark.long
def test_faults(driven, motion):
    with pytest.raises(mbs.UnknownNameError, match="AA"):
        mbs.inverse_dynamics(driven, motion, actuators=["AA"])
    with pytest.raises(mbs.ModelError, match="'C'.*cut the loop at another joint"):
        mbs.inverse_dynamics(driven, motion, actuators=["C"])
    with pytest.raises(TypeError, match="acceleration"):
        mbs.inverse_dynamics(driven, motion.end)
    with pytest.raises(mbs.UnknownNameError, match="actuator"):
        mbs.inverse_dynamics(driven, motion, actuators=["A"])["D"]
