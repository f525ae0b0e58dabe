"""Kinds of suspensions on the rig: loads against plain statics in NumPy, virtual work, load cases, refusals."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import vehicles
from jaxmbs.vehicles._rig import _places

COMMON = {"AI": (-0.02, 0.70, 0.31), "AO": (-0.02, 0.76, 0.315)}
TIE = {"TI": (-0.12, 0.35, 0.28), "TO": (-0.15, 0.68, 0.29)}
LOWER = {"LF": (0.2, 0.38, 0.2), "LR": (-0.22, 0.40, 0.21), "LO": (0.0, 0.70, 0.19)}
KINDS = {
    "double_wishbone": {
        **COMMON,
        **TIE,
        **LOWER,
        **{"UF": (0.15, 0.42, 0.52), "UR": (-0.2, 0.43, 0.51), "UO": (-0.03, 0.66, 0.53)},
        **{"S": (0.0, 0.5, 0.75), "D": (0.01, 0.6, 0.21)},
    },
    "mcpherson": {**COMMON, **TIE, **LOWER, "S": (-0.04, 0.56, 0.85), "D": (-0.02, 0.63, 0.45)},
    "five_link": {
        **COMMON,
        **{"I1": (0.2, 0.4, 0.2), "O1": (0.05, 0.7, 0.19), "I2": (-0.25, 0.42, 0.22), "O2": (-0.06, 0.7, 0.2)},
        **{"I3": (0.15, 0.45, 0.5), "O3": (0.03, 0.68, 0.52), "I4": (-0.2, 0.44, 0.49), "O4": (-0.07, 0.67, 0.51)},
        **{"I5": (-0.12, 0.35, 0.30), "O5": (-0.16, 0.68, 0.31), "S": (0.0, 0.55, 0.75), "D": (0.0, 0.66, 0.22)},
    },
    "trailing_arm": {
        **COMMON,
        "P": (0.45, 0.3, 0.3),
        "Q": (0.40, 0.65, 0.31),
        "S": (0.0, 0.6, 0.6),
        "D": (0.05, 0.62, 0.3),
    },
}
FORCE, RADIUS, TRAVEL = np.array([-2000.0, 1500.0, 4500.0]), 0.31, 0.03


@functools.cache
def rig(kind):
    return vehicles.kc_rig(getattr(vehicles, kind)(KINDS[kind], RADIUS))


@functools.cache
def pose(kind):
    """Points of the upright and of the contact at a travel."""
    found = mbs.jit(_places)(rig(kind), jnp.asarray(TRAVEL), jnp.asarray(0.0))
    H = rig(kind).suspension.hardpoints
    return {name: np.asarray(found["R"] @ x + found["origin"]) for name, x in H.items()}, np.asarray(found["contact"])


def wrench(at, force):
    return np.concatenate([force, np.cross(at, force)])


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_the_chassis_holds_the_suspension(kind):
    """Force and moment of all points on the chassis balance the load, to 1e-9 of it."""
    loads = rig(kind).loads(FORCE, travel=TRAVEL)
    H, (_, contact) = rig(kind).suspension.hardpoints, pose(kind)
    whole = wrench(contact, FORCE)
    for name, force in loads.chassis.items():
        whole += wrench(np.asarray(H[name]), np.asarray(force))
    if loads.hinge:
        whole += wrench(np.asarray(H["P"]), np.asarray(loads.hinge["force"]))
        whole[3:] += np.asarray(loads.hinge["moment"])
    np.testing.assert_allclose(whole, 0.0, atol=1e-9 * 4500.0)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_the_spring_does_the_work_of_the_load(kind):
    """Tension of the strut against virtual work: the wheel locked to the upright, and the load at its centre."""
    slope = mbs.jit(lambda z: jax.jvp(rig(kind).curves, (z,), (jnp.ones(()),)))
    curves, rates = slope(jnp.asarray(TRAVEL))
    for at in ("centre", "contact"):
        tension = rig(kind).loads((0.0, 0.0, 1e3), travel=TRAVEL, at=at).tensions["strut"]
        if at == "centre":
            np.testing.assert_allclose(tension, -1e3 / curves.motion_ratio, rtol=1e-9)
    braked = rig(kind).loads((-1e3, 0.0, 0.0), travel=TRAVEL).tensions["strut"]
    risen = rig(kind).loads((0.0, 0.0, 1e3), travel=TRAVEL).tensions["strut"]
    np.testing.assert_allclose(braked / risen, -curves.brake_support, rtol=1e-7)
    driven = rig(kind).loads((1e3, 0.0, 0.0), travel=TRAVEL, at="centre").tensions["strut"]
    np.testing.assert_allclose(driven * curves.motion_ratio / -1e3, curves.drive_support, rtol=1e-7)
    np.testing.assert_allclose(rates.centre[2], 1.0, rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["mcpherson", "five_link", "trailing_arm"])
def test_members_against_plain_statics(kind):
    """Six unknowns on the upright, written out: tensions of rods, force at the strut's top, loads of the hinge."""
    own, loads, (at, contact) = rig(kind).suspension, rig(kind).loads(FORCE, travel=TRAVEL), pose(kind)
    H = {name: np.asarray(x) for name, x in own.hardpoints.items()}
    columns = []
    for rod in own.rods:
        along = H[rod.inner] - at[rod.outer]
        columns.append(wrench(at[rod.outer], along / np.linalg.norm(along)))
    if kind == "mcpherson":
        columns += [wrench(H["S"], axis) for axis in np.eye(3)]
    else:
        along = H["S"] - at["D"]
        columns.append(wrench(at["D"], along / np.linalg.norm(along)))
    if kind == "trailing_arm":
        line = H["Q"] - H["P"]
        across = np.linalg.svd(line[None])[2][1:]  # moments that the hinge carries
        columns += [wrench(H["P"], axis) for axis in np.eye(3)] + [np.concatenate([np.zeros(3), m]) for m in across]
    found = np.linalg.solve(np.stack(columns, 1), -wrench(contact, FORCE))
    if kind == "trailing_arm":
        hinge = [*loads.hinge["force"], *(across @ loads.hinge["moment"])]
        np.testing.assert_allclose([loads.tensions["strut"], *hinge], found, atol=1e-9 * 4500.0)
        np.testing.assert_allclose(line @ loads.hinge["moment"], 0.0, atol=1e-9 * 4500.0)
        return
    tensions = [loads.tensions[rod.name] for rod in own.rods]
    np.testing.assert_allclose(tensions, found[: len(own.rods)], atol=1e-9 * 4500.0)
    rest = loads.chassis["S"] if kind == "mcpherson" else [loads.tensions["strut"]]
    np.testing.assert_allclose(rest, found[len(own.rods) :], atol=1e-9 * 4500.0)


