"""V1, V2 through `vehicles.kc_rig` and `load_cases`: curves, loads, and their slopes by every hardpoint."""

import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles

V1, V2 = (
    json.loads((Path(__file__).parent / f"{name}.json").read_text())
    for name in ("V1_double_wishbone_kinematics", "V2_double_wishbone_loads")
)
POINTS = {name: np.array(x, float) / 1e3 for name, x in V2["parameters"]["hardpoints_mm"].items()}
CASES = {name: np.array(c["force_N"], float) for name, c in V2["parameters"]["load_cases"].items()}
AT = {name: "contact" if c["at"] == "P" else "centre" for name, c in V2["parameters"]["load_cases"].items()}
RADIUS = V1["parameters"]["wheel_radius_mm"] / 1e3
LINKS = ("lower_front", "lower_rear", "upper_front", "upper_rear", "tie_rod", "strut")


def check(found, case, quantity):
    row = next(o for o in case["outputs"] if o["quantity"] == quantity)
    np.testing.assert_allclose(found, row["value"], rtol=0, atol=row["tol"], err_msg=quantity)


def four(c):
    return np.rad2deg(np.stack([c.camber, c.toe, c.caster, c.kingpin], axis=-1))


def six(c):
    return 1e3 * np.concatenate([c.centre, c.contact], axis=-1)


@pytest.mark.long
def test_curves_and_slopes_of_the_case():
    rig = vehicles.kc_rig(vehicles.double_wishbone(POINTS, RADIUS, arms=False))
    travels, racks = np.array([-60, -40, -30, -20, -10, 0, 10, 20, 30, 40, 50, 60]), np.array([0, -20, 20])
    found = rig.curves(*(x / 1e3 for x in np.meshgrid(travels, racks, indexing="ij")))
    for i, z in enumerate(travels):
        for j, rack in enumerate(racks):
            tag = f"at travel {z} mm, rack {rack} mm"
            check(four(found)[i, j], V1, f"[camber, toe, caster, KPI] deg {tag}")
            check(six(found)[i, j], V1, f"[wheel centre x,y,z, contact x,y,z] mm {tag}; half track is contact y")
    along = {"wheel travel": (1.0, 0.0), "rack travel": (0.0, 1.0)}
    slope = mbs.jit(lambda y, way: jax.jvp(rig.curves, (jnp.zeros(()), y), way)[1])
    for rack in racks:
        for name, way in along.items():
            part = slope(jnp.asarray(rack / 1e3), tuple(map(jnp.asarray, way)))
            check(four(part) / 1e3, V1, f"d[camber, toe, caster, KPI]/d({name}) deg/mm at travel 0, rack {rack}")
            check(six(part) / 1e3, V1, f"d[wheel centre, contact point]/d({name}) at travel 0, rack {rack}")
    straight = slope(jnp.zeros(()), (jnp.ones(()), jnp.zeros(())))
    middle = rig.curves(0.0)
    np.testing.assert_allclose([middle.camber_slope, middle.toe_slope], [straight.camber, straight.toe], rtol=1e-9)
    np.testing.assert_allclose(middle.motion_ratio, -straight.strut, rtol=1e-9)


def tables(arms):
    rig = vehicles.kc_rig(vehicles.double_wishbone(POINTS, RADIUS, arms=arms))
    for z in (-30, 0, 50):
        yield z, vehicles.load_cases(rig, CASES, travel=z / 1e3, at=AT)


def slopes(arms, z, of):
    """Slopes [N/mm] of one number of the loads by every hardpoint, in "brake and corner"."""
    suspension = vehicles.double_wishbone(POINTS, RADIUS, arms=arms)
    rig = vehicles.kc_rig(suspension)
    one = lambda H: of(rig.loads(CASES["brake and corner"], travel=z / 1e3, hardpoints=H))
    return mbs.jit(jax.jacfwd(one))(suspension.hardpoints)


@pytest.mark.long
def test_members_of_links_and_their_slopes():
    for z, table in tables(False):
        for k, case in enumerate(CASES):
            found = [table.tensions[name][k] for name in LINKS]
            quantity = "links: tension N of lower_front, lower_rear, upper_front, upper_rear, tie_rod, strut"
            check(found, V2, f"{quantity}; {case}, travel {z} mm")
    chosen = ("lower_front", "upper_front", "tie_rod")
    for z in (0, 50):
        found = slopes(False, z, lambda x: jnp.stack([x.tensions[name] for name in chosen]))
        for k, name in enumerate(chosen):
            quantity = f"links: d(tension of {name})/d(hard point x,y,z) N/mm; brake and corner, travel {z} mm"
            row = next(o for o in V2["outputs"] if o["quantity"] == quantity)
            for point, value in row["value"].items():
                np.testing.assert_allclose(found[point][k] / 1e3, value, rtol=0, atol=row["tol"])


@pytest.mark.long
def test_pickups_of_arms_and_their_slopes():
    for z, table in tables(True):
        points, tensions = table.points, table.tensions
        for k, case in enumerate(CASES):
            tag = f"{case}, travel {z} mm"
            balls = np.concatenate([points["LO"][k], points["UO"][k]])
            check(balls, V2, f"arms: ball force on the upright N lower x,y,z then upper x,y,z; {tag}")
            check([tensions["tie_rod"][k], tensions["strut"][k]], V2, f"arms: tension N of tie rod, strut; {tag}")
            picked = [points[name][k] for name in ("LF", "LR", "UF", "UR")]
            quantity = (
                "arms: chassis force on pick-ups LF, LR, UF, UR with the part along the hinge axis shared equally"
            )
            check(picked, V2, f"{quantity}; {tag}")
            whole = sum(points[name][k] for name in ("LF", "LR", "UF", "UR", "TI", "S"))
            np.testing.assert_allclose(whole, -CASES[case], atol=1e-6)
    chosen = {"lower ball force y": 0, "upper ball force y": 1, "strut tension": 2}
    for z in (0, 50):
        found = slopes(True, z, lambda x: jnp.stack([x.balls["LO"][1], x.balls["UO"][1], x.tensions["strut"]]))
        for name, k in chosen.items():
            quantity = f"arms: d({name})/d(hard point x,y,z) N/mm; brake and corner, travel {z} mm"
            row = next(o for o in V2["outputs"] if o["quantity"] == quantity)
            for point, value in row["value"].items():
                np.testing.assert_allclose(found[point][k] / 1e3, value, rtol=0, atol=row["tol"])
