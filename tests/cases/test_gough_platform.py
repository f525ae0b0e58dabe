"""C4, 6-6 Gough platform: statics (Merlet, Parallel Robots); dynamics on spring legs by Pinocchio."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, run

LENGTHS = np.array(
    (
        1.2541900732688762,
        1.2741692329138665,
        1.2613927304049066,
        1.0934683769494293,
        1.262114764666486,
        1.1094262470398504,
    )
)
PUSH = np.array(
    (
        105.9354019469581,
        72.15593589644537,
        84.26151605385073,
        136.82478552906943,
        59.323078253737066,
        125.50003463101484,
    )
)
TWIST = np.array((0.2, -0.1, 0.15, 0.05, 0.3, -0.2))  # velocity of the origin, angular velocity; world axes
LEG_RATES = np.array(
    (
        -0.11573693483474787,
        0.3100575035360829,
        0.2604194014598057,
        0.29854646069307433,
        0.030998690507719695,
        -0.003996113342241536,
    )
)
JACOBIAN = np.array(
    (
        (
            -0.45978192256408934,
            0.2275961345160263,
            0.8583708890896946,
            0.4195692196232793,
            -0.2997112950624546,
            0.30420821348104576,
        ),
        (
            0.43636012177219974,
            -0.31793026635509836,
            0.8417304734072107,
            0.5151241718666475,
            -0.06429829727516143,
            -0.2913308106213379,
        ),
        (
            0.11423297520670193,
            -0.635553557325576,
            0.7635591025888112,
            -0.012455394665062881,
            0.4529292654596402,
            0.3788621230352644,
        ),
        (
            0.16161461489529863,
            0.4807144618580337,
            0.8618551632454174,
            -0.13641213855724701,
            0.47856072170776726,
            -0.24134549914268782,
        ),
        (
            0.5804236660234948,
            0.2901747405402304,
            0.7608593745707918,
            -0.38675623047118446,
            -0.2441084962250349,
            0.3881355721875266,
        ),
        (
            -0.39003684420494067,
            -0.24386397879455235,
            0.8879198274670642,
            -0.35365364737519006,
            -0.3956015031911798,
            -0.26400008412672593,
        ),
    )
)
DETERMINANT = 0.9726512309727787
TIMES = np.array((0.1, 0.25, 0.5, 1.0))
COM = np.array(
    (
        (0.09628601932322921, -0.06224146566192596, 1.0895277289134357),
        (0.09636196397623635, -0.06242090939403877, 1.0897260423867596),
        (0.09826743986772102, -0.06315334840742814, 1.0936256823186628),
        (0.09491457128522107, -0.06172770144708054, 1.0925469719736483),
    )
)
ROTATION = np.array(
    (
        (
            (0.9847056682857941, -0.16106480458315645, -0.06642947817361361),
            (0.1529818076047594, 0.9817792244442135, -0.11272143093352002),
            (0.0833745368071653, 0.10083493032828242, 0.9914035522620858),
        ),
        (
            (0.9848098003680904, -0.16043631490907312, -0.06640667103055012),
            (0.15236738548152623, 0.9818882688326439, -0.11260376268295295),
            (0.08326966398687446, 0.10077507820503794, 0.9914184518518315),
        ),
        (
            (0.9853431440593586, -0.15727048904146407, -0.0660672515840954),
            (0.14932619888172277, 0.9824660240262243, -0.11163421501330907),
            (0.08246559757106958, 0.10013243685619701, 0.9915507653703292),
        ),
        (
            (0.9852011988218475, -0.158497051789001, -0.06524785371327536),
            (0.15062058960945565, 0.9822531620216562, -0.11176834831094949),
            (0.08180486431560287, 0.10028664054924023, 0.991589912162106),
        ),
    )
)


@pytest.fixture(scope="module")
def rigid():
    system = models.gough_platform("rigid")
    return system, mbs.State.at(system, platform=models.gough_pose())


def _rows(system, state):
    """Constraint rows on (velocity, angular velocity) in world axes, as unit vectors that lengthen the legs.

    Also the factors (6,) by which the library's own rows were divided.
    """
    rows = np.asarray(mbs.constraints.constraint_jacobian(system, state))
    rows = np.concatenate([rows[:, :3], rows[:, 3:] @ models.GOUGH_ROTATION.T], axis=1)
    scale = np.linalg.norm(rows[:, :3], axis=1) * np.sign(rows[:, 2])
    return rows / scale[:, None], scale


@pytest.mark.long
def test_leg_lengths(rigid):
    system, state = rigid
    heads = np.stack([np.asarray(mbs.position(system, state, f"head_{i}")) for i in range(6)])
    check(np.linalg.norm(heads - models.GOUGH_BASE, axis=1), LENGTHS, 1e-12)
    check(models.gough_lengths(), LENGTHS, 1e-12)


def test_jacobian(rigid):
    rows, _ = _rows(*rigid)
    check(rows, JACOBIAN, 1e-12)
    check(np.linalg.det(rows), DETERMINANT, 1e-10)
    check(rows @ TWIST, LEG_RATES, 1e-12)


def test_leg_forces_hold_the_weight(rigid):
    system, state = rigid
    accelerations, multipliers = mbs.forward_dynamics(system, state)
    _, scale = _rows(system, state)
    check(accelerations, np.zeros(6), 1e-10)
    check(np.asarray(multipliers) * scale, PUSH, 1e-8)


def test_inverse_dynamics_gives_the_same_forces(rigid):
    system, state = rigid
    rows, _ = _rows(system, state)
    efforts = np.asarray(mbs.inverse_dynamics(system, state, np.zeros(6)))
    efforts = np.concatenate([efforts[:3], models.GOUGH_ROTATION @ efforts[3:]])
    check(np.linalg.solve(rows.T, efforts), PUSH, 1e-8)


@pytest.mark.long
def test_leg_rates_of_a_moving_platform():
    system = models.gough_platform("none")
    rates = np.concatenate([TWIST[:3], models.GOUGH_ROTATION.T @ TWIST[3:]])
    state = mbs.State.at(system, platform=models.gough_pose(), velocities={"platform": rates})
    velocity = np.stack([np.asarray(mbs.velocity(system, state, f"head_{i}")) for i in range(6)])
    check(np.sum(velocity * JACOBIAN[:, :3], axis=1), LEG_RATES, 1e-12)


@pytest.mark.long
def test_spring_legs():
    system = models.gough_platform("spring")
    state = mbs.State.at(system, platform=models.gough_pose(), velocities={"platform": np.zeros(6)})
    motion = run(system, state, TIMES)
    check(along(mbs.position, system, motion, "com"), COM, 1e-8)
    check(along(mbs.rotation, system, motion, "platform"), ROTATION, 1e-8)
