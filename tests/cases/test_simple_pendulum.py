"""A01, simple pendulum: IFToMM benchmark (Gonzalez et al. 2006); elliptic functions with 30 digits."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, coordinates, rates, run

PERIOD = 2.3678419475762373
TIMES = np.array([0.5, 1.0, PERIOD, 2.5, 5.0, 10.0])
SAVED = [0, 1, 3, 4, 5]  # the rows with printed values, at 0.5, 1, 2.5, 5 and 10 s
POSITION = np.array(
    (
        (-0.3910487915505464, -0.9203699487851922),
        (0.9862917511318753, -0.16501085312554117),
        (-0.9963344039582815, -0.0855438804888806),
        (-0.9423054350437573, -0.3347543384140006),
        (-0.2750874625761169, -0.961419205099125),
    )
)
RATE = np.array((4.249430361256138, 1.7993090169070787, 1.295519561871544, 2.5627875681926295, 4.343160692864683))
TENSION = np.array((27.086487592748206, 4.856269407484676, 2.5175564027877564, 9.851820179524037, 28.29456720606725))


@pytest.mark.long
def test_pendulum_follows_the_elliptic_functions():
    system = models.simple_pendulum()
    state = mbs.State.at(system, pivot=-np.pi / 2)
    motion = run(system, state, TIMES, rtol=1e-12, atol=1e-12)
    check(along(mbs.position, system, motion, "tip")[SAVED, :2], POSITION, 1e-9)
    check(rates(system, motion, "pivot")[SAVED, 0], RATE, 1e-8)
    force = np.asarray(mbs.reactions(system, motion)["pivot"].force)
    check(np.linalg.norm(force[SAVED], axis=1), TENSION, 1e-7)
    # Back at the turning point: the rate over the acceleration is the error in time.
    check(coordinates(system, motion, "pivot")[2, 0], -np.pi / 2, 1e-10)
    check(rates(system, motion, "pivot")[2, 0] / 9.81, 0.0, 1e-10)


def test_tension_pulls_the_bob_towards_the_pivot():
    system = models.simple_pendulum()
    state = mbs.State.at(system, pivot=0.3, velocities={"pivot": 1.5})
    force = np.asarray(mbs.reactions(system, state)["pivot"].force)
    tension = 9.81 * np.cos(0.3) + 1.5**2
    check(force, tension * np.array([-np.sin(0.3), np.cos(0.3), 0.0]), 1e-12)
