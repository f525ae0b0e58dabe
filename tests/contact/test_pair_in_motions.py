"""Contacts that leave the range of their model in a motion and come back: status, margin and time by closed forms.

A mass on a linear contact moves as on a spring while it is pressed: its depth is `v / w sin(w t)`, on the way in and
back, also beyond the end of the model, where the numbers go on.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs.friction import BrownMcPhee, LuGre

from .test_contact import PAIRS

MASS, STIFFNESS, SPEED = 2.0, 2e6, 0.5
RATE = np.sqrt(STIFFNESS / MASS)  # [rad/s]
DEEPEST = SPEED / RATE
SHARE = 0.5  # of the depth, at which the model ends: passed at pi / 6 and 5 pi / 6
PHASES = np.array([0.1, 0.16, 0.17, 0.5, 0.8, 0.84, 1.0, 1.2]) * np.pi  # 0.16 and 0.84 pi are inside
LINEAR = C.HuntCrossley(STIFFNESS, 1.0)
FRICTIONS = {"smooth": None, "dry": BrownMcPhee(0.3, 0.42, 0.01), "bristles": LuGre(0.3, 1e3, 10.0)}
STRAIGHT = {"journal": (6e-4, 8e-4, 0.0), "cylinder": (0.1, 0.2, 0.1)}  # places of pairs whose own ones are tilted
EVERY = [("plane", "smooth")] + [
    pytest.param(*kinds, marks=pytest.mark.long)
    for kinds in [(name, "smooth") for name in PAIRS if name != "plane"]
    + [("plane", "dry"), ("plane", "bristles"), ("journal", "bristles")]
]


def pressed(name, friction=None):
    """A mass that slides along the normal of a pair, from where it just touches at a speed, without tilt."""
    pair, place, along = PAIRS[name]
    place = STRAIGHT.get(name, place)
    turned = Rotation.from_euler("x", 90 * (name == "cylinder"), degrees=True).as_matrix()
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", MASS, inertia=1.0, position=place, rotation=turned)
    b.joint("way", mbs.Prismatic(np.divide(along, np.linalg.norm(along))), "ground", "mass", at=place)
    b.contact("touch", pair, "mass", "ground", LINEAR, friction, max_depth=SHARE * DEEPEST)
    system = b.build()
    return system, mbs.State.at(system, {"way": 0.0}, {"way": SPEED})


def motion_of(system, start, ts, **options):
    return mbs.simulate(system, start, ts=ts, rtol=1e-9, atol=1e-12, throw=False, **options)


@pytest.mark.parametrize(("name", "friction"), EVERY)
def test_pressed_beyond_the_depth_and_back(name, friction):
    system, start = pressed(name, FRICTIONS[friction])
    motion = motion_of(system, start, PHASES / RATE)
    assert motion.status == mbs.Status.VALIDITY and not motion.ok
    pressed_by = np.where(PHASES <= np.pi, np.sin(PHASES), np.pi - PHASES)  # it leaves as fast as it came
    found = mbs.dynamics.validity(system, motion)
    left = found.margins["touch"]["depth"].value
    np.testing.assert_allclose(left, DEEPEST * (SHARE - pressed_by), rtol=0.0, atol=1e-6 * DEEPEST)
    np.testing.assert_array_equal(found.ok, pressed_by <= SHARE)
    np.testing.assert_allclose(motion.states.velocities[-1, 0], -SPEED, rtol=1e-6)
    most, first = DEEPEST * (1.0 - SHARE), PHASES[2] / RATE
    words = f"'touch' is pressed deeper than its max_depth, by {most:.3g} m, first at {first:.6g} s"
    assert found.faults() == [words]


@pytest.mark.long
def test_the_error_of_such_a_motion_says_so_and_its_places_have_derivatives():
    system, start = pressed("plane")
    with pytest.raises(mbs.SimulationError, match="'touch' is pressed deeper than its max_depth, by 0.000"):
        mbs.simulate(system, start, ts=PHASES / RATE, rtol=1e-9, atol=1e-12)

    def places(speed, gradient):
        there = mbs.State(start.t, start.coordinates, jnp.reshape(speed, 1), start.residual, start.structure)
        motion = motion_of(system, there, PHASES / RATE, gradient=gradient)
        return motion.states.coordinates[jnp.array([3, -1]), 0]

    wanted = np.array([1.0, np.pi - PHASES[-1]]) / RATE  # depth over speed
    np.testing.assert_allclose(jax.jacfwd(places)(SPEED, "forward"), wanted, rtol=1e-6)
    np.testing.assert_allclose(jax.jacrev(places)(SPEED, "reverse"), wanted, rtol=1e-6)


@pytest.mark.long
def test_a_sphere_passes_through_another():
    """The force has no direction where the centres meet; beyond it is as on the way in, and the speed comes back."""
    reach, speed = 0.1, 1.2 * 0.1 * RATE
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", MASS)
    b.joint("way", mbs.Prismatic("x"), "ground", "mass")
    b.contact("touch", C.SphereOnSphere(0.4 * reach, 0.6 * reach), "mass", "ground", LINEAR)
    system = b.build()
    middle = np.arcsin(RATE * reach / speed) / RATE  # when the centres meet
    ts = middle * np.array([0.5, 1.0 - 1e-3, 1.0, 1.0 + 1e-3, 1.5, 2.0, 2.1])
    motion = motion_of(system, mbs.State.at(system, {"way": -reach}, {"way": speed}), ts)
    assert motion.status == mbs.Status.VALIDITY
    found = mbs.dynamics.validity(system, motion)
    np.testing.assert_array_equal(found.ok, [True, False, False, False, True, True, True])
    (fault,) = found.faults()
    assert fault.startswith("'touch' has both centres at one place") and f"first at {ts[1]:.6g} s" in fault
    x = np.asarray(motion.states.coordinates[:, 0])
    np.testing.assert_allclose(x[4], -x[0], rtol=1e-6)
    np.testing.assert_allclose(motion.states.velocities[-2:, 0], speed, rtol=1e-6)


def swinging(pair, axis, place=(0.0, 0.0, 0.0), start=0.0, rate=1.0, stiffness=1.0):
    """A round part that turns about an axis through its middle at a place of the surface, on a spring by angle."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("part", 1.0, inertia=1.0, position=place)
    b.joint("pin", mbs.Revolute(axis), "ground", "part", at=place)
    if stiffness:
        b.force("spring", mbs.SpringDamper(stiffness), joint="pin")
    b.contact("touch", pair, "part", "ground", LINEAR)
    system = b.build()
    return system, mbs.State.at(system, {"pin": start}, {"pin": rate})