@pytest.mark.long
def test_load_cases_in_g_envelope_and_margins():
    cases = {"pothole": (3, 0, 1), "kerb": (0, -1, 1), "bump": (0, 0, 3.5)}
    table = vehicles.load_cases(rig("five_link"), cases, unit="g", wheel_load=4000.0, travel={"bump": 0.05})
    one = rig("five_link").loads((0.0, 0.0, 14e3), travel=0.05)
    for name, tension in one.tensions.items():
        np.testing.assert_allclose(table.tensions[name][2], tension, rtol=1e-9)
    low, low_case, high, high_case = table.envelope()["strut"]
    np.testing.assert_allclose([low, high], [np.min(table.tensions["strut"]), np.max(table.tensions["strut"])])
    assert low_case == "bump" and high_case in ("pothole", "kerb") and "bump" in str(table)
    margins = table.margins({"link_1": (20e3, 30e3), "S": 50e3})
    load = np.asarray(table.tensions["link_1"])
    np.testing.assert_allclose(margins["link_1"], np.where(load < 0, 20e3, 30e3) / np.abs(load) - 1, rtol=1e-12)
    kerb = {"kerb": (0, -4e3, 4e3)}
    worst = lambda H: vehicles.load_cases(rig("five_link"), kerb, hardpoints=H).tensions["link_5"][0]
    H = {"O5": jnp.asarray(KINDS["five_link"]["O5"])}
    slope, h = mbs.jit(jax.grad(worst))(H)["O5"][2], 1e-5
    ends = [float(worst({"O5": H["O5"].at[2].add(s * h)})) for s in (1, -1)]
    np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * h), rtol=1e-5)
    with pytest.raises(mbs.ModelError, match="link_9"):
        table.margins({"link_9": 1.0})


