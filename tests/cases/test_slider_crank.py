"""C1, planar slider-crank, driven and free: closed-form inverse dynamics (Norton, Shigley)."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, coordinates, rates, run

pytestmark = pytest.mark.long

OMEGA, START = 50.0, 0.4
TIMES = np.array([0.0, 0.02, 0.05, 0.1])
SLIDER_X = np.array((0.6347353773677106, 0.5031455698828842, 0.3530667068064385, 0.581582167492043))
SLIDER_ACCELERATION = np.array((-425.6474948454661, 46.8963108300831, 263.68013290574834, -218.18151967656706))
FORCES = {  # x and y, of the parent on the child
    "main": (
        (-2055.2265757835958, 0.19606482662214297),
        (285.6049575801878, -584.6498589252576),
        (1837.2954307127475, -190.8099724017561),
        (-1053.541804271849, 248.3420401289314),
    ),
    "crank_pin": (
        (-1847.9878521329465, 76.04319184606851),
        (323.847564732742, -374.69566967785414),
        (1618.8298435540896, -148.75087332861006),
        (-910.7359071847563, 62.69803042883427),
    ),
    "wrist": (
        (-1076.9424845363983, 202.45507021181245),
        (340.6889324902493, -24.772020932181583),
        (991.040398717245, -78.65237487336665),
        (-454.5445590297012, -246.70865240466094),
    ),
}
GUIDE = np.array((-173.02507021181245, 54.20202093218158, 108.08237487336666, 276.13865240466095))
TORQUE = np.array((119.26532232955927, -57.27315315786412, -37.28822083656242, -99.03818566467768))
SHAKING = np.array(
    (
        (2255.2265757835958, 233.65100538519033),
        (-85.60495758018779, 591.2698379930761),
        (-1637.2954307127475, 143.54959752838946),
        (1253.541804271849, -463.65869253359233),
    )
)
FREE_TIMES = np.array((0.1, 0.25, 0.5, 1.0))
FREE_ANGLE = np.array((0.6795678819016574, 0.6343730906807451, -1.1325023760573416, -3.615675498623736))
FREE_RATE = np.array((1.2785486443665872, -1.9754619882670201, -7.621326428003572, 4.956809626657449))


@pytest.fixture(scope="module")
def driven():
    system = models.slider_crank(drive=lambda t: START + OMEGA * t, gas_force=-200.0)
    state = mbs.State.at(system, guess={"main": START} | models.slider_crank_guess(START))
    motion = run(system, state, TIMES)
    return system, motion, mbs.reactions(system, motion)


def test_prescribed_motion(driven):
    system, motion, _ = driven
    check(coordinates(system, motion, "main")[:, 0], START + OMEGA * TIMES, 1e-12)
    check(along(mbs.position, system, motion, "slider")[:, 0], SLIDER_X, 1e-9)
    check(along(mbs.dynamics.acceleration, system, motion, "slider")[:, 0], SLIDER_ACCELERATION, 1e-6)


def test_pin_forces_and_drive(driven):
    _, _, loads = driven
    for name, expected in FORCES.items():
        check(np.asarray(loads[name].force)[:, :2], np.array(expected), 1e-5)
        assert np.all(np.asarray(loads[name].unique_force)[..., :2])
    check(np.asarray(loads["slide"].force)[:, 1], GUIDE, 1e-5)
    check(np.asarray(loads["main"].effort)[:, 0], TORQUE, 1e-6)


def test_shaking_force(driven):
    system, motion, _ = driven
    masses = {"crank_com": 1.2, "rod_com": 2.0, "slider": 3.0}
    inertia = sum(m * along(mbs.dynamics.acceleration, system, motion, name) for name, m in masses.items())
    check(-inertia[:, :2], SHAKING, 1e-5)


def test_free_run():
    system = models.slider_crank()
    state = mbs.State.at(system, main=START, velocities={"main": 5.0}, guess=models.slider_crank_guess(START))
    motion = run(system, state, FREE_TIMES)
    check(coordinates(system, motion, "main")[:, 0], FREE_ANGLE, 1e-8)
    check(rates(system, motion, "main")[:, 0], FREE_RATE, 1e-7)


def test_drive_balances_what_would_accelerate_the_free_mechanism(driven):
    """In the same state: effective inertia times the free acceleration is minus the torque."""
    _, motion, loads = driven
    system = models.slider_crank(gas_force=-200.0)
    angle = START + OMEGA * TIMES[1]
    guess = models.slider_crank_guess(angle)
    state = mbs.State.at(system, main=angle, velocities={"main": OMEGA}, guess=guess)
    accelerations, _ = mbs.forward_dynamics(system, state)
    speed = np.asarray(mbs.kinematics.jacobian(system, state, "crank"))[5]
    effort = speed @ np.asarray(accelerations) * _effective_inertia(system, state)
    check(effort, -np.asarray(loads["main"].effort)[1, 0], 1e-6)


def _effective_inertia(system, state):
    """Twice the kinetic energy over the square of the crank's rate [kg m^2]."""
    return 2.0 * float(jax.jit(lambda s: mbs.dynamics.kinetic_energy(system, s))(state)) / OMEGA**2
