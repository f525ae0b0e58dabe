"""Two equal bearings share a load alike, wherever the builder had to cut a body open."""

import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN


def shaft(drives=(), springs=(), swap=False):
    """A shaft of 2 kg whose weight acts 0.3 m beside the axis, in the middle of two pins 1 m apart."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    b.body("shaft", mass=2.0, com=(0.3, 0.0, 0.5), inertia=(0.02, 0.02, 0.01))
    places = {"front": (0.0, 0.0, 0.0), "back": (0.0, 0.0, 1.0)}
    for name in sorted(places, reverse=not swap):
        place = places[name]
        b.joint(name, PIN, "ground", "shaft", parent_frame=place, child_frame=place)
    for name in drives:
        b.drive(name, lambda t: 0.0 * t)
    for name in springs:
        b.force(f"spring {name}", mbs.SpringDamper(stiffness=0.0), joint=name)
    b.force("motor", mbs.Torque((0.0, 0.0, 1.0)), on="shaft")
    system = b.build()
    return system, mbs.reactions(system, mbs.State.at(system))


@pytest.mark.parametrize(
    "swap", [pytest.param(False, marks=pytest.mark.slow), pytest.param(True, marks=pytest.mark.long)]
)
def test_two_drives_share_weight_and_torque(swap):
    system, loads = shaft(drives=("front", "back"), swap=swap)
    torque = 2.0 * 9.81 * 0.3 - 1.0
    for name in ("front", "back"):
        np.testing.assert_allclose(loads[name].force[1], 9.81, rtol=1e-9)
        np.testing.assert_allclose(loads[name].moment[2], torque / 2.0, rtol=1e-9)
    assert set(loads) == {"front", "back"} == {name for name, _ in loads.items()}
    assert loads.residual < 1e-9
    assert any(joint.is_hidden for joint in system.topology.joints)


@pytest.mark.long
def test_one_drive_takes_the_torque():
    _, loads = shaft(drives=("front",))
    np.testing.assert_allclose([loads[n].force[1] for n in ("front", "back")], 9.81, rtol=1e-9)
    np.testing.assert_allclose([loads[n].moment[2] for n in ("front", "back")], [4.886, 0.0], atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("swap", [False, True])
def test_springs_without_stiffness_change_nothing(swap):
    """The shaft swings down; both bearings carry the half."""
    _, plain = shaft(swap=swap)
    _, sprung = shaft(springs=("front", "back"), swap=swap)
    for name in ("front", "back"):
        np.testing.assert_allclose(sprung[name].force, plain[name].force, atol=1e-9)
        np.testing.assert_allclose(sprung[name].moment, plain[name].moment, atol=1e-9)
    np.testing.assert_allclose(plain["front"].force, plain["back"].force, atol=1e-9)


@pytest.mark.long
def test_bonds_carry_the_same():
    system, loads = shaft(drives=("front", "back"))
    found = mbs.statics.bond_reactions(*mbs.reaction.reaction_bonds(system, mbs.State.at(system)))
    for name, load in loads.items():
        np.testing.assert_allclose(found[name].force, load.force, atol=1e-8)
        np.testing.assert_allclose(found[name].moment, load.moment, atol=1e-8)


UPPER = (0.3, 0.1, 1.8)
KINDS = {  # directions (force x y z, moment x y z) that each of two joints carries
    "pins": ((PIN, [0, 1, 2, 3, 4]), (PIN, [0, 1, 2, 3, 4])),
    "pin and weld": ((PIN, [0, 1, 2, 3, 4]), (mbs.Weld(), range(6))),
    "ball and weld": ((mbs.Spherical(), [0, 1, 2]), (mbs.Weld(), range(6))),
    "welds": ((mbs.Weld(), range(6)), (mbs.Weld(), range(6))),
}


def gate(kind, unit):
    """A gate of 20 kg on two joints in line, or anywhere, lengths in metres over `unit`."""
    upper, com = ((0.0, 0.0, 1.8), (0.0, 0.0, 0.6)) if kind == "pins" else (UPPER, (0.4, 0.2, 0.6))
    b = mbs.SystemBuilder(gravity=(0.0, -9.81 * unit, 0.0))
    b.body("gate", 20.0, com=tuple(unit * x for x in com), inertia=tuple(unit**2 * x for x in (5, 6, 2)))
    for name, place, (joint, _) in zip(("lower", "upper"), ((0, 0, 0), upper), KINDS[kind], strict=True):
        at = tuple(unit * x for x in place)
        b.joint(name, joint, "ground", "gate", parent_frame=at, child_frame=at)
    return b.build(), np.array([(0, 0, 0), upper]), np.array(com)


@pytest.mark.long
@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("method", ["dense", "frontal", "multifrontal"])
def test_shares_are_those_of_least_norm_in_any_unit_of_length(kind, method):
    """Against NumPy's least norm of all components that the joints carry, moments over the system's length."""
    for unit in (1.0, 1000.0):
        system, places, com = gate(kind, unit)
        length = float(system.length) / unit
        loads = mbs.reactions(system, mbs.State.at(system), method=method)
        columns = []
        for place, (_, carried) in zip(places, KINDS[kind], strict=True):
            force = np.concatenate([np.eye(3), np.cross(place, np.eye(3))], axis=1)
            moment = np.concatenate([np.zeros((3, 3)), length * np.eye(3)], axis=1)
            columns.append(np.concatenate([force, moment])[list(carried)])
        weight = 20.0 * 9.81 * np.array([0.0, 1.0, 0.0])
        need = np.concatenate([weight, np.cross(com, weight)])
        parts = np.split(np.linalg.lstsq(np.concatenate(columns).T, need, rcond=None)[0], [len(columns[0])])
        for name, part, (_, carried) in zip(("lower", "upper"), parts, KINDS[kind], strict=True):
            all_six = np.zeros(6)
            all_six[list(carried)] = part
            np.testing.assert_allclose(loads[name].force / unit, all_six[:3], atol=1e-8)
            np.testing.assert_allclose(loads[name].moment / unit**2 / length, all_six[3:], atol=1e-8)
