"""`peak` between the saved times, against closed forms and dense simulations."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.status import Status
from tests import models
from tests.models import four_bar, four_bar_state

TIGHT = {"rtol": 1e-12, "atol": 1e-12}


def pendulum(length=1.0, joint="x", like=None):
    return models.pendulum((0.0, 0.0, -length), joint, pin="A", like=like, mass=2.0, inertia=(1e-3, 1e-3, 1e-3))


PENDULUM = pendulum()


def support(system, state):
    return jnp.linalg.norm(mbs.reactions(system, state)["A"].force)


def swing(length, times, event=None):
    """The motion of the pendulum from rest at 1.2 rad."""
    system = pendulum(length, like=PENDULUM)
    return system, mbs.simulate(system, mbs.State.at(system, A=1.2), ts=times, event=event, **TIGHT)


@jax.jit
@jax.vmap
@functools.partial(jax.value_and_grad, has_aux=True)
def swings(length):
    """Peak of the support force by pendulum length, with its slope; the largest saved force."""
    system, motion = swing(length, jnp.linspace(0.0, 0.9, 10))
    found = mbs.motion.peak(system, motion, lambda s: support(system, s))
    return found.value, (found, jnp.max(jax.vmap(lambda s: support(system, s))(motion.states)))


@pytest.mark.long
def test_pendulum_between_coarse_times():
    """The support carries most at the bottom: m g + m l u^2 with l u^2 from the fall; and by how much for length."""
    lengths = np.array([0.9, 1.0, 1.1])

    def exact(l):
        return 2.0 * 9.81 * (1.0 + 2.0 * l**2 / (l**2 + 1e-3 / 2.0) * (1.0 - np.cos(1.2)))

    (value, (found, saved)), slope = swings(lengths)
    np.testing.assert_allclose(value, exact(lengths), rtol=1e-6)
    np.testing.assert_allclose(slope, (exact(lengths + 1e-6) - exact(lengths - 1e-6)) / 2e-6, atol=1e-4)
    np.testing.assert_allclose(found.state.coordinates[:, 0], 0.0, atol=1e-3)
    np.testing.assert_array_equal(found.state.t, found.time)
    assert (value > 1.001 * saved).any()


@pytest.mark.long
def test_ends_events_and_failures():
    """The speed of the fall is largest at the end, or where an event ends it; without a motion there is no peak."""
    times = jnp.linspace(0.0, 0.3, 4)
    speed = lambda s: jnp.stack([jnp.abs(s.velocities[0]), s.coordinates[0]])
    system, motion = swing(1.0, times)
    found = mbs.motion.peak(system, motion, speed)
    np.testing.assert_array_equal(found.value, [-motion.states.velocities[-1, 0], 1.2])
    np.testing.assert_array_equal(found.time, [0.3, 0.0])
    system, motion = swing(1.0, times, event=lambda s: s.coordinates[0] - 1.1)
    assert motion.result == Status.EVENT
    found = mbs.motion.peak(system, motion, speed)
    end = motion.ts[jnp.isfinite(motion.ts)][-1]
    assert 0.1 < end < 0.3 and found.time[0] == end and jnp.isfinite(found.value).all()
    failed = mbs.Motion(motion.ts, motion.states, jnp.asarray(Status.MAX_STEPS), motion.diagnostics, motion.end)
    assert np.isnan(mbs.motion.peak(system, failed, speed).value).all()


@pytest.mark.long
def test_batches_are_refused():
    _, motion = swing(1.0, jnp.linspace(0.0, 0.3, 4))
    with pytest.raises(ValueError, match="one motion"):
        mbs.motion.peak(PENDULUM, jax.tree.map(lambda x: jnp.stack([x, x]), motion), lambda s: s.t)


@pytest.mark.long
def test_ball_and_spinning_bob():
    """A ball joint's state between saved times is that of a dense simulation."""
    system = pendulum(joint=mbs.Spherical())
    turn = np.r_[np.cos(0.6), np.sin(0.6), 0.0, 0.0]
    start = mbs.State.at(system, A=turn, velocities={"A": (0.3, 1.0, 0.5)})
    motion = mbs.simulate(system, start, ts=jnp.linspace(0.0, 1.0, 21), **TIGHT)
    found = jax.jit(lambda m: mbs.motion.peak(system, m, lambda s: support(system, s)))(motion)
    dense = mbs.simulate(system, start, ts=jnp.reshape(found.time, 1), **TIGHT).states
    np.testing.assert_allclose(found.state.coordinates, dense.coordinates[0], atol=1e-7)
    np.testing.assert_allclose(found.state.velocities, dense.velocities[0], atol=1e-6)
    assert found.time % 0.05 > 1e-4


