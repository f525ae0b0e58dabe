"""F4, car axis: Test Set for IVP Solvers `caraxis` (index 3), 20 digits at 3 s."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, run

TIMES = np.array([0.5, 1.0, 2.0, 3.0])
POSITIONS = np.array(
    (
        (0.047887818061671514, 0.4970896871808234, 1.0435771499755144, 0.40433865315452083),
        (0.027182095440113328, 0.4989115526292634, 1.0245487959703936, 0.42638800698133433),
        (-0.04560448364285901, 0.49744534321896555, 0.9517407605927853, 0.5702633615973456),
    )
)
END = np.array(
    (
        0.04934557842754028,
        0.49698946023017115,
        1.0417425248854215,
        0.37391102726536124,
        -0.07705836840409723,
        0.007446866587237785,
        0.017556815753723223,
        0.7703410437792519,
    )
)
MULTIPLIERS = np.array((-0.004736886590848933, -0.0011046803312573436))


def _motion(system):
    """Motion from the test set's start; a planar joint has x, y and an angle, which stays zero."""
    rates = {"left": np.array([-0.5, 0.0, 0.0]), "right": np.array([-0.5, 0.0, 0.0])}
    state = mbs.State.at(system, left=np.array([0.0, 0.5, 0.0]), right=np.array([1.0, 0.5, 0.0]), velocities=rates)
    return run(system, state, TIMES, rtol=1e-12, atol=1e-12)


def _ends(function, system, motion):
    """x and y of the left, then of the right end, (T, 4)."""
    left, right = (along(function, system, motion, name)[:, :2] for name in ("left", "right"))
    return np.concatenate([left, right], axis=1)


WHEEL = pytest.param(models.car_axis_with_wheel, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    "build",
    [
        pytest.param(models.car_axis, marks=pytest.mark.long),
        pytest.param(models.car_axis_with_wheel, marks=pytest.mark.long),
    ],
)
def test_motion(build):
    system = build()
    motion = _motion(system)
    positions, velocities = (_ends(f, system, motion) for f in (mbs.position, mbs.velocity))
    check(positions[:3], POSITIONS, 1e-8)
    check(np.concatenate([positions[3], velocities[3]]), END, 1e-9)


@pytest.mark.long
def test_multipliers():
    system = models.car_axis()
    last = jax.tree.map(lambda leaf: leaf[-1], _motion(system).states)
    _, multipliers = mbs.forward_dynamics(system, last)
    check(multipliers, MULTIPLIERS, 1e-9)  # M a = Q + A^T lambda, rows as the test set writes them
