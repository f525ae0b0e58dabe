"""The end of a motion: its derivative, events that are no numbers, and what a lost end does to what was kept."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

TIMES, G = np.array([0.2, 0.4, 0.9]), 9.81


class Bursting(mbs.forces.AbstractSystemLaw):
    drag: jax.Array

    def effort(self, coordinates, velocities, t):
        return -self.drag * velocities + jnp.where(t < 0.5, 0.0, jnp.nan)


def falling(drag=0.5, law=None, like=None):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -G))
    b.body("ball", mass=1.2)
    b.joint("z", mbs.Prismatic("z"), "ground", "ball")
    if law is None:
        b.force("oil", mbs.SpringDamper(damping=drag), joint="z")
    else:
        b.force("oil", law)
    return b.build(like=like)


@pytest.fixture(scope="module")
def ball():
    return falling()


@pytest.mark.parametrize(
    "mode", [pytest.param("reverse", marks=pytest.mark.long), pytest.param("forward", marks=pytest.mark.long)]
)
def test_the_end_of_a_fall_through_oil(ball, mode):
    """v = -g m / c (1 - exp(-c t / m)), by the drag and by the end."""

    def speed(x):
        system = falling(x[0], like=ball)
        return mbs.simulate(system, mbs.State.at(system), t1=x[1], gradient=mode).end.velocities[0]

    c, t, m = 0.5, 0.8, 1.2
    decay = np.exp(-c * t / m)
    wanted = G * m / c**2 * (1.0 - decay) - G * t / c * decay, -G * decay
    slope = jax.jit((jax.jacrev if mode == "reverse" else jax.jacfwd)(speed))(jnp.array([c, t]))
    np.testing.assert_allclose(slope, wanted, rtol=1e-8)


@pytest.mark.long
def test_what_is_lost_is_nan_where_used_and_harms_nothing_where_not():
    """Until it bursts the ball falls through oil; the derivative of what was saved before is that of the fall."""
    like = falling(law=Bursting(jnp.array(0.5)))

    def saved(drag, kept):
        system = falling(law=Bursting(drag), like=like)
        motion = mbs.simulate(system, mbs.State.at(system), ts=TIMES, dt=0.1, solver=diffrax.Tsit5(), throw=False)
        return jnp.sum(motion.states.velocities[: 2 if kept else 3]), motion.end.velocities[0]

    m, c, t = 1.2, 0.5, TIMES[:2]
    decay = np.exp(-c * t / m)
    wanted = np.sum(G * m / c**2 * (1.0 - decay) - G * t / c * decay)
    slope = jax.jit(jax.grad(lambda c: saved(c, True)[0]))
    np.testing.assert_allclose(slope(0.5), wanted, rtol=1e-5)
    assert np.isnan(jax.jit(jax.grad(lambda c: saved(c, False)[0]))(0.5))
    assert np.isnan(jax.jit(jax.grad(lambda c: saved(c, False)[1]))(0.5))


EVENTS = {
    "nowhere a number": (lambda s: s.coordinates[0] * jnp.nan, mbs.Status.NOT_FINITE),
    "no number beyond, its zero before": (lambda s: jnp.sqrt(s.coordinates[0]) - 0.1, mbs.Status.EVENT),
    "no number beyond, no zero": (lambda s: jnp.sqrt(s.coordinates[0] - 0.5) + 1.0, mbs.Status.NOT_FINITE),
}


@pytest.mark.long
@pytest.mark.parametrize("name", EVENTS)
def test_an_event_that_is_no_number_has_a_status(ball, name):
    """The state is one written down by hand, which does not know the joints."""
    event, status = EVENTS[name]
    motion = mbs.simulate(ball, mbs.State(0.0, [1.0], [0.0]), t1=2.0, event=event, throw=False)
    assert motion.status is status
    if status is mbs.Status.EVENT:
        np.testing.assert_allclose(motion.end.coordinates, [0.01], atol=1e-12)


@pytest.mark.long
def test_an_event_in_the_last_of_fixed_steps(ball):
    motion = mbs.simulate(
        ball, mbs.State(0.0, [1.0], [0.0]), t1=0.5, dt=0.05, event=lambda s: s.t - 0.49 + 0.0 * s.t**2
    )
    assert motion.status is mbs.Status.EVENT
    np.testing.assert_allclose(motion.end.t, 0.49, rtol=1e-12)


WRONG = {
    "a truth of diffrax": (diffrax.Event(lambda t, y, args, **kw: y.t > 1.0), "not of a truth value.*vector_field"),
    "diffrax's rest": (diffrax.Event(diffrax.steady_state_event()), "real function.*vector_field"),
    "a number in a list": ([lambda s: s.t, 3.0], "takes a function of a State.*not float"),
    "an action that is none": (mbs.motion.Event(lambda s: s.t, lambda s: s.velocities), "must return a State"),
    "an array": (lambda s: s.coordinates, r"one real number \(\)"),
    "a truth": (lambda s: s.coordinates[0] > 0, "one real number"),
    "none": (lambda s: None, "one real number"),
}


@pytest.mark.parametrize("name", WRONG)
def test_events_that_are_none(ball, name):
    event, words = WRONG[name]
    with pytest.raises(TypeError, match=words):
        mbs.simulate(ball, mbs.State.at(ball), t1=1.0, event=event)


@pytest.mark.parametrize("solver", [diffrax.SemiImplicitEuler(), diffrax.KenCarp4(), diffrax.ItoMilstein()])
def test_solvers_of_other_equations(ball, solver):
    with pytest.raises(ValueError, match="jaxmbs.ode.SemiImplicitEuler|give a solver for ordinary ones"):
        mbs.simulate(ball, mbs.State.at(ball), t1=1.0, dt=0.1, solver=solver)
