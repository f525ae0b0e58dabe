"""Events that act and go on, against closed forms: bounces, latches, several at once, their work and derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.motion import Event
from tests.models import four_bar

G, MASS = 9.81, 1.2
END = 1.3
FLOOR = lambda s: s.coordinates[0]


def ball():
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("ball", mass=MASS)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    return b.build()


def slider(stiffness=0.0, length=0.1, like=None):
    """A mass on a rail without gravity, and a spring that a latch may couple."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("slider", mass=2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "slider")
    b.force("spring", mbs.SpringDamper(stiffness=stiffness, free_length=length), joint="x")
    return b.build(like=like)


def bounce(restitution):
    return Event(FLOOR, lambda s: mbs.State(s.t, s.coordinates, -restitution * s.velocities), -1, name="floor")


def bounced(height, restitution, t):
    """Height of a ball at a time t after two bounces."""
    fall = jnp.sqrt(2.0 * height / G)
    speed = G * fall * restitution
    second, again = fall + 2.0 * speed / G, speed * restitution
    return again * (t - second) - 0.5 * G * (t - second) ** 2


@pytest.fixture(scope="module")
def falling():
    return ball()


def drop(system, x, mode="reverse", **options):
    start = mbs.State.at(system, z=x[0])
    return mbs.simulate(system, start, t1=END, event=bounce(x[1]), gradient=mode, **options)


X = jnp.array([1.0, 0.8])  # height [m], restitution


@pytest.mark.long
def test_a_bouncing_ball_and_its_derivatives_forward(falling):
    """Times of the bounces, the energy lost, and derivatives through the jumps by height and restitution."""

    def end(x):
        motion = drop(falling, x, "forward")
        return (motion.end.coordinates[0], motion.events.times[1]), motion

    slope, motion = jax.jit(jax.jacfwd(end, has_aux=True))(X)
    fall = np.sqrt(2.0 / G)
    np.testing.assert_allclose(motion.events.times[:3], [fall, 2.6 * fall, np.inf], rtol=1e-9)
    assert motion.events.named() == ["floor", "floor"] and int(motion.events.count) == 2
    assert motion.status is mbs.Status.SUCCESS and "floor" in repr(motion.events)
    np.testing.assert_allclose(motion.end.coordinates[0], bounced(*X, END), rtol=1e-9)
    np.testing.assert_allclose(slope[0], jax.grad(lambda x: bounced(*x, END))(X), rtol=1e-7)
    np.testing.assert_allclose(slope[1], [1.3 * fall, 2.0 * fall], rtol=1e-7)  # of sqrt(2 h / g) (1 + 2 e)
    lost = motion.diagnostics.work["floor"]
    np.testing.assert_allclose(lost[-1], -MASS * G * (1.0 - 0.8**4), rtol=1e-9)
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-8


@pytest.mark.long
def test_a_bouncing_ball_in_reverse_and_by_differences(falling):
    height = lambda x: drop(falling, x).end.coordinates[0]
    slope = jax.jit(jax.grad(height))(X)
    np.testing.assert_allclose(slope, jax.grad(lambda x: bounced(*x, END))(X), rtol=1e-7)
    value, h = jax.jit(height), 1e-5
    differences = [(value(X + h * e) - value(X - h * e)) / (2.0 * h) for e in np.eye(2)]
    np.testing.assert_allclose(slope, differences, rtol=1e-5)


@pytest.mark.long
def test_saved_states_between_bounces_have_derivatives_where_interpolated(falling):
    """Before, between and after the bounces, the steps passing over the saved times."""
    times = np.array([0.2, 0.7, 1.3])

    def heights(x):
        start = mbs.State.at(falling, z=x[0])
        return mbs.simulate(falling, start, ts=times, event=bounce(x[1]), interpolate=True).states.coordinates[:3, 0]

    def exact(x):
        fall = jnp.sqrt(2.0 * x[0] / G)
        speed = G * fall * x[1]
        first = x[0] - 0.5 * G * times[0] ** 2
        return jnp.stack([first, speed * (times[1] - fall) - 0.5 * G * (times[1] - fall) ** 2, bounced(*x, times[2])])

    found, back = jax.vjp(jax.jit(heights), X)
    np.testing.assert_allclose(found, exact(X), rtol=1e-8)
    np.testing.assert_allclose([back(row)[0] for row in np.eye(3)], jax.jacfwd(exact)(X), rtol=1e-6, atol=1e-9)


@pytest.mark.long
def test_bounces_in_a_batch(falling):
    heights = jnp.array([1.0, 1.1, 0.3])
    times = jax.jit(jax.vmap(lambda h: drop(falling, (h, 0.8)).events.times[:2]))(heights)
    fall = np.sqrt(2.0 * heights / G)
    np.testing.assert_allclose(times, np.stack([fall, 2.6 * fall], 1), rtol=1e-8)


