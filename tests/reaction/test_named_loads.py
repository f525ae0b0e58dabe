"""Efforts at joints by what exerts them: drives, actuators, every law on a joint, couplers, rows; the sums close."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.forces.test_forces import LAWS
from tests.models import PIN, four_bar, four_bar_state

FREE = ("spring_damper", "friction")
INERTIA, ACCELERATION, RATE, START = 0.1, 3.0, 2.0, 0.5


def on_every_joint(coordinates, velocities, t):
    return jnp.cos(jnp.arange(velocities.size)) + 0.1 * velocities


def tied(coordinates, t):
    return coordinates[-2] - 2.0 * coordinates[-1]


def geared(coordinates, velocities, t):
    return velocities[-4] + 3.0 * velocities[-3]


@pytest.fixture(scope="module")
def rotors():
    """For each law a driven rotor with it at the shaft, for two a free one; then pairs tied by a coupler, by rows of
    the user and of velocity, the first of each driven; a law on the whole system and a torque on one body."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))

    def rotor(name, driven):
        b.body(name, 1.0, inertia=INERTIA)
        drive = mbs.forces.Polynomial((START, RATE, ACCELERATION / 2.0)) if driven else None
        b.joint(name, PIN, "ground", name, parent_frame=(0.0, 0.0, 0.1), drive=drive)

    for name, law in LAWS.items():
        for kind in ("driven", "free")[: 1 + (name in FREE)]:
            rotor(f"{name} {kind}", kind == "driven")
            b.force(f"{name} on {kind}", law, joint=f"{name} {kind}")
    for kind in ("coupler", "slip", "rows"):
        for k in (1, 2):
            rotor(f"{kind} {k}", k == 1)
            b.force(f"grease of {kind} {k}", mbs.SpringDamper(damping=0.3), joint=f"{kind} {k}")
    b.constraint("coupler", mbs.Coupler({"coupler 1": 20.0, "coupler 2": 60.0}))
    b.constraint("slip", mbs.joints.VelocityRows(geared))
    b.constraint("rows", mbs.joints.PositionRows(tied))
    b.force("everywhere", mbs.forces.GeneralisedEffort(on_every_joint))
    b.force("wind", mbs.Torque((0.0, 0.0, 0.7)), on="spring_damper driven")
    system = b.build()
    free, rates = {f"{name} free": 0.4 for name in FREE}, {f"{name} free": 1.5 for name in FREE}
    return system, mbs.State.at(system, free, velocities=rates)


def loads_and_sums(rotors, **options):
    """Reactions, accelerations, and by joint what the named parts exert along its freedom."""
    system, state = rotors
    loads, q, u = mbs.reactions(system, state, **options), system.coordinates(state), system.velocities(state)
    sums = {}
    for k, name in enumerate(joint for joint, *_ in system.topology.structure):
        laws = [loads.laws[law].effort[0] for law in loads.laws if law.endswith(f"of {name}")]
        base, _, kind = name.rpartition(" ")
        if base in LAWS:
            at = loads.law(f"{base} on {kind}").effort
            np.testing.assert_allclose(at[0], LAWS[base].effort(q[name], u[name], 0.0), rtol=1e-12, atol=1e-12)
            laws.append(at[0])
        rows = [float(row.efforts[name][0]) for row in loads.rows.values() if name in row.efforts]
        drive = [float(loads.drives[name].effort[0])] if name in loads.drives else []
        sums[name] = drive + laws + rows + [float(loads.law("everywhere").effort[k])]
    return loads, sums


@pytest.mark.long
def test_the_sums_close_over_all_laws_couplers_rows_and_drives(rotors):
    system, state = rotors
    loads, sums = loads_and_sums(rotors)
    assert loads.ok
    drives = [name for name in sums if name.endswith("driven") or name.endswith(" 1")]
    assert sorted(loads.drives) == sorted(drives)
    wanted = mbs.inverse_dynamics(system, state, actuators=drives)
    assert wanted.ok
    a = system.by_joint(mbs.forward_dynamics(system, state)[0])
    for name, parts in sums.items():
        load, wind = loads[name], 0.7 * (name == "spring_damper driven")
        np.testing.assert_allclose(load.total_effort, [sum(parts)], atol=1e-9)
        np.testing.assert_allclose(load.total_effort, load.moment[2:], atol=1e-9)
        np.testing.assert_allclose(load.total_effort[0], INERTIA * a[name] - wind, atol=1e-9)  # Newton, about z
        alone = wanted[name] if name in drives else load.total_effort
        np.testing.assert_allclose(load.effort, alone, atol=1e-9)
        if name in drives:
            assert load.effort is not load.total_effort and loads.drive(name).unique.all()
            np.testing.assert_allclose(loads.drive(name).effort, load.effort, atol=0.0)
    assert abs(loads["friction driven"].effort[0] - loads["friction driven"].total_effort[0]) > 1.0


