"""Freedoms belong to a pose: mechanisms whose pose of use is on another branch than their drawing."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import constraints
from tests.models import PIN, four_bar, four_bar_angles

Y = mbs.Revolute("y")
ARM, WIDTH, TILT, RATE = 0.8, 1.5, 0.6, 4e4  # of the lift [m, m, rad, N/m]
POSE = dict(
    pivotL=-TILT, pivotR=-TILT, footL=np.pi + TILT, footR=np.pi + TILT, topL=-np.pi - TILT, topR=-np.pi - TILT
)
SLIDE, WEIGHT = 2 * ARM * np.cos(TILT), 9.81 * (80 * ARM + 6 * ARM)
SLOPE = -2 * ARM * np.sin(TILT)  # of the slide by the tilt


def lift(rate=RATE, like=None, guess=None, drive=None):
    """A Scott-Russell lift on two sides, drawn flat: there it has two freedoms, at work one."""
    b = mbs.SystemBuilder()
    b.body("carriage", 3.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "carriage")
    for s, x in (("L", 0.0), ("R", WIDTH)):
        b.body("long" + s, 2.0, (ARM, 0, 0), mbs.inertia.rod(2.0, 2 * ARM))
        b.body("short" + s, 2.0, (ARM / 2, 0, 0), mbs.inertia.rod(2.0, ARM))
        own = drive if s == "L" else None
        b.joint("pivot" + s, Y, "ground", "short" + s, parent_frame=(x, 0, 0), drive=own)
        b.joint("foot" + s, Y, "carriage", "long" + s, parent_frame=(x, 0, 0))
        b.joint("mid" + s, Y, "short" + s, "long" + s, parent_frame=(ARM, 0, 0), child_frame=(ARM, 0, 0))
    b.body("platform", 40.0, (0.5, 0, 0.1), (1.0, 1.0, 1.0))
    b.body("shoe", 0.0)
    b.joint("topL", Y, "longL", "platform", parent_frame=(2 * ARM, 0, 0))
    b.joint("topR", Y, "longR", "shoe", parent_frame=(2 * ARM, 0, 0))
    b.joint("slot", mbs.Prismatic("x"), "platform", "shoe", parent_frame=(WIDTH, 0, 0))
    free = SLIDE + WEIGHT * np.cos(TILT) / (rate * SLOPE)  # at rest there
    b.force("spring", mbs.SpringDamper(stiffness=rate, free_length=free), joint="slide")
    return b.build(like=like, guess=guess)


def frequency(rate=RATE):
    """[Hz], in closed form by the tilt."""
    K = -WEIGHT * np.sin(TILT) + rate * SLOPE**2 + WEIGHT * np.cos(TILT) / SLOPE * SLIDE
    M = 3 * SLOPE**2 + 40 * SLIDE**2 + 2 * (2 * ARM**2 + 2 * (2 * ARM) ** 2 / 12) + 2 * (2 * ARM * ARM / 3)
    return np.sqrt(K / M) / 2 / np.pi


def at_work(system):
    return mbs.State.at(system, slide=SLIDE, guess=POSE)


@pytest.fixture(scope="module")
def drawn_flat():
    return lift()


@pytest.fixture(scope="module")
def for_work():
    return lift(guess={**POSE, "slide": SLIDE})


@pytest.mark.long
def test_state_reports_another_mobility_than_the_build(drawn_flat):
    assert drawn_flat.topology.mobility == 2
    with pytest.warns(UserWarning, match=r"mobility 1 at this pose, and 2 .*build\(guess"):
        state = at_work(drawn_flat)
    assert state.ok and state.rank_change == 1
    inside = jax.jit(lambda x: mbs.State.at(drawn_flat, slide=x, guess=POSE))(SLIDE)
    assert inside.rank_change == 1
    assert constraints.count_mobility(drawn_flat, state).mobility == 1
    assert "mobility: 1 (tree velocities 7) at this state, 2 at the pose of the build" in drawn_flat.describe(state)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:state. the mechanism has mobility")
def test_answers_on_the_freedoms_of_the_state(drawn_flat):
    state = at_work(drawn_flat)
    lin = mbs.linearise(drawn_flat, state)
    found = mbs.modes(lin)
    np.testing.assert_allclose(found.frequencies, [frequency()] * 2, rtol=1e-9)
    assert lin.ok and lin.mass.shape == (1, 1)
    rest = mbs.equilibrium(drawn_flat, state)
    assert rest.ok and rest.stable and rest.stiffness.shape == (1, 1)
    np.testing.assert_allclose(rest.stiffness, lin.stiffness, rtol=1e-6)
    np.testing.assert_allclose(mbs.stiffness(drawn_flat, state).total, lin.stiffness, rtol=1e-9)
    assert mbs.constraints.kic(drawn_flat, state).internal.shape == (6, 1)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:state. the mechanism has mobility")
def test_traced_answers_are_not_those_of_another_pose(drawn_flat, for_work):
    """Shapes are those of the build within a trace: NaN on the wrong one, right on one made for the pose."""
    ask = jax.jit(lambda system, state: mbs.linearise(system, state).mass)
    state = at_work(drawn_flat)
    assert np.isnan(ask(drawn_flat, state)).all()
    assert not jax.jit(lambda: mbs.linearise(drawn_flat, state).ok)()
    here = constraints.with_mobility_at(drawn_flat, state)
    np.testing.assert_allclose(ask(here, state), ask(for_work, at_work(for_work)), rtol=1e-9)
    assert np.isnan(jax.jit(lambda: mbs.constraints.kic(drawn_flat, state).internal)()).all()


@pytest.mark.long
def test_build_at_a_pose_of_use(for_work):
    assert for_work.topology.mobility == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        state = mbs.State.at(for_work)  # begins at the guesses of the model
    assert state.ok and state.rank_change == 0
    np.testing.assert_allclose(for_work.coordinates(state)["slide"], SLIDE, atol=1e-9)
    np.testing.assert_allclose(mbs.modes(for_work, state).frequencies, [frequency()] * 2, rtol=1e-9)


@pytest.mark.long
def test_gradient_of_a_frequency_at_the_pose_of_use(for_work):
    def first(rate):
        system = lift(rate, like=for_work)
        return mbs.modes(mbs.linearise(system, at_work(system))).frequencies[0]

    step = 1.0
    difference = (frequency(RATE + step) - frequency(RATE - step)) / (2 * step)
    np.testing.assert_allclose(jax.grad(first)(RATE), difference, rtol=1e-6)


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:state. the mechanism has mobility")
def test_driven_lift_is_solved_not_integrated():
    """Its drive takes the one freedom that it has at work; the branch that the drawing leads to has another."""
    system = lift(drive=lambda t: -TILT + 0.1 * jnp.sin(t))
    assert system.topology.mobility == 1
    state = mbs.State.at(system, guess={**POSE, "slide": SLIDE})
    assert state.rank_change == 1
    motion = mbs.simulate(system, state, ts=jnp.array([0.25, 0.5]))
    assert motion.ok
    np.testing.assert_allclose(motion.diagnostics.constraint_drift, 0.0, atol=1e-9)
    tilt = TILT - 0.1 * np.sin(np.asarray(motion.ts))
    np.testing.assert_allclose(system.coordinates(motion.states)["slide"], 2 * ARM * np.cos(tilt), atol=1e-9)
    assert motion.diagnostics.num_steps < 50  # the spring is stiff: integrated, it takes hundreds


@pytest.mark.long
def test_guess_of_a_joint_begins_every_search():
    angles = dict(zip("ABD", four_bar_angles(0.7), strict=True))
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7)):
        b.body(name, length, (0.5 * length, 0, 0), mbs.inertia.rod(length, length))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0, 0), guess=angles["B"])
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0, 0), guess=angles["D"])
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0, 0), child_frame=(0.7, 0, 0))
    system = b.build()
    for found in (mbs.State.at(system, A=0.7), jax.jit(lambda x: mbs.State.at(system, A=x))(0.7)):
        np.testing.assert_allclose(found.coordinates, list(angles.values()), atol=1e-9)
    mirrored = b.build(guess={"B": -angles["B"], "D": -angles["D"]})
    assert mirrored.coordinates(mbs.State.at(mirrored, A=0.7))["D"] < 0
    assert b.build(like=system).topology == system.topology


@pytest.mark.parametrize(
    "guess, message",
    [
        ({"E": 0.1}, "no joint 'E'"),
        ({"B": "up"}, "guess must be finite real numbers"),
        ({"B": np.nan}, "guess must be finite real numbers"),
        ({"B": (0.1, 0.2)}, "takes 1 coordinates"),
    ],
)
def test_guesses_that_are_none(guess, message):
    with pytest.raises(mbs.ModelError, match=message):
        four_bar(guess=guess)


@pytest.mark.long
def test_singular_pose_keeps_its_answer_and_says_so():
    """A parallelogram laid flat: at that pose, and there alone, it has one freedom more."""
    system = four_bar(lengths=(1.0, 0.4, 1.0, 0.4), guess={"A": 0.5, "B": -0.5, "D": 0.5})
    assert system.topology.mobility == 1
    with pytest.warns(UserWarning, match="mobility 2 at this pose, and 1 .* singular"):
        flat = mbs.State.at(system, A=0.0, guess={"B": 0.0, "D": 0.0})
    assert flat.ok and flat.rank_change == -1
    assert mbs.linearise(system, flat).mass.shape == (2, 2)
    upright = mbs.State.at(system, A=0.5)
    assert upright.rank_change == 0
    assert mbs.linearise(system, upright).mass.shape == (1, 1)


@pytest.mark.long
def test_independent_set_that_is_singular_at_the_state():
    """A slider-crank at its dead centre: the slider does not determine the crank there, the crank does the slider."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    for name, length in (("crank", 0.3), ("rod", 1.0)):
        b.body(name, 1.0, (0.5 * length, 0, 0), mbs.inertia.rod(1.0, length))
    b.body("slider", 2.0)
    b.joint("pin", PIN, "ground", "crank")
    b.joint("big end", PIN, "crank", "rod", parent_frame=(0.3, 0, 0))
    b.joint("way", mbs.Prismatic("x"), "ground", "slider")
    b.joint("small end", PIN, "rod", "slider", parent_frame=(1.0, 0, 0))
    system = b.build(independent=["way"], guess={"pin": 0.5, "way": 1.2})
    off, dead = mbs.State.at(system, pin=0.5), mbs.State.at(system, pin=0.0, guess={"way": 1.3})
    assert mbs.linearise(system, off).names == ("way",)
    lin = mbs.linearise(system, dead)
    assert lin.names != ("way",) and lin.ok
    ask = jax.jit(lambda s, state: mbs.linearise(s, state).ok)
    assert ask(system, off) and not ask(system, dead)
    # the crank's own inertia, the rod's about the fixed small end, seen by the crank: closed form
    turn = {"pin": 1.0, "big end": 1.3}[lin.names[0]]  # what the chosen joint turns while the crank turns by one
    inertia = 0.3**2 / 3 + (1.0 / 3) * 0.3**2
    np.testing.assert_allclose(lin.mass[0, 0] * turn**2, inertia, rtol=1e-9)