@pytest.mark.long
def test_spikes_in_a_four_bar():
    """Loads of all pins of a fast four-bar, against a dense simulation; the slope of their sum by a mass."""
    like = four_bar()

    def loads(system, state):
        reactions = mbs.reactions(system, state)
        return jnp.stack([jnp.linalg.norm(reactions[name].force) for name in "ABCD"])

    def run(mass, ts):
        system = four_bar(masses=(1.0, mass, 1.5), like=like)
        return system, mbs.simulate(system, four_bar_state(system, rate=6.0), ts=ts, rtol=1e-11, atol=1e-11)

    def largest(mass, ts):
        system, motion = run(mass, ts)
        return jnp.max(jax.vmap(lambda s: loads(system, s))(motion.states), axis=0)

    @functools.partial(jax.value_and_grad, has_aux=True)
    def peaks(mass):
        system, motion = run(mass, jnp.linspace(0.0, 1.5, 151))
        found = mbs.motion.peak(system, motion, lambda s: loads(system, s))
        return jnp.sum(found.value), found

    peaks, largest = jax.jit(peaks), jax.jit(largest)
    (total, found), slope = peaks(2.0)
    around = found.time[:, None] + 1e-4 * jnp.arange(-2.0, 3.0)[None]
    np.testing.assert_allclose(found.value, largest(2.0, jnp.sort(jnp.ravel(around))), rtol=1e-6)
    np.testing.assert_allclose(slope, (peaks(2.001)[0][0] - peaks(1.999)[0][0]) / 0.002, rtol=1e-5)


@pytest.mark.long
def test_peak_loads_of_every_joint_are_one_table():
    """A weight on an arm: its pin carries most at the bottom, by the fall; the weld the moment of its offset too."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("arm", 0.0)
    b.body("bob", mass=2.0, com=(0.0, 0.1, 0.0))
    b.joint("A", mbs.Revolute("x"), "ground", "arm")
    b.joint("seat", mbs.Weld(), "arm", "bob", parent_frame=(0.0, 0.0, -1.0))
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, A=1.2), ts=jnp.linspace(0.0, 1.2, 10), **TIGHT)
    peaks = mbs.motion.load_peaks(system, motion)
    r, tilt = np.hypot(1.0, 0.1), np.arctan2(0.1, 1.0)  # a point mass on a string of this length, tilted in the arm
    most = 2.0 * 9.81 * (1.0 + 2.0 * (1.0 - np.cos(1.2 + tilt)))
    for name in ("A", "seat"):
        np.testing.assert_allclose(peaks.force[name].value, most, rtol=1e-5)
        np.testing.assert_allclose(peaks.force[name].state.coordinates, [-tilt], atol=1e-3)
    # about its frame the weld holds the weight's force, which points along the string, at 0.1 m from the arm's line
    np.testing.assert_allclose(peaks.moment["seat"].value, most * 0.1 / r, rtol=1e-5)
    table = peaks.to_pandas()
    assert list(table.columns) == ["value", "time", "A"] and len(table) == 4
    np.testing.assert_allclose(table.loc[("seat", "force"), "time"], peaks.force["seat"].time)
    assert "seat" in repr(peaks) and "at [s]" in repr(peaks)


@pytest.mark.long
def test_the_time_of_a_peak_moves_with_what_the_quantity_knows():
    """A falling weight passes a height c: the time of it by c is one over its speed, through a closure of c; the
    state there moves along."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("weight", 1.0)
    b.joint("z", mbs.Prismatic("z"), "ground", "weight")
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=jnp.linspace(0.0, 1.0, 5), **TIGHT)

    def passing(c):
        found = mbs.motion.peak(system, motion, lambda state: -((state.coordinates[0] - c) ** 2))
        return jnp.stack([found.time, found.state.t, found.state.coordinates[0], found.state.velocities[0]])

    speed = np.sqrt(2 * 9.81 * 1.5)
    for slope in (jax.jacrev(passing), jax.jacfwd(passing)):
        np.testing.assert_allclose(
            mbs.jit(slope, compile="tape")(-1.5), [-1 / speed, -1 / speed, 1.0, 9.81 / speed], rtol=1e-4
        )


@pytest.mark.long
def test_programs_are_kept_by_what_the_quantity_does():
    """The angle of a fall is largest at its start; what a function reads from a list counts at each call."""
    system, motion = swing(1.0, jnp.linspace(0.0, 0.3, 4))
    scale = [1.0]
    for scale[0] in (1.0, 2.0):
        found = mbs.motion.peak(system, motion, lambda s: scale[0] * s.coordinates[0])
        np.testing.assert_allclose(found.value, scale[0] * 1.2, rtol=1e-9)
    sine = lambda: mbs.motion.peak(system, motion, lambda s: jnp.sin(s.coordinates[0]))
    first, events = sine(), []
    jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: events.append(event))
    again = sine()
    assert not any("backend_compile" in event for event in events)
    np.testing.assert_allclose([first.value, again.value], np.sin(1.2), rtol=1e-9)
