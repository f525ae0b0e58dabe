"""V1, V2: a double wishbone over wheel travel and rack: curves, loads of members and pick-ups, and their slopes."""

import functools
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

from . import wishbone
from .reading import check

V1, V2 = (
    json.loads((Path(__file__).parent / f"{name}.json").read_text())
    for name in ("V1_double_wishbone_kinematics", "V2_double_wishbone_loads")
)
POINTS = {name: jnp.array(x, float) / 1e3 for name, x in V2["parameters"]["hardpoints_mm"].items()}
CASES = {name: (c["at"], jnp.array(c["force_N"], float)) for name, c in V2["parameters"]["load_cases"].items()}
TRAVELS = (-30.0, 0.0, 50.0)
compiled = functools.partial(mbs.jit, compile="quick")  # each runs once


def values(case, quantity):
    return [(np.array(o["value"]), o["tol"]) for o in case["outputs"] if o["quantity"] == quantity][0]


@pytest.mark.long
def test_curves_and_their_slopes_by_travel_and_rack():
    first = wishbone.suspension(POINTS)

    def curve(travel, rack):
        system = wishbone.suspension(POINTS, travel=travel / 1e3, rack=rack / 1e3, like=first)
        angles, places = wishbone.curves(POINTS, system, mbs.State.at(system))
        return angles, 1e3 * places

    travels, racks = [-60, -40, -30, -20, -10, 0, 10, 20, 30, 40, 50, 60], [0, -20, 20]
    grid = [(z, rack) for rack in racks for z in travels]
    at = [jnp.array(x, float) for x in zip(*grid, strict=True)]
    found = compiled(jax.vmap(curve))(*at)
    names = (
        "[camber, toe, caster, KPI] deg at travel {} mm, rack {} mm",
        "[wheel centre x,y,z, contact x,y,z] mm at travel {} mm, rack {} mm; half track is contact y",
    )
    for name, rows in zip(names, found, strict=True):
        for (z, rack), row in zip(grid, rows, strict=True):
            check(row, *values(V1, name.format(z, rack)))
    slopes = compiled(jax.vmap(jax.jacfwd(curve, argnums=(0, 1)), (None, 0)))(0.0, jnp.array(racks, float))
    names = (
        "d[camber, toe, caster, KPI]/d({}) deg/mm at travel 0, rack {}",
        "d[wheel centre, contact point]/d({}) at travel 0, rack {}",
    )
    for name, parts in zip(names, slopes, strict=True):
        for along, rows in zip(("wheel travel", "rack travel"), parts, strict=True):
            for rack, row in zip(racks, rows, strict=True):
                check(row, *values(V1, name.format(along, rack)))


@functools.cache
def first(arms):
    """The concrete build; ask for it outside of traces."""
    return wishbone.suspension(POINTS, arms)


def loads_of(H, travel, place, force, arms):
    """(state, loads) with the strut's effort holding the wheel at a travel [mm]."""
    system = wishbone.suspension(H, arms, travel / 1e3, like=first(arms))
    state = mbs.State.at(system)
    at = jnp.where(place, wishbone.contact(H, system, state), H["AO"])
    loaded = wishbone.suspension(H, arms, travel / 1e3, force=force, place=at, like=first(arms))
    still = jnp.zeros_like(state.velocities)
    return loaded, state, mbs.reactions(loaded, state, accelerations=still, actuators=["strut"])


def link_answer(H, travel, place, force):
    """Tensions (6,) [N] of the links, the tie rod and the strut."""
    system, state, loads = loads_of(H, travel, place, force, False)
    rods = [wishbone.tension(H, loads, state, system, name) for name in (*wishbone.LINKS, "tie_rod")]
    return jnp.stack([*rods, -loads["strut"].effort[0]])


def arm_answer(H, travel, place, force):
    """Forces on the upright at the balls (6,), tensions of tie rod and strut (2,), of the chassis at the pick-ups
    LF, LR, UF, UR (4, 3)."""
    system, state, loads = loads_of(H, travel, place, force, True)
    pair = jnp.stack([wishbone.tension(H, loads, state, system, "tie_rod"), -loads["strut"].effort[0]])
    pickups = jnp.stack([loads[name].force for name in ("LF", "LR", "UF", "UR")])
    return jnp.concatenate([loads["LO"].force, loads["UO"].force]), pair, pickups


