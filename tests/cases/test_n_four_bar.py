"""A02, N four-bars through every singular pose: IFToMM (Gonzalez et al. 2006; Bayo and Avello 1994)."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, run

TIMES = np.array([0.0, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0])
POINT = {  # x, y, vx, vy of B0 from 0.5 s on
    2: (
        (0.695286633164428, 0.7187325634357151, 1.9602054253717989, -1.8962611405866883),
        (-0.19502030194953127, -0.9807992056621547, -6.676678036881042, 1.3275783251611446),
        (0.05781579576788988, 0.9983272678634625, 1.0172601366199778, -0.05891224871329481),
        (-0.5493397393005934, -0.8355990969508978, -5.480464031253702, 3.6029678504452733),
        (-0.811310461002483, -0.5846155453526176, -3.5691173972193178, 4.953105171302681),
        (0.3284581115364366, 0.9445185381801237, 1.423051470197142, -0.4948688454762392),
    ),
    10: (
        (0.6892024936420964, 0.7245687840070921, 1.934596208570409, -1.8401683326233667),
        (-0.12930601505121714, -0.9916047370154977, -6.675281838562867, 0.8704618500373666),
        (0.038567666597042284, 0.9992559907717639, 1.0074937052842634, -0.03888561257862637),
        (-0.37731258007107893, -0.9260859662688479, -6.133120706896435, 2.4987999841201094),
        (-0.5955452554754298, -0.8033217591231455, -5.151756230657567, 3.819271600314976),
        (0.20435356098645713, 0.9788971458289958, 1.1866800237479758, -0.24773010079524255),
    ),
}
REACTIONS = {  # of the ground on the cranks at A0, A1 and the last, x and y, at 0.3 and 0.5 s
    2: (
        (
            (2.983149644701551, 11.071506341122337),
            (4.122336959112607, 14.1547595116835),
            (2.983149644701566, 11.071506341122314),
        ),
        (
            (0.8112758776192379, 3.8361331095159867),
            (0.29427630128653387, 3.3016996642739715),
            (0.8112758776192249, 3.8361331095160365),
        ),
    ),
    10: (
        (
            (2.9847667439819756, 11.168389253269524),
            (4.136245198064719, 14.300083879904323),
            (2.984766743982103, 11.168389253269652),
        ),
        (
            (1.1548630733901946, 4.264795376497312),
            (0.8503849943601804, 3.944693064745971),
            (1.1548630733902223, 4.2647953764974185),
        ),
    ),
}
AT_REST = ((0.0, 13.715), (0.0, 18.12))  # the same at A0 and A1 at the start, all cranks up


@pytest.mark.long
@pytest.mark.parametrize("n", [2, 10])
def test_windows_fall_as_one_pendulum(n):
    system = models.n_four_bar(n)
    state = mbs.State.at(system, A0=0.0, velocities={"A0": -1.0})
    motion = run(system, state, TIMES, rtol=1e-10, atol=1e-10)
    position = along(mbs.position, system, motion, "B0")[:, :2]
    velocity = along(mbs.velocity, system, motion, "B0")[:, :2]
    expected = np.array(POINT[n])
    check(position[2:], expected[:, :2], 1e-8)
    # rounding grows at every singular pose, to 1e-8 m/s and more at any tolerance; the largest speed is 6.7 m/s
    check(velocity[2:], expected[:, 2:], 1e-8 * np.abs(expected[:, 2:]).max())

    loads = mbs.reactions(system, motion)
    forces = np.stack([np.asarray(loads[name].force)[:, :2] for name in ("A0", "A1", f"A{n}")], axis=1)
    check(forces[0, :2], np.array(AT_REST), 1e-8)
    check(forces[1:3], np.array(REACTIONS[n]), 1e-6)
    assert all(np.all(np.asarray(loads[name].unique_force)[..., :2]) for name in ("A0", "A1", f"A{n}"))


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 10])
def test_start_has_the_acceleration_of_the_exact_equation(n):
    system = models.n_four_bar(n)
    state = mbs.State.at(system, A0=-0.4, velocities={"A0": -1.0}, guess=_guess(n, -0.4))
    accelerations, _ = mbs.forward_dynamics(system, state)
    crank = models.n_four_bar_acceleration(n, -0.4)
    rows = np.asarray(mbs.kinematics.jacobian(system, state, "crank_0"))[5]  # angular velocity about z
    check(rows @ np.asarray(accelerations), crank, 1e-9)


@pytest.mark.long
@pytest.mark.parametrize("n", [40, 160])
def test_long_rows_follow_the_exact_equation(n):
    """Ten seconds and twelve singular poses: errors at several tolerances scatter, and none stands out."""
    system = models.n_four_bar(n)
    start, angle = models.n_four_bar_state(system, 0.0), models.n_four_bar_angle(n, 0.0, 10.0)
    rate = -np.sqrt(1.0 + 2.0 * models.n_four_bar_acceleration(n, np.pi / 2) * (1.0 - np.cos(angle)))  # energy
    assert system.topology.linear_solver == "frontal"
    every = ((1e-9, 1e-7), (3e-10, 6e-8), (1e-10, 3e-8))
    for tolerance, largest in every if n == 40 else every[1:2]:  # a step of 160 loops costs four of 40
        motion = mbs.simulate(system, start, ts=np.array([0.0, 10.0]), rtol=tolerance, atol=tolerance)
        assert bool(motion.ok) and int(motion.diagnostics.num_steps) <= 600
        check(float(motion.states.coordinates[-1, 0]), angle, largest)
        check(float(motion.states.velocities[-1, 0]), rate, largest)


@pytest.mark.long
def test_errors_of_a_row_fall_with_the_tolerance():
    """Ten seconds and twelve singular poses, each of which multiplies an error: it scatters with the tolerance, by a
    factor of ten about its median."""
    system = models.n_four_bar(10, linear_solver="frontal")
    start, angle = models.n_four_bar_state(system, 0.0), models.n_four_bar_angle(10, 0.0, 10.0)
    rate = -np.sqrt(1.0 + 2.0 * models.n_four_bar_acceleration(10, np.pi / 2) * (1.0 - np.cos(angle)))  # energy
    for tolerance, median in ((1e-9, 3e-8), (1e-10, 1e-8), (2e-11, 5e-9)):
        errors = []
        for nearby in tolerance * np.array([0.7, 0.85, 1.0, 1.2, 1.4]):
            motion = mbs.simulate(system, start, ts=np.array([0.0, 10.0]), rtol=nearby, atol=nearby)
            assert int(motion.diagnostics.num_steps) <= 600  # steps that follow the fading rows: 620 to 1000
            errors.append(abs(float(motion.states.velocities[-1, 0]) - rate))
        assert np.median(errors) < median and max(errors) < 10.0 * median, f"at {tolerance}: {errors}"


def _guess(n, angle):
    """Coordinates of the other joints of the tree: cranks lean by the angle, couplers stay level."""
    cranks = {f"A{i}": angle for i in range(1, n + 1)}
    return cranks | {f"left_{i}": -angle for i in range(n)}
