"""D2, free rigid body that flips (Dzhanibekov): Jacobi elliptic closed form; attitude by heyoka."""

import numpy as np
import pytest

import jaxmbs as mbs

from . import models
from .reading import along, check, run

TIMES = np.array((1.0, 5.0, 10.0, 20.0))
OMEGA = np.array(
    (
        (-0.03205858724725771, 1.9997680482955291, 0.02663176684769547),
        (-1.9999455029458169, 0.017832140836251568, 1.1548278392258586),
        (0.009383916861891401, -2.000002985523854, 0.019900233630713065),
        (-0.03197154132859542, 1.999769441847003, 0.026596863567759796),
    )
)
ROTATION = np.array(
    (
        (
            (-0.41621013268040397, -0.018995585768986092, 0.9090700155518571),
            (0.00666453899697071, 0.9996911710990692, 0.023940475068998622),
            (-0.9092440318056084, 0.016022800874521938, -0.41595499814044423),
        ),
        (
            (-0.8658776271524058, 0.05244327459719689, -0.4974993846694112),
            (-0.4984573980739132, -0.006194108186587499, 0.8668920667125509),
            (0.04238109368933479, 0.9986046945479959, 0.031504077901122196),
        ),
        (
            (0.9945036099740859, -0.0017293994762170417, -0.10468800755561275),
            (0.0014301080475373508, -0.9995459403787216, 0.03009763883414159),
            (-0.10469252379938473, -0.030081925634335965, -0.9940495728134723),
        ),
        (
            (0.9780259154310863, 0.0061610230598518525, 0.20839229961791647),
            (-0.0073126241039088834, 0.9999619515087695, 0.004756160582834266),
            (-0.20835506779030458, -0.006175542861218705, 0.9780337562663511),
        ),
    )
)

START = (0.01, 2.0, 0.02)  # angular velocity in body axes; the axes start along the world's


@pytest.mark.long
@pytest.mark.parametrize("kind", ["free", "spherical"])
def test_free_rigid_body(kind):
    system = models.free_rigid_body(kind)
    rest = [0.0, 0.0, 0.0] if kind == "free" else []
    state = mbs.State.at(
        system, joint=np.array([*rest, 1.0, 0.0, 0.0, 0.0]), velocities={"joint": np.array([*rest, *START])}
    )
    motion = run(system, state, TIMES, rtol=1e-12, atol=1e-12)
    check(np.asarray(system.velocities(motion.states)["joint"])[:, -3:], OMEGA, 1e-9)
    check(along(mbs.rotation, system, motion, "body"), ROTATION, 1e-8)
    if kind == "free":
        check(along(mbs.position, system, motion, "body"), np.zeros((4, 3)), 1e-12)
