"""A car of seven freedoms on corners without mass: exactly linear, against the matrix exponential."""

import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs

from .reading import check, coordinates

MASS, ROLL, PITCH = 1100.0, 400.0, 1500.0  # of the sprung part [kg, kg m^2]
CORNERS = {  # place (x, y), wheel, spring, damper, tyre, height of the road
    "front left": (1.1, 0.75, 45.0, 28e3, 2400.0, 190e3, 0.05),
    "front right": (1.1, -0.75, 45.0, 28e3, 2400.0, 190e3, 0.0),
    "rear left": (-1.5, 0.7, 40.0, 24e3, 2100.0, 180e3, -0.02),
    "rear right": (-1.5, -0.7, 40.0, 24e3, 2100.0, 180e3, 0.0),
}
TIMES = np.array([0.02, 0.1, 0.4, 1.0])


def car():
    """Heave, pitch and roll by a body each; the couplers put a corner at heave - x pitch + y roll."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    up = mbs.Prismatic(axis="z")
    b.body("chassis", mass=MASS)
    b.joint("heave", up, "ground", "chassis")
    for name, axis, inertia in (("pitch", "y", PITCH), ("roll", "x", ROLL)):
        b.body(name, mass=1.0, inertia=inertia)
        b.joint(name, mbs.Revolute(axis=axis), "ground", name)
    for name, (x, y, wheel, spring, damper, tyre, road) in CORNERS.items():
        b.body(f"wheel {name}", mass=wheel)
        b.body(f"corner {name}", mass=0.0)
        b.joint(f"tyre {name}", up, "ground", f"wheel {name}")
        b.joint(f"strut {name}", up, f"wheel {name}", f"corner {name}")
        b.force(f"tyre {name}", mbs.SpringDamper(stiffness=tyre, free_length=road), joint=f"tyre {name}")
        b.force(f"strut {name}", mbs.SpringDamper(stiffness=spring, damping=damper), joint=f"strut {name}")
        rigid = {f"tyre {name}": 1.0, f"strut {name}": 1.0, "heave": -1.0, "pitch": x, "roll": -y}
        b.constraint(f"corner {name}", mbs.Coupler(rigid))
    return b.build()


def exact(times):
    """Heave, pitch, roll and the wheels (times, 7), from rest at zero."""
    x, y, wheel, spring, damper, tyre, road = np.array(list(CORNERS.values())).T
    M = np.diag([MASS, PITCH, ROLL, *wheel])
    strut = np.hstack([np.stack([np.ones(4), -x, y], axis=1), -np.eye(4)])  # its stretch by the seven freedoms
    K = strut.T @ (spring[:, None] * strut) + np.diag([0.0, 0.0, 0.0, *tyre])
    C = strut.T @ (damper[:, None] * strut)
    rest = np.linalg.solve(K, np.r_[0.0, 0.0, 0.0, tyre * road])
    A = np.block([[np.zeros((7, 7)), np.eye(7)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    gap = np.r_[-rest, np.zeros(7)]
    return np.array([rest + (scipy.linalg.expm(A * t) @ gap)[:7] for t in times])


@pytest.mark.long
def test_road_steps_under_the_left_wheels():
    system = car()
    assert system.topology.mobility == 7
    state = mbs.State.at(system, dict.fromkeys(("heave", "pitch", "roll", *(f"tyre {n}" for n in CORNERS)), 0.0))
    motion = mbs.simulate(system, state, ts=TIMES, rtol=1e-11, atol=1e-11)
    found = coordinates(system, motion, "heave", "pitch", "roll", *(f"tyre {name}" for name in CORNERS))
    check(found, exact(TIMES), 1e-10)
    assert motion.diagnostics.num_steps < 500
