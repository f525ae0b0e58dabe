"""A quarter car on a spring and Maxwell's element against its rational transfer function: in time, and its poles."""

import numpy as np
import pytest
from scipy import signal

import jaxmbs as mbs

CAR, WHEEL, SPRING, TYRE = 300.0, 40.0, 2e4, 1.8e5
STIFF, DAMPER = 1.5e4, 1200.0
TIMES, STEP = np.array([0.05, 0.1, 0.25, 0.5, 1.0]), 0.05


def quarter_car():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("wheel", mass=WHEEL)
    b.body("car", mass=CAR)
    b.joint("tyre", mbs.Prismatic("z"), "ground", "wheel")
    b.joint("suspension", mbs.Prismatic("z"), "wheel", "car")
    b.force("tyre", mbs.SpringDamper(TYRE), joint="tyre")
    b.force("spring", mbs.SpringDamper(SPRING), joint="suspension")
    b.force("rubber", mbs.forces.Maxwell(STIFF, DAMPER), joint="suspension")
    return b.build()


def transfer_function():
    """Height of the car over that of the road, of the dynamic stiffness `K = N / D` of spring and element."""
    time = DAMPER / STIFF
    D, N = np.array([time, 1.0]), np.array([(SPRING + STIFF) * time, SPRING])
    square, fourth = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    denominator = CAR * WHEEL * np.polymul(fourth, D)
    for part in (CAR * np.polyadd(N, TYRE * D), WHEEL * N):
        denominator = np.polyadd(denominator, np.polymul(square, part))
    return TYRE * N, np.polyadd(denominator, TYRE * N)


@pytest.mark.long
def test_a_step_of_the_road():
    """Seen from the raised road, the car starts a step too low."""
    system = quarter_car()
    state = mbs.State.at(system, tyre=-STEP)
    motion = mbs.simulate(system, state, ts=TIMES, rtol=1e-11, atol=1e-13)
    q = system.coordinates(motion.states)
    heights = STEP + np.asarray(q["tyre"]) + np.asarray(q["suspension"])
    residues, poles, direct = signal.residue(*np.array(transfer_function(), dtype=object))
    assert not len(direct)
    truth = [np.sum(residues / poles * (np.exp(poles * t) - 1.0)).real for t in TIMES]
    np.testing.assert_allclose(heights, STEP * np.array(truth), atol=1e-9)


@pytest.mark.long
def test_its_poles():
    system = quarter_car()
    A = np.asarray(mbs.linearise(system, mbs.State.at(system)).state_space.A)
    expected = np.roots(transfer_function()[1])
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(A)), np.sort_complex(expected), rtol=1e-9)