@pytest.mark.long
def test_actuators_in_place_of_the_drives(rotors):
    """The second of each pair is the actuator: the first, whose drive is off, is turned by what ties them."""
    system, state = rotors
    actuators = [name for name in system.topology.joint_names if name.endswith("driven") or name.endswith(" 2")]
    loads, sums = loads_and_sums(rotors, actuators=actuators)
    wanted = mbs.inverse_dynamics(system, state, actuators=actuators)
    assert loads.ok and wanted.ok and sorted(loads.drives) == sorted(actuators)
    for name, parts in sums.items():
        np.testing.assert_allclose(loads[name].total_effort, [sum(parts)], atol=1e-9)
        if name in actuators:
            np.testing.assert_allclose(loads[name].effort, wanted[name], atol=1e-9)
    u, same = system.velocities(state), mbs.reactions(system, state)
    for kind in ("coupler", "slip", "rows"):  # the same power on either side
        power = same.drive(f"{kind} 1").effort[0] * u[f"{kind} 1"]
        np.testing.assert_allclose(loads.drive(f"{kind} 2").effort[0] * u[f"{kind} 2"], power, rtol=1e-8)
    with pytest.raises(mbs.UnknownNameError, match=r"loads\['coupler 1'\]"):
        loads.drive("coupler 1")


@pytest.mark.long
def test_couplers_and_rows_say_what_they_leave_out(rotors):
    """Bearings of tied shafts are short of the forces where the teeth touch, whichever way they are tied; the axial
    moment is known all the same, and nothing else is marked."""
    loads = mbs.reactions(*rotors)
    for name, load in loads.items():
        short = name.rpartition(" ")[2] in "12"
        assert bool(load.lacks_contact) == short
        np.testing.assert_array_equal(load.unique_force, [not short] * 3)
        np.testing.assert_array_equal(load.unique_moment, [not short] * 2 + [True])
    assert "bearings carry no contact forces of coupler, rows, slip" in repr(loads)


@pytest.mark.long
def test_contact_goes_through_the_joints_between():
    """A gear from the first arm to the third: the joint between is short of it as well, that to the tool is not."""
    b = mbs.SystemBuilder()
    for k in range(4):
        b.body(f"arm{k}", 1.0, (0.5, 0, 0), (0.1, 0.1, 0.1))
        b.joint(f"J{k}", PIN, f"arm{k - 1}" if k else "ground", f"arm{k}", parent_frame=(1.0 if k else 0.0, 0, 0))
    b.constraint("belt", mbs.Coupler({"J0": 1.0, "J2": -2.0}))
    b.constraint("lock", mbs.Coupler({"J3": 1.0}))  # one joint alone has no contact elsewhere
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system))
    assert [bool(loads[f"J{k}"].lacks_contact) for k in range(4)] == [True, True, True, False]
    assert loads["J3"].unique_force.all() and not loads["J1"].unique_force.any()


@pytest.mark.long
def test_couplers_that_share_have_no_one_multiplier():
    """Two gears between the same shafts share the work; a third between others does not."""
    b = mbs.SystemBuilder()
    for name in "abcd":
        b.body(name, 1.0, inertia=0.1)
        b.joint(name, PIN, "ground", name)
    b.constraint("one", mbs.Coupler({"a": 1.0, "b": 2.0}))
    b.constraint("two", mbs.Coupler({"a": 2.0, "b": 4.0}))
    b.constraint("other", mbs.Coupler({"c": 1.0, "d": 2.0}))
    system = b.build()
    loads = mbs.reactions(system, mbs.State.at(system))
    assert [bool(loads.row(name).unique[0]) for name in ("one", "two", "other")] == [False, False, True]
    assert "not determined by statics" in repr(loads.row("one"))
    said = system.describe()
    assert "redundant constraints: 1; statics does not determine all reactions of: one, two\n" in said
    assert "other couples coordinates: reactions of c, d do not include its contact forces" in said


@pytest.mark.long
def test_names_are_found_behind_the_right_door(rotors):
    loads = mbs.reactions(*rotors)
    for wrong, right in (
        (lambda: loads.law("coupler"), r"loads.row\('coupler'\)"),
        (lambda: loads.row("wind"), r"loads.law\('wind'\)"),
        (lambda: loads["everywhere"], r"loads.law\('everywhere'\)"),
        (lambda: loads.law("coupler 1"), r"loads.drive\('coupler 1'\)"),
        (lambda: loads.drive("rows 2"), r"loads\['rows 2'\]"),
    ):
        with pytest.raises(mbs.UnknownNameError, match=right):
            wrong()
    assert "multiplier " in repr(loads.row("coupler")) and "0.7" in repr(loads.law("wind"))


@pytest.mark.long
def test_accelerations_that_tear_the_loop_are_not_ok():
    """As `reactions` says of the same: no actuators make them, though their efforts balance."""
    system = four_bar()
    state = four_bar_state(system)
    torn, free = np.array([1.0, 0.0, 0.0]), mbs.forward_dynamics(system, state)[0]
    for a, possible in ((torn, False), (free, True)):
        found = mbs.inverse_dynamics(system, state, a, actuators=["A", "B", "D"])
        assert bool(found.ok) == possible and found.gap < 1e-6 and (found.row_gap < 1e-6) == possible
        loads = mbs.reactions(system, state, accelerations=a, actuators=["A", "B", "D"])
        assert bool(loads.ok) == possible
        assert not loads.drive("A").unique[0] and not loads["C"].unique_force[:2].any()  # three share the work of one
