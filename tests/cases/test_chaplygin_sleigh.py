"""E3, Chaplygin's sleigh: closed form (Caratheodory 1933)."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, run

TIMES = np.array((0.5, 1.0, 2.0, 4.0))
# Forward speed, yaw rate, heading.
MOTION = np.array(
    (
        (1.302619987295721, 0.8711958333172193, 0.6909172230485268),
        (1.3545146703794606, 0.3429693031678587, 0.9750545723231447),
        (1.3636105968739032, 0.05131481010197185, 1.128724343448237),
        (1.3638180670506332, 0.001141166833495325, 1.155091233342027),
    )
)
CONTACT = np.array(
    (
        (0.5363889854634197, 0.23155875804722179),
        (0.9730268164845302, 0.7343080163681891),
        (1.6201586614079901, 1.9306596293746472),
        (2.737392989568389, 4.4188591322339725),
    )
)
SIDE_FORCE = np.array((0.791746817670531, 0.32410950183536186, 0.04881866430113081, 0.0010858213570045716))


@pytest.mark.long
def test_sleigh():
    system = models.chaplygin_sleigh()
    state = mbs.State.at(system, plane=np.zeros(3), velocities={"plane": np.array((1.0, 0.0, 2.0))})
    motion = run(system, state, TIMES)
    place = along(mbs.position, system, motion, "sleigh")[:, :2]
    velocity = along(mbs.velocity, system, motion, "sleigh")
    turning = along(mbs.kinematics.angular_velocity, system, motion, "sleigh")[:, 2]
    ahead = along(mbs.rotation, system, motion, "sleigh")[:, :, 0]
    heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    check(np.stack([np.sum(ahead * velocity, axis=1), turning, heading], axis=1), MOTION, 1e-9)
    check(place, CONTACT, 1e-8)
    check(mbs.reactions(system, motion, frame="joint")["blade"].force[:, 1], SIDE_FORCE, 1e-8)
