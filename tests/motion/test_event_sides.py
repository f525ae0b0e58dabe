"""Motions between, at and around their events, against closed forms: values, peaks, loads and derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.motion import Event, peak

G, MASS, LATCHED = 9.81, 2.0, 0.5


def ball():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("ball", mass=MASS)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    return b.build()


def bounce(restitution=0.8):
    action = lambda s: mbs.State(s.t, s.coordinates, -restitution * s.velocities)
    return Event(lambda s: s.coordinates[0], action, -1, name="floor")


def slider(stiffness, like=None):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("slider", mass=MASS)
    b.joint("x", mbs.Prismatic("x"), "ground", "slider")
    b.force("latch", mbs.SpringDamper(stiffness, free_length=LATCHED), joint="x")
    return b.build(like=like)


def flight(t, height=1.0, restitution=0.8):
    """Height and speed of a ball up to its second bounce."""
    fall = np.sqrt(2.0 * height / G)
    up, late = restitution * G * fall, t - fall
    z = np.where(late < 0.0, height - 0.5 * G * t**2, up * late - 0.5 * G * late**2)
    return z, np.where(late < 0.0, -G * t, up - G * late)


@pytest.mark.long
def test_states_and_peaks_beside_an_impact():
    """The fastest fall is just before the impact, the fastest rise just after it, at no saved time."""
    system, ts = ball(), np.linspace(0.0, 1.0, 11)
    motion = mbs.simulate(system, mbs.State.at(system, z=1.0), ts=ts, event=bounce())
    fall = np.sqrt(2.0 / G)
    t = np.sort(np.append(np.random.default_rng(3).uniform(0.0, 1.0, 40), [fall - 1e-9, fall + 1e-9, 0.45]))
    found = motion.at(system, t)
    np.testing.assert_allclose(found.coordinates[:, 0], flight(t)[0], atol=1e-11)
    np.testing.assert_allclose(found.velocities[:, 0], flight(t)[1], atol=1e-10)
    record = motion.events
    assert float(record.times[0]) == pytest.approx(fall, abs=1e-12)
    for side, sign in ((record.before, -1.0), (record.after, 0.8)):
        assert float(side.velocities[0, 0]) == pytest.approx(sign * np.sqrt(2.0 * G), abs=1e-11)
        assert np.isnan(side.velocities[1:]).all() and np.isinf(side.t[1:]).all()
    at_impact = motion.at(system, record.times[0])
    assert float(at_impact.velocities[0]) == pytest.approx(0.8 * np.sqrt(2.0 * G), abs=1e-11)
    for sign, size in ((-1.0, 1.0), (1.0, 0.8)):
        most = peak(system, motion, lambda s, sign=sign: sign * s.velocities[0])
        assert float(most.value) == pytest.approx(size * np.sqrt(2.0 * G), abs=1e-11)
        assert float(most.time) == pytest.approx(fall, abs=1e-12)
    energy = peak(system, motion, lambda s: mbs.dynamics.kinetic_energy(system, s))
    assert float(energy.value) == pytest.approx(MASS * G, abs=1e-9)


@pytest.mark.long
def test_the_motion_with_both_sides_of_its_events():
    system, ts = ball(), np.linspace(0.0, 1.0, 11)
    motion = mbs.simulate(system, mbs.State.at(system, z=1.0), ts=ts, event=bounce())
    whole = motion.with_knots(system)
    fall = np.sqrt(2.0 / G)
    np.testing.assert_allclose(np.unique(whole.ts.round(9)), np.sort(np.append(ts, fall)).round(9))
    np.testing.assert_allclose(whole.states.coordinates[:, 0], flight(np.asarray(whole.ts))[0], atol=1e-11)
    k = int(np.flatnonzero(np.diff(whole.ts) == 0.0)[0])
    assert whole.states.velocities[k, 0] < 0.0 < whole.states.velocities[k + 1, 0]
    accounts = whole.diagnostics
    lost = float(accounts.work["floor"][k + 1] - accounts.work["floor"][k])
    assert lost == pytest.approx(-(1.0 - 0.8**2) * MASS * G, abs=1e-9)
    assert float(accounts.kinetic[k]) == pytest.approx(MASS * G, abs=1e-9)
    assert np.abs(accounts.energy_residual).max() < 1e-9
    assert whole.with_knots(system) is whole
    later = mbs.simulate(system, mbs.State.at(system, z=1.0), ts=np.array([0.6, 0.8]), event=bounce()).with_knots(
        system
    )
    assert later.ts.min() == 0.6  # an event before the first saved time is not of these states


@pytest.mark.long
@pytest.mark.parametrize("early", [0.0, 0.25])
def test_at_the_time_of_an_event_the_state_is_that_after_it(early):
    """A clock that kicks at a saved time."""
    system = slider(0.0)
    kick = Event(lambda s: s.t - 0.5, lambda s: mbs.State(s.t, s.coordinates, s.velocities + 1.0), 1, name="kick")
    ts = np.linspace(early, 1.0, 5)
    motion = mbs.simulate(system, mbs.State.at(system, x=0.0, velocities={"x": 1.0}), ts=ts, event=kick)
    speed = lambda t: np.where(t >= 0.5, 2.0, 1.0)
    np.testing.assert_allclose(motion.states.velocities[:-1, 0], speed(ts), rtol=1e-12)
    t = np.array([0.3, 0.4999, 0.5, 0.5001, 0.9])
    found = motion.at(system, t)
    np.testing.assert_allclose(found.velocities[:, 0], speed(t), rtol=1e-12)
    np.testing.assert_allclose(found.coordinates[:, 0], np.where(t >= 0.5, 2.0 * t - 0.5, t), atol=1e-12)


def latched(p, gradient="reverse"):
    """Values, loads and peaks after a latch that takes some of the speed."""
    stiffness, speed, part = p
    system = slider(0.0)
    after = slider(stiffness, system)
    catch = Event(
        lambda s: s.coordinates[0] - LATCHED,
        lambda s: mbs.State(s.t, s.coordinates, part * s.velocities),
        direction=1,
        system=after,
        name="catch",
    )
    start = mbs.State.at(system, x=0.0, velocities={"x": speed})
    motion = mbs.simulate(
        system, start, ts=np.linspace(0.0, 1.0, 81), event=catch, gradient=gradient, rtol=1e-11, atol=1e-12
    )
    load = lambda s: mbs.reactions(system, s).law("latch").effort[..., 0]
    here = motion.at(system, jnp.array([0.47, 0.53]))
    slowest = peak(system, motion, lambda s: -s.velocities[0])
    single = jnp.stack([load(motion)[68], slowest.value, slowest.time, motion.events.times[0]])
    return jnp.concatenate([here.coordinates[:, 0], here.velocities[:, 0], single])


def closed_form(p):
    stiffness, speed, part = p
    w, caught = np.sqrt(stiffness / MASS), LATCHED / speed
    x = lambda t: speed * t if t < caught else LATCHED + part * speed / w * np.sin(w * (t - caught))
    v = lambda t: speed if t < caught else part * speed * np.cos(w * (t - caught))
    pull = lambda t: 0.0 if t < caught else -stiffness * (x(t) - LATCHED)
    t = 0.47, 0.53
    return np.array([*map(x, t), *map(v, t), pull(0.85), part * speed, caught + np.pi / w, caught])


@pytest.mark.long
@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_derivatives_through_a_latch(gradient):
    p = np.array([400.0, 1.0, 0.9])
    slopes = jax.jacrev if gradient == "reverse" else jax.jacfwd
    J, value = jax.jit(slopes(lambda p: (latched(p, gradient),) * 2, has_aux=True))(p)
    wanted = closed_form(p)
    steps = np.diag([1e-3, 1e-6, 1e-6])
    differences = np.stack([(closed_form(p + d) - closed_form(p - d)) / (2.0 * d.max()) for d in steps], axis=1)
    np.testing.assert_allclose(value, wanted, atol=1e-7)
    np.testing.assert_allclose(J, differences, atol=5e-6, rtol=1e-6)
