"""CT1, a sphere that hits a plane: restitution, depth and duration by Hertz, Hunt and Crossley."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.contact import HuntCrossley, SphereOnPlane

from .reading import check, coordinates, rates, run

CASES = {  # damping [s/m]: restitution, greatest depth [m], duration [s]
    0.0: (1.0, 0.0003314454017339986, 0.0012194187823527628),
    0.2: (0.9035248661504409, 0.0003184280793835063, 0.001233015592248623),
    0.6: (0.7561486806594477, 0.0002975369943646629, 0.001262990032802413),
}
SPEED = 0.8


def sphere(damping):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("sphere", 0.5)
    b.joint("z", mbs.Prismatic("z"), "ground", "sphere")
    b.contact("plane", SphereOnPlane(0.05), "sphere", "ground", HuntCrossley(2e8, 1.5, damping))
    return b.build()


@pytest.mark.long
def test_impact():
    ts = np.linspace(0.0, 0.0013, 2601)[1:]
    for damping, (restitution, depth, duration) in CASES.items():
        system = sphere(damping)
        motion = run(system, mbs.State.at(system, {"z": 0.05}, {"z": -SPEED}), ts, rtol=1e-10, interpolate=True)
        z, v = coordinates(system, motion, "z")[:, 0], rates(system, motion, "z")[:, 0]
        check(v[-1] / SPEED, restitution, 2e-9)
        check(HuntCrossley(2e8, damping=damping).restitution(SPEED), restitution, 1e-9)
        check(0.05 - z.min(), depth, 1e-10)
        last = np.flatnonzero(z < 0.05)[-1]
        check(ts[last] + (0.05 - z[last]) / v[last], duration, 1e-8)
        lost = motion.diagnostics.work["plane"][-1]
        check(lost, -0.25 * SPEED**2 * (1.0 - restitution**2), 1e-8)


@pytest.mark.long
def test_derivative_of_the_impact():
    """The speed after the impact, by the damping and the speed before, against the closed form."""

    def after(damping, speed):
        system = sphere(damping)
        start = mbs.State.at(system, {"z": 0.0501}, {"z": -speed})
        return mbs.simulate(system, start, ts=[0.002], rtol=1e-10, atol=1e-12, gradient="forward").states.velocities[
            -1, 0
        ]

    def closed(damping, speed):
        return speed * HuntCrossley(2e8, damping=damping).restitution(speed)

    found = jax.jit(jax.jacfwd(after, (0, 1)))(0.6, SPEED)
    check(found, jax.jacfwd(closed, (0, 1))(0.6, SPEED), 1e-6)
