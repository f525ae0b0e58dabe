"""HY1, an arm on a double-acting cylinder with a position valve: SciPy's Radau and DOP853.

Exudyn's own test prints 7.130440 for `norm` with steps of 1 ms; it converges to the value here.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F

from .reading import check, coordinates, rates, run

TIMES = np.array((0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0))
# angle [rad], pressures [Pa], force of the cylinder [N]
TRUTH = np.array(
    (
        (-0.0006665765905048852, 2217728.7882545395, 1850007.4212232588, 3227.1009237598637),
        (-0.00034328397348569787, 2231425.4736187602, 1884193.4406781746, 3319.4310525721435),
        (-9.668094438956381e-05, 2245777.4674980883, 1908855.3334304811, 3325.959989741382),
        (-2.7262720716084548e-05, 2249844.17972788, 1915764.7235770137, 3328.590287455041),
        (0.02458359580612308, 6416127.529259172, 2984560.020306656, 5917.817251928209),
        (0.3290649176853213, 12983066.193182394, 6707722.5011271145, 4794.916570421512),
        (0.6564255146078769, 10729744.808216918, 9249267.430402037, 1353.1273037995015),
        (0.6990210558986716, 10236933.346410973, 9746153.057945434, 4055.4146461244936),
    )
)
NORM = 7.103804185290831  # at 0.4 s
LENGTH, DAMPING = np.sqrt(2 * 0.25**2), 2e5


def position_valve(x, v, t):
    """Twice what is missing to the length wanted."""
    wanted = (jnp.clip(1.0 - jnp.cos(jnp.pi * t), 0.5, 1.5) - 0.5) * 0.1 + LENGTH
    return 2.0 * (wanted - x)


def arm(bulk_modulus=1e11, like=None):
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("arm", mass=120.0, com=(0.5, 0.0, 0.0), inertia=10.0)
    b.joint("pin", mbs.Revolute("z"), "ground", "arm")
    options = dict(supply=2e7, damping=DAMPING, laminar=1.0)
    law = F.HydraulicCylinder((0.01, 0.01), (1.0, 1.0), bulk_modulus, position_valve, 2e-5, **options)
    b.force("cylinder", law, between=(("ground", (0.0, -0.25, 0.0)), ("arm", (0.25, 0.0, 0.0))))
    return b.build(like=like)


def begin(system):
    return mbs.State.at(system, pin=0.0, internal={"cylinder.p0": 2e6, "cylinder.p1": 2e6})


@pytest.mark.long
def test_angle_pressures_and_force():
    system = arm()
    # the valve's wanted length has kinks at 1/3 and 2/3 s
    motion = run(system, begin(system), TIMES, rtol=1e-10, atol=1e-10)
    angle, p0, p1 = coordinates(system, motion, "pin")[:, 0], *(motion.internal(f"cylinder.p{k}") for k in (0, 1))
    reach = 0.25 * np.stack([np.cos(angle), np.sin(angle) + 1.0], axis=1)
    along = 0.25 * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    opening = np.sum(reach * along, axis=1) / np.linalg.norm(reach, axis=1) * rates(system, motion, "pin")[:, 0]
    found = np.stack([angle, p0, p1, 0.01 * (p0 - p1) - DAMPING * opening], axis=1)
    check(found, TRUTH, (1e-8, 10.0, 10.0, 0.5))
    centre = 0.5 * np.cos(angle[4]) - 0.5, 0.5 * np.sin(angle[4]), angle[4]
    check(np.linalg.norm(centre) + 1e-6 * np.hypot(p0[4], p1[4]), NORM, 1e-6)


@pytest.mark.long
def test_slope_by_the_oil():
    """Of the pressure at the end, by the bulk modulus."""

    def pressure(E):
        system = arm(E, like=arm())
        return mbs.simulate(system, begin(system), t1=0.4, ts=[0.0, 0.4]).internal("cylinder.p0")[-1] / 1e6

    E, h = 1e11, 1e8
    np.testing.assert_allclose(jax.grad(pressure)(E), (pressure(E + h) - pressure(E - h)) / (2 * h), rtol=1e-5)
