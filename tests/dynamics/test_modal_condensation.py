"""A loop of elastic bodies without a matrix, beside the dense one."""

import numpy as np
import pytest

import jaxmbs as mbs
from tests.flexible.beams import arch_of_beams

pytestmark = pytest.mark.long
SOLVERS = ("dense", "multifrontal")


# of 25 parts the dense accelerations are wrong by 1e-8 themselves (condition of the mass matrix 6e8), these by 1e-9
@pytest.mark.parametrize("parts, tolerance", [(6, 1e-9), (25, 3e-8)])
def test_accelerations(parts, tolerance):
    a, b = (np.asarray(mbs.forward_dynamics(*arch_of_beams(parts, solver))[0]) for solver in SOLVERS)
    np.testing.assert_allclose(a, b, atol=tolerance * np.max(np.abs(a)), rtol=0)


def test_motions_and_reactions():
    times, found = np.linspace(0.0, 0.1, 5), []
    for solver in SOLVERS:
        system, state = arch_of_beams(4, solver)
        motion = mbs.simulate(system, state, ts=times, rtol=1e-9, atol=1e-9)
        assert motion.ok
        found.append([np.asarray(motion.states.coordinates), np.asarray(mbs.reactions(system, motion)["end"].force)])
    # errors of the coordinates reach the reactions through the stiffness of the beams
    for a, b, tolerance in zip(*found, (1e-7, 3e-5), strict=True):
        np.testing.assert_allclose(a, b, atol=tolerance * np.max(np.abs(a)), rtol=0)
