"""Hardpoints that other programs publish as examples: loads of all parts against statics written in NumPy, to 1e-9.

Wishbone with a push rod: abhiNmechie/Suspension_Forces_Calculator, `hardpoints.csv`, front; millimetres, x backwards.
McPherson strut: spooky-simon/Kinematic-Solver, `strutmain.py`; inches.
Five links: CastillonMiguel/pymycar, `plot_multilink_base.py`; millimetres, x backwards, y to the right.
Trailing arm: `trailingArmForces.m` of the solar car team Midnight Sun (2017); metres, degrees.  Its numbers: its
formula for the spring takes both parts of the load by one cosine, which is no balance of moments.

No example with loads of a solid axle on links or of a twist beam was found in public programs.
"""

import numpy as np
import pytest

from jaxmbs import vehicles

from .test_suspensions import wrench

FORCES = np.array([[-1500.0, 0.0, 1200.0], [0.0, 1800.0, 1300.0], [800.0, -400.0, 3900.0]])


def at(scale, origin=(0.0, 0.0, 0.0), **points):
    return {name: np.asarray(scale) * (np.array(x) - origin) for name, x in points.items()}


WISHBONE = at(
    (-1e-3, 1e-3, 1e-3),
    **{"LF": (111.83, 214.5, 151.6), "LR": (415.49, 240, 130), "LO": (150, 527.89, 145.05)},
    **{"UF": (111.83, 214.5, 313.03), "UR": (343.99, 237.18, 253.08), "UO": (158.17, 516.55, 324.85)},
    **{
        "TI": (55, 236.43, 159.69),
        "TO": (107.59, 543.15, 159.64),
        "S": (180, 375.56, 340.12),
        "D": (180, 475.17, 165.84),
    },
    **{"AI": (159.77, 524.2, 246.11), "AO": (162, 600, 247.89)},
)
MCPHERSON = at(
    0.0254,
    **{"LF": (10, 20, 3), "LR": (-10, 20, 3), "LO": (1, 50, 3), "TI": (-5, 19, 4), "TO": (-5, 50, 4)},
    **{"S": (0, 32, 40), "D": (0, 47, 10), "AI": (0, 47, 10), "AO": (0, 51, 10)},
)
FIVE_LINKS = at(
    (-1e-3, -1e-3, 1e-3),
    (4682.2, 0.0, 700.0),
    **{"I1": (4066.2, -498.8, 1015.7), "O1": (4702.5, -701.7, 1006.2), "I2": (4682.3, -285.2, 936.4)},
    **{"O2": (4687.4, -698.2, 927.5), "I3": (4707.1, -462.7, 1120.5), "O3": (4701.2, -710.5, 1207.3)},
    **{"I4": (4912.2, -418.5, 1128.2), "O4": (4840.7, -721.2, 1202.8), "I5": (5042.5, -272.4, 988.7)},
    **{"O5": (4942.9, -719.8, 1038.2), "AI": (4682.2, -700.0, 1047.4), "AO": (4682.2, -766.1, 1047.4)},
    **{"S": (4740.0, -560.0, 1500.0), "D": (4720.0, -650.0, 960.0)},  # of the spring: not in the example
)


def along(a, b):
    return (b - a) / np.linalg.norm(b - a)


def below(H, radius):
    """The contact: from the wheel centre, in the plane of the wheel."""
    axle = along(H["AI"], H["AO"])
    down = axle * axle[2] - np.array([0.0, 0.0, 1.0])
    return H["AO"] + radius * down / np.linalg.norm(down)


