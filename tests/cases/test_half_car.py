"""F2, half car over a step of 0.05 m under the front wheel: exact matrix exponential."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import check, coordinates, run

TIMES = np.array((0.05, 0.1, 0.25, 0.5, 1.0))
# Heave, pitch (a point at x rises by heave - x * pitch), front wheel, rear wheel.
STEP = np.array(
    (
        (0.008205677638231094, -0.004524299826913377, 0.05164605834242911, 0.00028882041645762784),
        (0.024533711746993182, -0.01376852614584743, 0.058067626494158454, 0.000516394523596761),
        (0.04164964058097155, -0.02535782462899371, 0.054024669037859345, -0.0002901957364319827),
        (0.02782958959035979, -0.017391024450331586, 0.048576790169650594, 4.2527161544198565e-05),
        (0.029904866903674183, -0.01816603321526419, 0.05007826282387188, -2.6767545842979038e-05),
    )
)
NAMES = ("heave", "pitch", "tyre_front", "tyre_rear")


@pytest.mark.long
def test_road_step_under_the_front_wheel():
    system = models.half_car()
    start = dict.fromkeys(NAMES, 0.0)
    motion = run(system, mbs.State.at(system, start, velocities=start), TIMES)
    check(coordinates(system, motion, *NAMES), STEP, 1e-9)


@pytest.mark.long
def test_the_share_of_the_corners_does_not_matter():
    end = []
    for corner in (165.0, 40.0):
        system = models.half_car(corner_front=corner)
        start = dict.fromkeys(NAMES, 0.0)
        motion = run(system, mbs.State.at(system, start, velocities=start), TIMES[:1])
        end.append(coordinates(system, motion, *NAMES))
    check(end[0], end[1], 1e-10)