TILTS = {  # pair, its place apart from the surface, unit, and the margin by the angle
    "roller": (PAIRS["cam"][0], (0.1, 0.0, 0.0), lambda a: 0.1 - np.abs(a), "has axes that are not parallel"),
    "journal": (
        C.JournalInBush(0.01, 5e-4, 1e-3),
        (0.0, 0.0, 0.0),
        lambda a: 2.5e-4 - 0.01 * (1.0 / np.cos(a) - 1.0),
        "tilts so much that its sections are no circles",
    ),
}


@pytest.mark.parametrize(
    "name", [pytest.param("roller", marks=pytest.mark.long), pytest.param("journal", marks=pytest.mark.long)]
)
def test_axes_tilt_and_come_back(name):
    """The angle is a sine, whose rate at the start is its largest angle; the parts are apart all the time."""
    pair, place, margin, words = TILTS[name]
    most = {"roller": 0.15, "journal": 0.3}[name]
    system, start = swinging(pair, "x", place, rate=most)
    ts = np.array([0.3, 0.6, 1.5, 2.6, 3.0])
    motion = motion_of(system, start, ts)
    assert motion.status == mbs.Status.VALIDITY
    found = mbs.dynamics.validity(system, motion)
    wanted = margin(most * np.sin(ts))
    np.testing.assert_allclose(found.margins["touch"]["tilt"].value, wanted, rtol=1e-6, atol=1e-9)
    assert wanted[0] > 0 > wanted[2] and wanted[-1] > 0
    (fault,) = found.faults()
    assert words in fault and f"first at {ts[np.argmax(wanted < 0)]:.6g} s" in fault


@pytest.mark.long
def test_a_journal_leaves_its_bush_and_comes_back():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("pin", 1.0, inertia=1.0)
    b.joint("way", mbs.Prismatic("z"), "ground", "pin")
    b.force("spring", mbs.SpringDamper(1.0), joint="way")
    b.contact("touch", C.JournalInBush(0.01, 1e-3, 0.02), "pin", "ground", LINEAR)
    system = b.build()
    ts = np.array([0.5, 1.5, 3.0, 4.5])
    motion = motion_of(system, mbs.State.at(system, {"way": 0.0}, {"way": 0.03}), ts)
    found = mbs.dynamics.validity(system, motion)
    np.testing.assert_allclose(
        found.margins["touch"]["reach"].value, 0.02 - np.abs(0.03 * np.sin(ts)), rtol=0.0, atol=1e-9
    )
    assert motion.status == mbs.Status.VALIDITY
    most = 0.03 * np.sin(1.5) - 0.02
    assert found.faults() == [f"'touch' has left its bush along the axis, by {most:.3g} m, first at 1.5 s"]


@pytest.mark.long
@pytest.mark.parametrize("height", [0.145, 0.2])
def test_a_cylinder_turns_over_its_end(height):
    """Where it touches, by one rim on both sides of the upright pose and by half of the stiffness, its speed is that
    of the energy; in the air it stands on no end."""
    system, start = swinging(
        C.CylinderOnPlane(0.1, 0.3), "y", (0.0, 0.0, height), start=-1.5, rate=60.0, stiffness=0.0
    )
    ts = np.linspace(1e-3, 0.055, 400)
    motion = motion_of(system, start, ts)
    angle, speed = np.asarray(motion.states.coordinates[:, 0]), np.asarray(motion.states.velocities[:, 0])
    depth = np.maximum(0.1 * np.abs(np.sin(angle)) + 0.15 * np.cos(angle) - height, 0.0)
    np.testing.assert_allclose(speed**2 + 0.5 * STIFFNESS * depth**2, 60.0**2, rtol=1e-6)
    assert angle[-1] > 1.5
    found = mbs.dynamics.validity(system, motion)
    stands = (np.abs(angle) < 0.01) & (depth > 0.0)
    np.testing.assert_array_equal(found.ok, ~stands)
    assert motion.status == (mbs.Status.VALIDITY if height < 0.15 else mbs.Status.SUCCESS)
    if height < 0.15:
        (fault,) = found.faults()
        assert "'touch' has an end on the plane" in fault and f"first at {ts[np.argmax(stands)]:.6g} s" in fault
