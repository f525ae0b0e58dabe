"""Beside the edge of reach, where a held crank lets the loop barely close, rows of the loop nearly vanish.

Derivatives and velocities are as large as the linearised loop says, by every solver of the rows.
"""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.constraints._linear_solver import with_linear_solver
from tests.models import four_bar

GROUND, CRANK, COUPLER, ROCKER = LENGTHS = (1.0, 0.6, 0.5, 0.4)
STOP = float(np.arccos((1.0 + CRANK**2 - (COUPLER + ROCKER) ** 2) / (2.0 * CRANK)))  # coupler and rocker in line


def slopes(crank, joint):
    """d(joint of crank and coupler) by crank, coupler and rocker length and by the crank's angle, at a pose (2,).

    The joint of coupler and rocker is at a distance of the rocker's length from the ground's pivot.
    """
    along = lambda angle: np.array([np.cos(angle), np.sin(angle)])
    from_pivot = CRANK * along(crank) + COUPLER * along(crank + joint) - (GROUND, 0.0)
    moves = lambda direction: from_pivot @ direction
    by_joint = COUPLER * moves(along(crank + joint + np.pi / 2))
    by_crank = CRANK * moves(along(crank + np.pi / 2)) + by_joint
    return -np.array([moves(along(crank)), moves(along(crank + joint)), -ROCKER, by_crank]) / by_joint


@pytest.mark.parametrize("solver", ["dense", pytest.param("frontal", marks=pytest.mark.slow)])
def test_derivatives_and_velocities_beside_the_edge(solver):
    like = four_bar(LENGTHS)

    def joint(numbers, rate=1.0):
        system = with_linear_solver(four_bar((GROUND, *numbers[:3]), like=like), solver)
        state = mbs.State.at(system, A=numbers[3], velocities={"A": rate}, guess={"B": -2.0, "D": 2.4})
        return state.coordinates[1], state.velocities

    both = mbs.jit(jax.value_and_grad(joint, has_aux=True))
    for distance in (1e-2, 1e-6, 1e-8, 1e-10):
        numbers = np.array([CRANK, COUPLER, ROCKER, STOP - distance])
        (found, rates), gradient = both(numbers)
        expected = slopes(numbers[3], float(found))
        # an angle known to rounding from a line to itself gives slopes to 1e-16 / angle^2
        np.testing.assert_allclose(gradient, expected, rtol=1e-10 + 1e-15 / distance)
        np.testing.assert_allclose(rates[1], expected[3], rtol=1e-10 + 1e-15 / distance)
