"""F1, quarter car over a road step of 0.05 m: exact matrix exponential."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import check, coordinates, rates, run

TIMES = np.array((0.05, 0.1, 0.25, 0.5, 1.0))
# Heights of car and wheel from the static position, then their rates.
STEP = np.array(
    (
        (0.007162626626979312, 0.07586600173881987, 0.32132053090583207, 0.5042979806723442),
        (0.022739691335240977, 0.03353590352778538, 0.245078040881102, -0.5676361751570328),
        (0.06286072795764268, 0.05261723780451448, 0.21583306706631536, 0.32394900825237993),
        (0.07222080261735234, 0.051820147220267516, -0.11852609656249766, -0.031414016299282026),
        (0.04162409749007016, 0.049682662676143616, 0.07656654182444661, 0.007474502056114759),
    )
)


@pytest.mark.long
def test_road_step():
    system = models.quarter_car()
    state = mbs.State.at(system, tyre=0.0, suspension=0.0)
    motion = run(system, state, TIMES, rtol=1e-13, atol=1e-13)  # interpolated between steps: 9 Hz
    heights = np.cumsum(coordinates(system, motion, "tyre", "suspension"), axis=1)[:, ::-1]
    speeds = np.cumsum(rates(system, motion, "tyre", "suspension"), axis=1)[:, ::-1]
    check(np.concatenate([heights, speeds], axis=1), STEP, 1e-9)
