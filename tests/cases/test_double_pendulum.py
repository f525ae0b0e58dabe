"""D1, double pendulum of two points: Landau-Lifshitz; heyoka Taylor series, tolerance 1e-17."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import check, coordinates, rates, run

TIMES = np.array((0.5, 1.0, 2.0, 5.0))
ANGLES = np.array(
    (
        (0.5704720512329923, 1.2038751111582442),
        (-0.6250876998063905, -1.034585085680012),
        (-0.4829715342517534, -1.3240487123023623),
        (-0.6271867050665277, -1.30131555020981),
    )
)
RATES = np.array(
    (
        (-2.789645766167374, -3.1880627466512097),
        (-3.9222795728879754, -1.3030992486963324),
        (3.0652881920733988, 2.9492715475716227),
        (2.1254086738428977, 3.8818887272656286),
    )
)
TOLERANCE = np.array([[1e-9], [1e-9], [1e-9], [1e-7]])  # mildly chaotic: nothing beyond 5 s


@pytest.mark.long
def test_double_pendulum():
    system = models.double_pendulum()
    motion = run(system, mbs.State.at(system, shoulder=np.pi / 2, elbow=0.0), TIMES, rtol=1e-12, atol=1e-12)
    absolute = np.cumsum(coordinates(system, motion, "shoulder", "elbow"), axis=1)
    check(absolute, ANGLES, TOLERANCE)
    check(np.cumsum(rates(system, motion, "shoulder", "elbow"), axis=1), RATES, TOLERANCE)
