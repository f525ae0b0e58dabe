"""Gradients of motions and equilibria at special places: saved times at the ends, rest, zero angles, springs of no
length, a motion of no duration, hanging, toggles, neutral and critical equilibria."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxmbs as mbs
from tests.models import four_bar

from .slopes import Slopes
from .test_special_places import BY_CRANK, COUNT, REGULAR, like

SEEDS = st.integers(0, 2**30)
FEW = settings(max_examples=3, deadline=None, derandomize=True)
TIGHT = {"rtol": 1e-11, "atol": 1e-11}

# -------------------------------------------------------------------------------------------------- a sprung swing
# numbers: mass, lever, stiffness, damping, free angle, stiffness of a spring of no free length, angle, rate, two
# saved times; then what is no parameter: the first saved time, and the angle where the second spring has no length
SWING = np.array([1.0, 0.5, 3.0, 0.2, 0.1, 4.0, 0.3, 0.4, 0.25, 0.5, 0.1, 0.7])


def swing(p):
    b = mbs.SystemBuilder()
    b.body("arm", mass=p[0], com=(0.0, 0.0, -p[1]), inertia=(0.01, 0.1, 0.1))
    b.joint("pin", mbs.Revolute("y"), "ground", "arm")
    b.force("torsion", mbs.SpringDamper(p[2], p[3], p[4]), joint="pin")
    hook = 0.4 * jnp.stack([-jnp.sin(p[11]), 0.0 * p[11], -jnp.cos(p[11])])
    b.force("spring", mbs.SpringDamper(p[5]), between=(("ground", hook), ("arm", np.array([0.0, 0.0, -0.4]))))
    return b.build()


def swing_motion(p, gradient):
    """Angles, rates and pin forces at three saved times, weighted."""
    system = swing(p)
    ts = jnp.stack([p[10], p[8], p[9]])
    state = mbs.State(jnp.zeros(()), p[6:7], p[7:8])
    motion = mbs.simulate(system, state, ts=ts, gradient=gradient, **TIGHT)
    force = mbs.reactions(system, motion)["pin"].force
    weights = jnp.array([1.0, 2.0, 3.0])
    found = motion.states.coordinates[:, 0] + 0.3 * motion.states.velocities[:, 0] + 0.05 * force[:, 0]
    return jnp.dot(weights, found + 0.02 * force[:, 2])


@functools.cache
def swing_slopes():
    return Slopes(lambda p: swing_motion(p, "reverse"), 10, lambda p: swing_motion(p, "forward"))


def changed(numbers, **entries):
    found = numbers.copy()
    for place, value in entries.items():
        found[int(place[1:])] = value
    return found


SWINGS = {
    "regular": SWING,
    "first time at the start": changed(SWING, _10=0.0),
    "zero angle": changed(SWING, _6=0.0),
    "at rest": changed(SWING, _7=0.0, _10=0.0),
    "hanging at rest, spring of no length": changed(SWING, _4=0.0, _6=0.0, _7=0.0, _11=0.0),
    "spring of no length on its way": changed(SWING, _6=0.7, _11=0.7),
}


@pytest.mark.long
def test_motions():
    """Reverse, forward and differences, by parameters, start and saved times."""
    swing_slopes().check(SWINGS, tolerance=1e-6, agreement=1e-7)


@pytest.mark.long
@FEW
@given(seed=SEEDS)
def test_motions_drawn(seed):
    random = np.random.default_rng(seed)
    drawn = SWING * np.r_[random.uniform(0.5, 2.0, 8), np.ones(4)]
    still = changed(drawn, _7=0.0, _10=0.0)
    rows = [drawn, still, *SWINGS.values()][: len(SWINGS)]
    swing_slopes().check(dict(enumerate(rows)), tolerance=1e-6, agreement=1e-7)


@pytest.mark.long
def test_a_saved_time_at_the_start_and_no_duration_at_all():
    """All of `ts` equal to t0: derivatives by the start are those of the start, by each time the rates there."""

    def angles(p, gradient):
        motion = mbs.simulate(swing(p), mbs.State(jnp.zeros(()), p[6:7], p[7:8]), ts=p[8:11], gradient=gradient)
        return jnp.concatenate([motion.states.coordinates[:, 0], motion.states.velocities[:, 0]])

    @jax.jit
    def slopes(p):
        return (
            angles(p, "reverse"),
            jax.jacrev(lambda p: angles(p, "reverse"))(p),
            jax.jacfwd(lambda p: angles(p, "forward"))(p),
        )

    none = changed(SWING, _8=0.0, _9=0.0, _10=0.0)
    values, reverse, forward = slopes(jnp.asarray(none))
    np.testing.assert_allclose(values, np.repeat(SWING[6:8], 3), rtol=1e-12)
    np.testing.assert_allclose(reverse, forward, atol=1e-9)
    np.testing.assert_allclose(reverse[:3, 6], 1.0, rtol=1e-9)
    np.testing.assert_allclose(reverse[3:, 7], 1.0, rtol=1e-9)
    np.testing.assert_allclose(reverse[:, :6], 0.0, atol=1e-12)
    state = mbs.State(jnp.zeros(()), jnp.asarray(none[6:7]), jnp.asarray(none[7:8]))
    rates = np.diag([SWING[7]] * 3), np.diag([mbs.forward_dynamics(swing(none), state)[0][0]] * 3)
    np.testing.assert_allclose(reverse[:, 8:11], np.concatenate(rates), rtol=1e-9, atol=1e-12)


# -------------------------------------------------------------------------------------------------- a loop in motion
def loop_motion(p, gradient):
    """The end of a short motion of a four-bar and what its pins carry there."""
    system = four_bar(tuple(p[:4]), tuple(p[4:7]), p[7], p[8], like=like())
    state = mbs.State.at(system, A=p[9], velocities={"A": p[10]}, guess={"B": p[12], "D": p[13]})
    motion = mbs.simulate(system, state, ts=jnp.array([0.0, 0.1]), gradient=gradient, rtol=1e-10, atol=1e-10)
    loads = mbs.reactions(system, motion)
    parts = [motion.states.coordinates.ravel(), motion.states.velocities.ravel(), loads["C"].force.ravel()]
    return jnp.dot(np.random.default_rng(2).normal(size=18), jnp.concatenate(parts))


@functools.cache
def loop_slopes():
    like()
    return Slopes(lambda p: loop_motion(p, "reverse"), COUNT, lambda p: loop_motion(p, "forward"))


@pytest.mark.long
def test_motions_of_a_loop():
    """From rest, through zero angles, with links in line; one design cannot close: NaN in that lane only."""
    loop_slopes().check(BY_CRANK, agreement=1e-7)
    rows = np.array(list(BY_CRANK.values()))
    good, _ = loop_slopes().gradients(rows)
    rows[2, :4], rows[2, 9] = (1.0, 0.3, 0.2, 0.3), 2.5
    for found in loop_slopes().gradients(rows):
        assert np.all(np.isnan(found[2]))
        np.testing.assert_allclose(np.delete(found, 2, axis=0), np.delete(good, 2, axis=0), rtol=1e-6, atol=1e-8)


# -------------------------------------------------------------------------------------------------------- equilibria
# numbers: mass, lever, stiffness, free angle, load to the side; then the angle to search from
REST = np.array([2.0, 0.8, 20.0, 1.0, 3.0, 0.2])


def rest(p, throw=False):
    b = mbs.SystemBuilder()
    b.body("bob", mass=p[0], com=(0.0, 0.0, -p[1]), inertia=0.001)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("spring", mbs.SpringDamper(p[2], free_length=p[3]), joint="pin")
    b.force("push", mbs.Force(p[4] * jnp.array([1.0, 0.0, 0.0])), on=("bob", np.array([0.0, 0.0, -0.8])))
    system = b.build()
    start = mbs.State(jnp.zeros(()), p[5:6], jnp.zeros(1))
    found = mbs.equilibrium(system, start, throw=False)
    force = mbs.reactions(system, found.state)["pin"].force
    return found, found.state.coordinates[0] + 0.01 * found.stiffness[0, 0] + 0.02 * force[2]


@functools.cache
def rest_slopes():
    return Slopes(lambda p: rest(p)[1], 5)


RESTS = {
    "regular": REST,
    "hanging": changed(REST, _2=0.0, _3=0.0, _4=0.0),
    "hanging, searched from there": changed(REST, _3=0.0, _4=0.0, _5=0.0),
    "standing": changed(REST, _2=0.0, _3=np.pi, _4=0.0, _5=3.0),
    "no weight": changed(REST, _1=1e-3, _4=0.0),
}


@pytest.mark.long
def test_equilibria():
    rest_slopes().check(RESTS, tolerance=1e-5)


@pytest.mark.long
@FEW
@given(seed=SEEDS)
def test_equilibria_drawn(seed):
    random = np.random.default_rng(seed)
    draw = lambda: REST * np.r_[random.uniform(0.5, 2.0, 5), 1.0]
    rest_slopes().check({k: draw() for k in range(len(RESTS))}, tolerance=1e-5)


UNDEFINED = {
    "neutral: neither weight nor spring": changed(REST, _1=0.0, _2=0.0, _4=0.0),
    "upside down at the critical spring": changed(REST, _1=-0.8, _2=2.0 * 9.81 * 0.8, _3=0.0, _4=0.0, _5=0.0),
}


@pytest.mark.long
def test_equilibria_without_derivative():
    """Where the stiffness vanishes an equilibrium is no function of the numbers: no finite slope of the angle may be
    given there."""
    rows = jnp.asarray(np.array([*UNDEFINED.values(), *RESTS.values()])[: len(RESTS)])
    slope = jax.jit(jax.vmap(jax.grad(lambda p: rest(p)[0].state.coordinates[0])))(rows)
    by_load = np.asarray(slope)[: len(UNDEFINED), 4]
    assert np.all(~np.isfinite(by_load) | (np.abs(by_load) > 1e6)), by_load


@pytest.mark.long
def test_equilibria_of_a_loop():
    """A sprung four-bar, and one without spring and load; a design that cannot close is not found, and NaN."""

    def angle(p):
        system = four_bar(tuple(p[:4]), tuple(p[4:7]), p[7], p[8], like=like())
        state = mbs.State.at(system, A=p[9], guess={"B": p[12], "D": p[13]})
        found = mbs.equilibrium(system, state, throw=False)
        return found.state.coordinates @ jnp.array([1.0, 0.5, -0.3]) + 1e-3 * jnp.sum(found.stiffness)

    like()
    slopes = Slopes(angle, 9)
    stiff, free = REGULAR.copy(), REGULAR.copy()
    stiff[7], free[7:9] = 8.0, 0.0
    slopes.check({"regular": stiff, "free": free}, tolerance=1e-5)
    short = stiff.copy()
    short[:4], short[9] = (1.0, 0.3, 0.2, 0.3), 2.5
    for found in slopes.gradients([stiff, short]):
        assert np.all(np.isfinite(found[0])) and np.all(np.isnan(found[1]))
