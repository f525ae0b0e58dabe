"""A05, stiff flyball governor: IFToMM benchmark (Gonzalez et al. 2006); hand Lagrangian, SciPy's Radau."""

import diffrax
import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import check, coordinates, rates, run

TIMES = np.array([0.1, 0.5, 1.0, 2.0, 5.0, 10.0])
COORDINATES = np.array(
    (
        (0.6221066814028137, 0.5238364755695121, 0.4961738690759699),
        (2.807679488367879, 0.7432494247867023, 0.259491381543068),
        (5.586346965869004, 0.5014209223795909, 0.5218333016255142),
        (11.173267075661292, 0.5059092942967612, 0.5166637973645227),
        (27.942531991042713, 0.5355631037215504, 0.48287457658703026),
        (55.935409909102304, 0.6196229170613065, 0.39007370184470924),
    )
)
RATES = np.array(
    (
        (6.10371780883109, 0.4592718104368759, -0.5226739297550282),
        (5.103415421972626, 0.0521197801582631, -0.05390521849872299),
        (6.271125741876149, -0.12215149289776235, 0.14088557947933394),
        (6.236223614435091, -0.2407831469832521, 0.2769261885715922),
        (6.022496499758332, -0.5436826902785364, 0.6139170473900423),
        (5.548203622655198, -0.7476033541645671, 0.8084670513456637),
    )
)
# Slider height when the shaft starts at 0.16 turns per second, as in Exudyn's model.
SLOW_HEIGHT = np.array(
    (
        0.46290643215354305,
        0.017351751070889487,
        0.49709481850142095,
        0.48847400849528827,
        0.42989908967870644,
        0.24916533236667285,
    )
)
STIFF = {"solver": diffrax.Kvaerno5(), "rtol": 1e-11, "atol": 1e-11}


def _start(system, shaft_rate):
    still = {"slide": 0.0, "right": 0.0, "left": 0.0}
    return mbs.State.at(
        system, spin=0.0, slide=0.5, right=np.pi / 6, left=np.pi / 6, velocities={"spin": shaft_rate} | still
    )


def test_first_accelerations_from_the_lagrangian():
    system = models.flyball_governor()
    accelerations, _ = mbs.forward_dynamics(system, _start(system, 2 * np.pi))
    angle, across, axial = np.pi / 6, 0.3 * (1.0 + 1e-4) / 12, 0.3 * 2e-4 / 12
    inertia = across + 0.3 / 4 + 5.0  # of a rod with its tip about the hinge
    arm = 0.3 * (0.05 + 0.5 * np.cos(angle)) * 0.5 + 5.0 * (0.05 + np.cos(angle))
    spin = -((2 * np.pi) ** 2) * np.sin(angle) * (arm + (across - axial) * np.cos(angle))
    rod = (9.81 * (0.15 + 5.0) * np.cos(angle) + spin) / inertia
    check(np.sort(accelerations), np.sort([0.0, -9.81, rod, rod]), 1e-9)  # the springs are just at rest


@pytest.mark.long
def test_one_turn_per_second():
    system = models.flyball_governor()
    motion = run(system, _start(system, 2 * np.pi), TIMES, **STIFF)
    check(coordinates(system, motion, "spin", "slide", "right"), COORDINATES, np.array([[1e-7, 1e-9, 1e-9]]))
    check(rates(system, motion, "spin", "slide", "right"), RATES, np.array([[1e-8, 1e-7, 1e-7]]))
    check(coordinates(system, motion, "left"), COORDINATES[:, 2:], 1e-9)


@pytest.mark.long
def test_slow_shaft():
    system = models.flyball_governor()
    motion = run(system, _start(system, 0.16 * 2 * np.pi), TIMES, **STIFF)
    check(coordinates(system, motion, "slide")[:, 0], SLOW_HEIGHT, 1e-9)
