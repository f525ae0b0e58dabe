"""Motions with blocks, against exponentials of their linear equations and SciPy's integration of the others."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs import blocks
from tests import motor_loop

TIMES = np.linspace(0.1, 0.8, 4)


def exact(numbers, times):
    """(speed, current, integral) at times from rest."""
    A, b = motor_loop.matrices(numbers)
    M = np.zeros((4, 4))
    M[:3] = np.column_stack([A, b * float({**motor_loop.NUMBERS, **numbers}["target"])])
    return np.array([(expm(M * t) @ [0, 0, 0, 1])[:3] for t in times])


def found(motion):
    return np.stack(
        [motion.states.velocities[:, 0], motion.internal("motor.current"), motion.internal("loop.integral")]
    )


@pytest.mark.long
def test_a_motor_with_a_loop_of_its_speed_follows_its_exponential():
    system = motor_loop.build()
    motion = mbs.simulate(system, mbs.State.at(system), ts=TIMES)
    np.testing.assert_allclose(found(motion).T, exact({}, TIMES), rtol=1e-7, atol=1e-8)
    assert np.max(np.abs(motion.diagnostics.energy_residual)) < 1e-9
    signals = mbs.signals(system, motion)
    expected = motor_loop.NUMBERS["kp"] * (10.0 - motion.states.velocities[:, 0]) + motion.internal("loop.integral")
    np.testing.assert_allclose(signals["loop"], expected, rtol=1e-12)
    np.testing.assert_allclose(signals["speed"], motion.states.velocities[:, 0], rtol=1e-12)


@pytest.mark.parametrize(
    "mode", [pytest.param("reverse", marks=pytest.mark.long), pytest.param("forward", marks=pytest.mark.long)]
)
def test_gradients_by_gains_and_target_are_those_of_the_exponential(mode):
    like = motor_loop.build()

    def end(x):
        system = motor_loop.build(dict(zip(("kp", "ki", "target"), x, strict=True)), like=like)
        motion = mbs.simulate(system, mbs.State.at(system), t1=0.3, gradient=mode, ts=jnp.array([0.3]))
        return motion.end.velocities[0] + 2.0 * motion.end.internal["motor.current"]

    x, step = jnp.array([1.0, 5.0, 10.0]), 1e-5
    slope = (jax.grad if mode == "reverse" else jax.jacfwd)(end)(x)

    def of_exponential(x):
        state = exact(dict(zip(("kp", "ki", "target"), x, strict=True)), [0.3])[0]
        return state[0] + 2.0 * state[1]

    expected = [(of_exponential(x + d) - of_exponential(x - d)) / (2 * step) for d in step * np.eye(3)]
    np.testing.assert_allclose(slope, expected, rtol=1e-6)


@pytest.mark.long
def test_a_limited_loop_does_not_wind_up():
    system = motor_loop.build(limit=2.0)
    motion = mbs.simulate(system, mbs.State.at(system), ts=TIMES, rtol=1e-9, atol=1e-9)
    R, L, k, J, c, kp, ki, target = motor_loop.NUMBERS.values()

    def rate(t, x):
        w, i, z = x
        v = kp * (target - w) + z
        y = np.clip(v, -2.0, 2.0)
        return [(k * i - c * w) / J, (y - R * i - k * w) / L, ki * (target - w) + (y - v) * ki / kp]

    expected = solve_ivp(rate, (0, 0.8), [0, 0, 0], t_eval=TIMES, rtol=1e-10, atol=1e-12).y
    np.testing.assert_allclose(found(motion), expected, rtol=1e-5, atol=1e-6)
    assert np.max(mbs.signals(system, motion)["loop"]) <= 2.0 + 1e-12


def chain():
    """A mass on a spring whose force comes through a chain of blocks of every kind, one of them driven itself."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("mass", mass=2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "mass")
    b.force("spring", mbs.SpringDamper(30.0, 1.0), joint="x")
    b.force("push", mbs.Actuator(0.0), joint="x")
    b.measure("place", joint="x")
    b.measure("energy", lambda at: at.velocities["x"] ** 2 + at.t)
    b.block("wanted", blocks.FirstOrder(0.2, 3.0), reads=mbs.Harmonic(0.1, 0.2, 4.0), drives="loop.target")
    b.block("late", blocks.Delay(0.05, pade=2), reads="place")
    b.block("loop", blocks.PID(4.0, 3.0, kd=0.5, filter=0.05), reads="late")
    b.block("slow", blocks.RateLimit(5.0), reads="loop")
    b.block("sum", blocks.Function(lambda u, t: u[0] - 0.1 * u[1]), reads=("slow", "energy"))
    b.block("clip", blocks.Saturation(-3.0, 3.0), reads="sum", drives="push")
    return b