@pytest.mark.parametrize(
    "restitution", [pytest.param(0.5, marks=pytest.mark.long), pytest.param(0.0, marks=pytest.mark.long)]
)
def test_bounces_without_end_have_a_status(falling, restitution):
    """The bounces accumulate before the end, or the ball does not leave the floor at all: it never falls through."""
    start = mbs.State.at(falling, z=1.0)
    motion = mbs.simulate(falling, start, t1=3.0, event=bounce(restitution), max_events=40, throw=False)
    assert motion.status is mbs.Status.EVENTS and int(motion.events.count) == 40
    fall = np.sqrt(2.0 / G)
    np.testing.assert_allclose(motion.end.t, fall * (3.0 if restitution else 1.0), rtol=1e-6)
    with pytest.raises(mbs.SimulationError, match="max_events"):
        mbs.simulate(falling, start, t1=3.0, event=bounce(restitution), max_events=40)


@pytest.mark.parametrize(
    "mode", [pytest.param("reverse", marks=pytest.mark.long), pytest.param("forward", marks=pytest.mark.long)]
)
def test_a_latch_couples_a_spring(mode):
    """A spring 0.1 m short is coupled at x = 0: its energy is the event's work, and the motion is harmonic."""
    free = slider()

    def run(x):
        coupled = slider(x[1], like=free)
        start = mbs.State.at(free, x=-1.0, velocities={"x": x[0]})
        return mbs.simulate(free, start, t1=1.0, event=Event(FLOOR, system=coupled, name="latch"), gradient=mode)

    def exact(x):
        w, t = jnp.sqrt(x[1] / 2.0), 1.0 - 1.0 / x[0]
        return 0.1 - 0.1 * jnp.cos(w * t) + x[0] / w * jnp.sin(w * t)

    x = jnp.array([2.0, 8.0])  # speed, stiffness

    def ended(x):
        motion = run(x)
        return motion.end.coordinates[0], motion

    slope, motion = jax.jit((jax.jacrev if mode == "reverse" else jax.jacfwd)(ended, has_aux=True))(x)
    end = motion.end.coordinates[0]
    np.testing.assert_allclose(end, exact(x), rtol=1e-9)
    np.testing.assert_allclose(slope, jax.grad(exact)(x), rtol=1e-7)
    np.testing.assert_allclose(motion.diagnostics.work["latch"][-1], 0.5 * 8.0 * 0.01, rtol=1e-10)
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-9 and motion.events.named() == ["latch"]


@pytest.mark.long
def test_catch_release_and_end_in_their_order():
    """A spring catches the slider, throws it back and lets go; another event ends the motion; one never comes."""
    free = slider()
    events = [
        Event(lambda s: s.t - 10.0, name="late"),
        Event(lambda s: s.coordinates[0] + 0.5, direction=-1, name="far"),
        Event(FLOOR, system=slider(8.0, 0.0, like=free), direction=1, name="catch"),
        Event(FLOOR, system=free, direction=-1, name="release"),
    ]
    motion = mbs.simulate(free, mbs.State.at(free, x=-1.0, velocities={"x": 2.0}), t1=9.0, event=events)
    assert motion.status is mbs.Status.EVENT and motion.events.named() == ["catch", "release", "far"]
    half = np.pi / np.sqrt(8.0 / 2.0)
    np.testing.assert_allclose(motion.events.times[:3], [0.5, 0.5 + half, 0.75 + half], rtol=1e-9)
    np.testing.assert_allclose(motion.end.velocities, -2.0, rtol=1e-9)


@pytest.mark.long
def test_an_action_that_breaks_the_loop_is_projected():
    """A crank is stopped dead: the velocities asked for break the loop, the nearest in energy do not."""
    system = four_bar()
    start = mbs.State.at(system, A=0.6, velocities={"A": 2.0})
    stop = Event(
        lambda s: s.coordinates[0] - 0.62, lambda s: mbs.State(s.t, s.coordinates, s.velocities.at[0].set(0.0))
    )
    motion = mbs.simulate(system, start, t1=0.3, event=stop)
    assert motion.ok and int(motion.events.count) >= 1
    assert np.nanmax(motion.diagnostics.velocity_drift) < 1e-9
    assert abs(motion.diagnostics.work["event 0"][-1]) > 0.01  # of a state that is not the one asked for
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-6


def test_what_events_cannot_do(falling):
    start = mbs.State.at(falling, z=1.0)
    run = lambda **options: mbs.simulate(falling, start, t1=1.0, **options)
    with pytest.raises(ValueError, match="loop='diffeqsolve' has no events that act"):
        run(event=bounce(0.5), loop="diffeqsolve")
    with pytest.raises(ValueError, match="direction=2"):
        run(event=Event(FLOOR, direction=2))
    with pytest.raises(ValueError, match="names of their own"):
        run(event=[bounce(0.5), bounce(0.6)])
    with pytest.raises(ValueError, match="another structure"):
        run(event=Event(FLOOR, system=slider()))
    with pytest.raises(ValueError, match="max_events=0"):
        run(event=bounce(0.5), max_events=0)
