"""What `simulate` refuses, how it ends, and what each status means."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.models import DOWN_Y, PIN, four_bar, four_bar_angles


def falling(load=None):
    b = mbs.SystemBuilder()
    b.body("ball", mass=2.0, inertia=np.ones(3))
    b.joint("fall", mbs.Prismatic(axis="z"), "ground", "ball")
    if load is not None:
        b.force("load", mbs.Actuator(load), joint="fall")
    return b.build()


@pytest.fixture(scope="module")
def ball():
    system = falling()
    return system, mbs.State.at(system, fall=5.0, velocities={"fall": 1.0})


class Unusable:
    pass


@pytest.mark.parametrize(
    "options, message",
    [
        ({"t1": 1.0, "gradient": "backsolve"}, "gradient='backsolve' must be one of reverse, forward"),
        (
            {"t1": 1.0, "gradient": diffrax.BacksolveAdjoint()},
            "motion without its projection",
        ),
        ({"t1": 1.0, "solver": "RK4"}, "solver must be a diffrax solver"),
        ({"t1": 1.0, "solver": Unusable()}, "solver must be a diffrax solver"),
        ({"t1": 1.0, "formulation": "lagrange"}, "formulation='lagrange' must be one of canonical, independent"),
        ({"t1": 1.0, "solver": mbs.ode.SemiImplicitEuler()}, "SemiImplicitEuler needs dt="),
        (
            {"t1": 1.0, "dt": 0.1, "solver": mbs.ode.SemiImplicitEuler(), "formulation": "canonical"},
            "SemiImplicitEuler needs",
        ),
        ({"t1": 1.0, "solver": diffrax.Euler()}, "Euler has no error estimate: give dt="),
        ({"t1": 1.0, "dt": -0.1}, "dt must be positive, got -0.1"),
        ({}, "give t1= .* or ts="),
        ({"ts": [0.0, 0.5, 0.2]}, "ts must increase"),
        ({"ts": [-1.0, 0.5]}, "ts must increase and start at or after the start of the motion at 0"),
        ({"ts": []}, "ts must be a list of times, got shape"),
        ({"ts": [[0.0, 1.0]]}, "ts must be a list of times, got shape"),
    ],
)
def test_refused_options(ball, options, message):
    with pytest.raises(ValueError, match=message):
        mbs.simulate(*ball, **options)


@pytest.mark.long
def test_default_times_and_closed_form(ball):
    motion = mbs.simulate(*ball, t1=2.0)
    t = np.linspace(0.0, 2.0, 101)
    np.testing.assert_allclose(motion.ts, t, atol=1e-15)
    np.testing.assert_allclose(motion.states.coordinates[:, 0], 5.0 + t - 9.81 / 2 * t**2, atol=1e-9)
    np.testing.assert_allclose(motion.states.velocities[:, 0], 1.0 - 9.81 * t, atol=1e-9)
    assert motion.status is mbs.Status.SUCCESS and bool(motion.ok)


def _height(state):
    return state.coordinates[0]


@pytest.mark.long
def test_an_event_ends_the_motion(ball):
    """It hits the ground at (v + sqrt(v^2 + 2 g h)) / g; that state is saved last, later times are not filled."""
    hit = (1.0 + np.sqrt(1.0 + 2 * 9.81 * 5.0)) / 9.81
    motion = mbs.simulate(*ball, ts=[0.5, 1.0, 1.1, 1.2, 1.5], event=_height)
    assert motion.status is mbs.Status.EVENT and bool(motion.ok)
    t = np.array([0.5, 1.0, 1.1, hit])
    np.testing.assert_allclose(motion.ts[:4], t, atol=1e-9)
    np.testing.assert_allclose(motion.states.coordinates[:4, 0], 5.0 + t - 4.905 * t**2, atol=1e-8)
    np.testing.assert_allclose(motion.states.velocities[3, 0], 1.0 - 9.81 * hit, atol=1e-8)
    assert np.isinf(np.asarray(motion.ts[4:])).all() and np.isnan(np.asarray(motion.states.coordinates[4:])).all()


@pytest.mark.long
def test_an_event_that_never_comes(ball):
    motion = mbs.simulate(*ball, ts=[0.2, 0.4], event=_height)
    assert motion.status is mbs.Status.SUCCESS
    np.testing.assert_allclose(motion.ts, [0.2, 0.4, 0.4])


@pytest.mark.long
def test_status_of_too_few_steps(ball):
    with pytest.raises(mbs.SimulationError, match="maximum number of steps reached") as caught:
        mbs.simulate(*ball, t1=1.0, max_steps=2)
    assert caught.value.motion.status is mbs.Status.MAX_STEPS
    motion = mbs.simulate(*ball, t1=1.0, max_steps=2, throw=False)
    assert int(motion.result) == 2 and not bool(motion.ok)


def _explode(x, v, t):
    return jnp.where(t > 0.5, jnp.nan, 0.0)


@pytest.mark.long
def test_status_of_a_state_that_is_not_finite():
    system = falling(_explode)
    motion = mbs.simulate(system, mbs.State.at(system), t1=1.0, dt=0.1, solver=diffrax.Tsit5(), throw=False)
    assert motion.status is mbs.Status.NOT_FINITE and "the state is not finite" in str(motion.status)
    with pytest.raises(mbs.SimulationError, match="not finite"):
        mbs.simulate(system, mbs.State.at(system), t1=1.0, dt=0.1, solver=diffrax.Tsit5())


def _blow_up(x, v, t):
    return 2.0 * (9.81 + (1.0 + v * v))


@pytest.mark.long
def test_status_of_a_step_that_vanishes():
    """v_dot = 1 + v^2 is infinite at t = pi / 2."""
    system = falling(_blow_up)
    motion = mbs.simulate(system, mbs.State.at(system), t1=2.0, throw=False, max_steps=2000)
    assert not bool(motion.ok)
    assert motion.status in (mbs.Status.STEP_SIZE, mbs.Status.NOT_FINITE, mbs.Status.MAX_STEPS)


def double_driven(second):
    """Both ends of a four-bar prescribed: consistent only when the rocker follows the crank."""
    b = mbs.SystemBuilder(gravity=DOWN_Y)
    for name, length in {"crank": 0.3, "coupler": 0.9, "rocker": 0.7}.items():
        b.body(name, mass=1.0, com=(length / 2, 0.0, 0.0), inertia=(0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "crank", drive=lambda t: 0.7 + t)
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0), drive=second)
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    return b.build()


@pytest.mark.long
def test_status_of_drives_that_contradict():
    start = four_bar_angles(0.7)
    system = double_driven(lambda t: start[2] + 0.0 * t)
    assert system.topology.mobility == 0
    h = 1e-6
    rate = (four_bar_angles(0.7 + h) - four_bar_angles(0.7 - h)) / (2 * h)
    state = mbs.State(jnp.zeros(()), jnp.asarray(start), jnp.asarray(rate))
    motion = mbs.simulate(system, state, ts=jnp.array([0.0, 0.1, 0.2]), throw=False)
    assert motion.status in (mbs.Status.INCONSISTENT, mbs.Status.NOT_ASSEMBLED)
    with pytest.raises(mbs.SimulationError, match="the constraints contradict|the initial state does not satisfy"):
        mbs.simulate(system, state, ts=jnp.array([0.0, 0.1, 0.2]))


@pytest.fixture(scope="module")
def loop():
    return four_bar()


@pytest.mark.long
def test_status_of_a_start_that_is_not_assembled(loop):
    far = four_bar((1.88, 0.3, 0.9, 0.7), like=loop)
    state = mbs.State(jnp.zeros(()), jnp.array([0.7, -0.3, 1.5]), jnp.zeros(3))
    motion = mbs.simulate(far, state, t1=0.1, dt=0.01, solver=diffrax.Tsit5(), throw=False)
    assert motion.status is mbs.Status.NOT_ASSEMBLED


@pytest.mark.long
def test_fixed_steps_are_counted(loop):
    _, B, D = four_bar_angles(0.7)
    state = mbs.State.at(loop, A=0.7, guess={"B": B, "D": D})
    motion = mbs.simulate(loop, state, t1=0.1, dt=0.01, solver=diffrax.Tsit5())
    assert int(motion.diagnostics.num_steps) == 10
    assert np.max(np.asarray(motion.diagnostics.constraint_drift)) < 1e-12


@pytest.mark.long
def test_a_motion_without_freedom_is_evaluated():
    system = four_bar(drive=mbs.forces.Polynomial([0.7, 2.0, 0.0]))
    ts = jnp.linspace(0.0, 4.0, 41)
    _, B, D = four_bar_angles(0.7)
    state = mbs.State.at(system, guess={"A": 0.7, "B": B, "D": D})
    motion = mbs.simulate(system, state, ts=ts)
    expected = np.unwrap([four_bar_angles(0.7 + 2.0 * t) for t in np.asarray(ts)], axis=0)
    np.testing.assert_allclose(motion.states.coordinates[:, 0], expected[:, 0], atol=1e-10)
    found = np.exp(1j * np.asarray(motion.states.coordinates))
    np.testing.assert_allclose(found, np.exp(1j * expected), atol=1e-9)
    account = motion.diagnostics
    assert np.max(np.abs(account.energy_residual)) < 1e-8 * np.ptp(account.work["drives"])


@pytest.mark.long
def test_inside_jit_nothing_is_raised(ball):
    system, state = ball
    result = jax.jit(lambda s: mbs.simulate(system, s, t1=1.0, max_steps=2).result)(state)
    assert int(result) == 2


@pytest.mark.long
def test_later_start(ball):
    system, _ = ball
    state = mbs.State.at(system, fall=1.0, t=3.0)
    motion = mbs.simulate(system, state, t1=5.0)
    np.testing.assert_allclose([motion.ts[0], motion.ts[-1]], [3.0, 5.0])
    np.testing.assert_allclose(motion.states.coordinates[-1, 0], 1.0 - 4.905 * 4.0, atol=1e-9)