def scissors(stages, tilt=0.5):
    """A scissor lift drawn flat with a table that swings on its top, and a pose of use."""
    b, pose = mbs.SystemBuilder(), {"slide": 2 * np.cos(tilt), "top": np.pi - tilt}
    b.body("shoe", 1.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "shoe")
    for k in range(stages):
        for bar in "ab":
            b.body(f"{bar}{k}", 2.0, (1.0, 0, 0), mbs.inertia.rod(2.0, 2.0))
        ends = ("ground", "shoe") if k == 0 else (f"b{k - 1}", f"a{k - 1}")
        for bar, below in zip("ab", ends, strict=True):
            place = (0.0, 0.0, 0.0) if k == 0 else (2.0, 0.0, 0.0)
            b.joint(f"{bar}{k} foot", Y, below, f"{bar}{k}", parent_frame=place)
        b.joint(f"mid{k}", Y, f"a{k}", f"b{k}", parent_frame=(1.0, 0, 0), child_frame=(1.0, 0, 0))
        pose[f"a{k} foot"], pose[f"b{k} foot"] = (
            (-tilt, tilt - np.pi) if k == 0 else (np.pi - 2 * tilt, 2 * tilt - np.pi)
        )
    b.body("table", 20.0, (0.5, 0, 0.1), (1.0, 1.0, 1.0))
    b.joint("top", Y, f"b{stages - 1}", "table", parent_frame=(2.0, 0, 0))
    return b, pose


@pytest.mark.filterwarnings("ignore:state. the mechanism has mobility")
@pytest.mark.parametrize("stages", [1, 2, 3])
def test_scissor_lifts(stages):
    """At work every stage follows the first: two freedoms with the table's, however many stages were drawn flat."""
    b, pose = scissors(stages)
    system = b.build()
    assert system.topology.mobility == stages + 1
    state = mbs.State.at(system, slide=pose["slide"], guess={k: v for k, v in pose.items() if k != "slide"})
    assert state.rank_change == stages - 1
    assert constraints.count_mobility(system, state).mobility == 2
    assert b.build(guess=pose).topology.mobility == 2