def rates_of_chain(t, y):
    """Rates of (x, v, wanted, late (2,), integral, filtered, slow), written out."""
    x, v, wanted, l0, l1, integral, filtered, slow = y
    late = x + l1 * -12.0  # of (s^2 - 6 s + 12) / (s^2 + 6 s + 12) in s T, companion form: 1 - 12 s / (...)
    e = wanted - late
    loop = 4.0 * e + integral + 0.5 * (e - filtered) / 0.05
    push = np.clip(slow - 0.1 * (v**2 + t), -3.0, 3.0)
    command = 0.1 + 0.2 * np.sin(4.0 * t)
    return [
        *(v, (push - 30.0 * x - v) / 2.0),
        *((3.0 * command - wanted) / 0.2, l1 / 0.05, (x - 12.0 * l0 - 6.0 * l1) / 0.05),
        *(3.0 * e, (e - filtered) / 0.05, np.clip((loop - slow) / 0.01, -5.0, 5.0)),
    ]


@pytest.mark.long
@pytest.mark.parametrize(
    "solver", [None, diffrax.Kvaerno5(), mbs.ode.Rodas5P()], ids=["Dopri8", "Kvaerno5", "Rodas5P"]
)
def test_a_chain_of_blocks_of_every_kind_is_that_of_scipy(solver):
    system = chain().build()
    state = mbs.State.at(system, x=0.1)
    named = state.internal.named()
    late = named["late.x"]
    first = [
        0.1,
        0.0,
        named["wanted.value"],
        *late,
        named["loop.integral"],
        named["loop.filtered"],
        named["slow.value"],
    ]
    expected = solve_ivp(rates_of_chain, (0, 0.8), first, t_eval=TIMES, rtol=1e-10, atol=1e-12).y
    motion = mbs.simulate(system, state, ts=TIMES, solver=solver, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(motion.states.coordinates[:, 0], expected[0], rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(motion.internal("loop.integral"), expected[5], rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(motion.internal("late.x").T, expected[3:5], rtol=1e-5, atol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("duration, samples", [(0.2, 4), (0.17, 4), (0.05, 1)])
def test_a_sampled_delay_holds_samples(duration, samples):
    """A step comes out so many samples later, whole, and nothing before; what is traced is refused."""
    period = 0.05

    def build(duration):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("m", 1.0)
        b.joint("x", mbs.Prismatic("x"), "ground", "m")
        b.measure("one", lambda at: jnp.where(at.t > 0.0975, 1.0, 0.0))
        b.block("late", blocks.Delay(duration), reads="one", every=period)
        return b.build()

    system = build(duration)
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.arange(10) * period + 1e-3)
    np.testing.assert_array_equal(mbs.signals(system, motion)["late"], np.arange(10) >= 2 + samples)
    with pytest.raises(mbs.ModelError, match="block 'late'.*cannot be traced"):
        jax.jit(lambda d: build(d).gravity)(duration)
    with pytest.raises(mbs.ModelError, match="more than 10000 samples"):
        build(1e4)