@pytest.mark.long
def test_wishbone_with_a_push_rod():
    """Tie rod, push rod and both balls: six equations of the upright, a moment about each arm's line."""
    H, radius = WISHBONE, 0.2286
    rig = vehicles.kc_rig(vehicles.double_wishbone(H, radius))
    push, tie = along(H["S"], H["D"]), along(H["TO"], H["TI"])
    for force in FORCES:
        A, b = np.zeros((8, 8)), np.zeros(8)
        A[:6, 0] = wrench(H["TO"], tie)
        b[:6] = -wrench(below(H, radius), force)
        for k, (ball, ends) in enumerate({"LO": ("LF", "LR"), "UO": ("UF", "UR")}.items()):
            of_ball = slice(2 + 3 * k, 5 + 3 * k)
            A[:6, of_ball] = np.stack([wrench(H[ball], axis) for axis in np.eye(3)], 1)
            line = along(H[ends[0]], H[ends[1]])
            A[6 + k, of_ball] = [-line @ np.cross(H[ball] - H[ends[0]], axis) for axis in np.eye(3)]
        A[6, 1] = along(H["LF"], H["LR"]) @ np.cross(H["D"] - H["LF"], -push)
        found = np.linalg.solve(A, b)
        loads = rig.loads(force)
        mine = [loads.tensions["tie_rod"], loads.tensions["strut"], *loads.balls["LO"], *loads.balls["UO"]]
        np.testing.assert_allclose(mine, found, atol=1e-9 * np.max(np.abs(found)))


@pytest.mark.long
def test_mcpherson_strut():
    H, radius = MCPHERSON, 0.254
    rig = vehicles.kc_rig(vehicles.mcpherson(H, radius))
    rods = {"lower_front": ("LF", "LO"), "lower_rear": ("LR", "LO"), "tie_rod": ("TI", "TO")}
    columns = [wrench(H[outer], along(H[outer], H[inner])) for inner, outer in rods.values()]
    columns += [wrench(H["S"], axis) for axis in np.eye(3)]
    for force in FORCES:
        found = np.linalg.solve(np.stack(columns, 1), -wrench(below(H, radius), force))
        loads = rig.loads(force)
        mine = [*(loads.tensions[name] for name in rods), *loads.chassis["S"]]
        np.testing.assert_allclose(mine, found, atol=1e-9 * np.max(np.abs(found)))


@pytest.mark.long
def test_five_links():
    H, radius = FIVE_LINKS, 0.3474
    rig = vehicles.kc_rig(vehicles.five_link(H, radius))
    columns = [wrench(H[f"O{k}"], along(H[f"O{k}"], H[f"I{k}"])) for k in range(1, 6)]
    columns.append(wrench(H["D"], along(H["D"], H["S"])))
    for force in FORCES:
        found = np.linalg.solve(np.stack(columns, 1), -wrench(below(H, radius), force))
        loads = rig.loads(force)
        mine = [*(loads.tensions[f"link_{k}"] for k in range(1, 6)), loads.tensions["strut"]]
        np.testing.assert_allclose(mine, found, atol=1e-9 * np.max(np.abs(found)))


@pytest.mark.long
def test_trailing_arm():
    """Spring and hinge from the moment about the pivot and the sum of forces, in the plane; loads of the example."""
    down, of_spring = np.radians([15.0, 45.0])
    arm, up = np.array([-np.cos(down), 0.0, -np.sin(down)]), np.array([-np.sin(down), 0.0, np.cos(down)])
    pivot = np.array([0.0, 0.5, 0.6])
    spring = np.sin(of_spring) * up - np.cos(of_spring) * arm
    low, centre, side = pivot + 0.1 * arm + 0.05 * up, pivot + 0.3 * arm, np.array([0.0, 0.1, 0.0])
    H = {"P": pivot - side, "Q": pivot + side, "D": low, "S": low + 0.3 * spring, "AI": centre, "AO": centre + side}
    rig = vehicles.kc_rig(vehicles.trailing_arm(H, 0.2667))
    moment = lambda at, force: np.cross(at - pivot, force)[1]
    for force in ([0.0, 0.0, 2450.0], [-225.0, 0.0, 2450.0]):
        loads = rig.loads(force, at="centre")
        tension = -moment(centre, force) / moment(low, spring)
        np.testing.assert_allclose(loads.tensions["strut"], tension, rtol=1e-9)
        np.testing.assert_allclose(loads.hinge["force"], -(np.array(force) + tension * spring), atol=1e-9 * 2450.0)
