"""A04, Bricard's mechanism: IFToMM benchmark (Gonzalez et al. 2006); one equation by SciPy's DOP853."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import bricard, models
from .reading import along, check, run

TIMES = np.array([0.0, 0.5, 1.0, 2.0, 5.0, 10.0])


@pytest.mark.parametrize("a", [-1.0, 0.2, 1.2, 2.0])
def test_reference_closes_its_loop(a):
    places, velocities = bricard.corners(a, np.arccos(1.0 / (1.0 + np.cos(a)) - 1.0))
    check(places[-1], np.array([0.0, 0.0, 1.0]), 1e-14)
    check(velocities[-1], np.zeros(3), 1e-14)
    check(np.linalg.norm(np.diff(places, axis=0), axis=1), np.ones(5), 1e-14)


def test_one_freedom_and_one_redundant_row():
    system = models.bricard()
    state = mbs.State.at(system, corner_0=0.1)
    singular = np.linalg.svd(np.asarray(mbs.constraints.constraint_jacobian(system, state)), compute_uv=False)
    assert singular.shape == (5,) and singular[3] > 0.1 and singular[4] < 1e-12
    assert system.topology.mobility == mbs.constraints.count_mobility(system, state).mobility == 1


@pytest.mark.long
def test_p3_follows_the_one_equation():
    system = models.bricard()
    motion = run(system, mbs.State.at(system), TIMES, rtol=1e-9, atol=1e-9)
    check(along(mbs.position, system, motion, "P3"), bricard.path_of_p3(TIMES), 1e-8)
    check(motion.diagnostics.energy_residual, np.zeros(len(TIMES)), 1e-9)  # of 27 J of kinetic energy