@pytest.mark.long
def test_compliance_by_bushings():
    """Work of the load on the wheel is that of the rods and the spring; one rod against a longer one."""
    own, stiffness = rig("five_link"), {f"link_{k}": 4e6 * k for k in range(1, 6)}
    loads = own.loads(FORCE, travel=TRAVEL)
    found = own.compliance(stiffness, FORCE, travel=TRAVEL)
    work = sum(loads.tensions[name] ** 2 / k for name, k in stiffness.items()) + loads.tensions["strut"] * found.strut
    np.testing.assert_allclose(FORCE @ found.contact, work, rtol=1e-8)
    np.testing.assert_allclose(found.centre[2], 0.0, atol=1e-15)
    alone, h = own.compliance({"link_5": 1e6}, FORCE, travel=TRAVEL), 1e-6
    axle = mbs.jit(lambda x: _places(own, jnp.asarray(TRAVEL), jnp.asarray(0.0), {"link_5": x})["axle"])
    toes = [np.arctan(a[0] / a[1]) for a in (axle(h), axle(-h))]
    np.testing.assert_allclose(alone.toe, loads.tensions["link_5"] / 1e6 * (toes[0] - toes[1]) / (2 * h), rtol=1e-6)
    with pytest.raises(mbs.ModelError, match="link_9"):
        own.compliance({"link_9": 1e6}, FORCE)


@pytest.mark.long
def test_steering_axis_roll_centre_and_supports_by_hand():
    """Kingpin through LO and UO; the roll centre where the line to the front view's instant centre meets y = 0."""
    curves = rig("double_wishbone").curves(np.array([-1e-5, 0.0, 1e-5]))
    H = {name: np.asarray(x) for name, x in KINDS["double_wishbone"].items()}
    pin = H["UO"] - H["LO"]
    np.testing.assert_allclose(curves.caster[1], np.arctan(-pin[0] / pin[2]), rtol=1e-9)
    contact = np.asarray(curves.contact)
    dy, dz = (contact[2] - contact[0])[1:]
    np.testing.assert_allclose(curves.roll_centre[1], contact[1, 1] * dy / dz, rtol=1e-5)
    np.testing.assert_allclose(curves.camber_slope[1], (curves.camber[2] - curves.camber[0]) / 2e-5, rtol=1e-5)
    foot = H["LO"] + pin * (contact[1, 2] - H["LO"][2]) / pin[2]
    offset = np.hypot(*(contact[1] - foot)[:2])
    np.testing.assert_allclose(np.hypot(curves.scrub[1], curves.trail[1]), offset, rtol=1e-7)
    np.testing.assert_allclose(curves.wheel_rate(3e4)[1], 3e4 * curves.motion_ratio[1] ** 2)
    np.testing.assert_allclose(curves.anti_dive(0.6, 2.6, 0.5)[1], curves.brake_support[1] * 0.6 * 2.6 / 0.5)
    assert np.all(np.isnan(rig("five_link").curves(0.0).caster))


@pytest.mark.slow
def test_wrong_suspensions_are_refused():
    points = KINDS["double_wishbone"]
    with pytest.raises(mbs.ModelError, match="'UO' is missing"):
        vehicles.double_wishbone({name: x for name, x in points.items() if name != "UO"}, RADIUS)
    with pytest.raises(mbs.ModelError, match="there is no hardpoint 'UX'"):
        vehicles.double_wishbone({**points, "UX": (0, 0, 0)}, RADIUS)
    with pytest.raises(mbs.ModelError, match="three finite numbers"):
        vehicles.double_wishbone({**points, "UO": (0, 0)}, RADIUS)
    with pytest.raises(mbs.ModelError, match="'tie_rod': both ends are in one place"):
        vehicles.double_wishbone({**points, "TO": points["TI"]}, RADIUS)
    with pytest.raises(mbs.ModelError, match="takes a Suspension"):
        vehicles.kc_rig(points)
    loose = vehicles.double_wishbone(points, RADIUS, arms=False)
    kept = {name: x for name, x in loose.hardpoints.items() if name not in ("TI", "TO")}
    loose = vehicles.Suspension(kept, RADIUS, loose.strut, loose.rods[:4])
    with pytest.raises(mbs.ModelError, match="2 freedoms in place of its travel"):
        vehicles.kc_rig(loose)