def over_cases(answer):
    """Of all load cases at all travels: [(name, travel)], answers."""
    grid = [(name, z) for name in CASES for z in TRAVELS]
    places = jnp.array([CASES[name][0] == "P" for name, _ in grid])
    forces = jnp.stack([CASES[name][1] for name, _ in grid])
    travels = jnp.array([z for _, z in grid])
    return grid, compiled(jax.vmap(lambda *x: answer(POINTS, *x)))(travels, places, forces)


def slopes_of(answer):
    """d/d(hard points) [N/mm] at "brake and corner" and the two travels of the case."""
    place, force = CASES["brake and corner"]

    def at(H, travel):
        return answer(H, travel, jnp.array(place == "P"), force)

    found = compiled(jax.vmap(jax.jacfwd(at), (None, 0)))(POINTS, jnp.array([0.0, 50.0]))
    return jax.tree.map(lambda x: x / 1e3, found)


@pytest.mark.long
def test_members_of_links_and_their_slopes_by_every_hard_point():
    first(False)
    grid, found = over_cases(link_answer)
    for (name, z), row in zip(grid, found, strict=True):
        quantity = f"links: tension N of lower_front, lower_rear, upper_front, upper_rear, tie_rod, strut; {name}"
        check(row, *values(V2, f"{quantity}, travel {z:g} mm"))
    slopes = slopes_of(link_answer)
    for k, z in enumerate((0, 50)):
        for j, member in ((0, "lower_front"), (2, "upper_front"), (4, "tie_rod")):
            quantity = f"links: d(tension of {member})/d(hard point x,y,z) N/mm; brake and corner, travel {z} mm"
            of_points, tol = values(V2, quantity)
            assert set(of_points.item()) == set(POINTS) - {"D"}
            for point, expected in of_points.item().items():
                check(slopes[point][k, j], expected, tol)


@pytest.mark.long
def test_pickups_of_arms_and_their_slopes_by_every_hard_point():
    first(True)
    grid, (balls, pairs, pickups) = over_cases(arm_answer)
    for i, (name, z) in enumerate(grid):
        tag = f"{name}, travel {z:g} mm"
        check(balls[i], *values(V2, f"arms: ball force on the upright N lower x,y,z then upper x,y,z; {tag}"))
        check(pairs[i], *values(V2, f"arms: tension N of tie rod, strut; {tag}"))
        shared = (
            f"arms: chassis force on pick-ups LF, LR, UF, UR with the part along the hinge axis shared equally; {tag}"
        )
        check(pickups[i], *values(V2, shared))
        sums = f"arms: chassis force on the lower arm (sum of both pick-ups) x,y,z then upper arm; {tag}"
        check(jnp.concatenate([pickups[i, 0] + pickups[i, 1], pickups[i, 2] + pickups[i, 3]]), *values(V2, sums))
    ball, pair, _ = slopes_of(arm_answer)
    for k, z in enumerate((0, 50)):
        for slopes, j, what in (
            (ball, 1, "lower ball force y"),
            (ball, 4, "upper ball force y"),
            (pair, 1, "strut tension"),
        ):
            quantity = f"arms: d({what})/d(hard point x,y,z) N/mm; brake and corner, travel {z} mm"
            of_points, tol = values(V2, quantity)
            assert set(of_points.item()) == set(POINTS)
            for point, expected in of_points.item().items():
                check(slopes[point][k, j], expected, tol)


@pytest.mark.long
def test_the_travel_is_followed_on_one_branch():
    """From the design position, by `near=`: a published curve at each travel, and one sign for all of them."""
    first = wishbone.suspension(POINTS)
    start = mbs.State.at(first)

    def curve(travel):
        system = wishbone.suspension(POINTS, travel=travel / 1e3, like=first)
        state = mbs.State.at(system, near=start)
        return wishbone.curves(POINTS, system, state)[0], state.branch

    travels = np.array([-60.0, -30.0, 0.0, 30.0, 60.0])
    angles, signs = compiled(jax.vmap(curve))(travels)
    np.testing.assert_array_equal(np.unique(signs, axis=0), np.asarray(start.branch)[None])
    assert start.branch.size and np.all(np.abs(start.branch) == 1.0)
    for travel, row in zip(travels, angles, strict=True):
        check(row, *values(V1, f"[camber, toe, caster, KPI] deg at travel {travel:.0f} mm, rack 0 mm"))
