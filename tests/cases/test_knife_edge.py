"""E2, a skate on an incline: closed form (Neimark and Fufaev)."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, run

TIMES = np.array((0.5, 1.0, 2.0, 5.0))
PLACE = np.array(
    (
        (0.5064482250911018, 0.2738652323007903),
        (1.0845459106472426, 1.5580895956073721),
        (0.021707193775550516, 3.422281446518414),
        (0.9590299125080576, 7.820593127114371),
    )
)
SPEED = np.array((2.2289587452763024, 3.261808606195258, 0.46146242635576573, 3.067259924053396))
SIDE_FORCE = np.array((6.6868762358289064, 9.785425818585773, 1.384387279067297, 9.201779772160187))


@pytest.mark.long
def test_skate_on_an_incline():
    system = models.knife_edge_incline()
    state = mbs.State.at(system, plane=np.zeros(3), velocities={"plane": np.array((0.0, 0.0, 1.5))})
    motion = run(system, state, TIMES)
    place = along(mbs.position, system, motion, "skate")[:, :2]
    velocity = along(mbs.velocity, system, motion, "skate")[:, :2]
    heading = 1.5 * TIMES
    ahead, side = (np.cos(heading), np.sin(heading)), (-np.sin(heading), np.cos(heading))
    check(place, PLACE, 1e-9)
    check(ahead[0] * velocity[:, 0] + ahead[1] * velocity[:, 1], SPEED, 1e-9)
    force = np.asarray(mbs.reactions(system, motion)["blade"].force)[:, :2]
    check(side[0] * force[:, 0] + side[1] * force[:, 1], SIDE_FORCE, 1e-8)
