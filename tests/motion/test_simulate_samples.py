"""Sampled blocks of a motion against SciPy's discretisation of the plant and a recursion written by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import cont2discrete

import jaxmbs as mbs
from jaxmbs.blocks import PI

J, R, L, KT = 0.02, 1.5, 0.05, 0.3
KP, KI, TARGET, PERIOD, SAMPLES = 0.8, 6.0, 5.0, 0.02, 50


def motor(kp=KP, ki=KI, every=PERIOD, limit=None, like=None):
    """A rotor on its shaft, turned by a motor whose voltage a PI loop of the speed gives."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("rotor", mass=1.0, inertia=(J, J, J))
    b.joint("turn", mbs.Revolute(axis="z"), "ground", "rotor")
    b.force("motor", mbs.forces.Motor(0.0, R, L, KT), joint="turn")
    b.measure("speed", joint="turn", of="velocity")
    b.block("loop", PI(kp, ki, target=TARGET, limit=limit), reads="speed", drives="motor", every=every)
    return b.build(like=like)


def start(system, speed=0.5):
    return mbs.State.at(system, velocities={"turn": speed}, internal={"motor.current": 0.3, "loop.integral": 0.2})


def recursion(kp=KP, ki=KI, limit=np.inf, speed=0.5):
    """(speed, current, integral, output before the sample) at each sample and at the end."""
    A, B = np.array([[0.0, KT / J], [-KT / L, -R / L]]), np.array([[0.0], [1.0 / L]])
    Ad, Bd, *_ = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), PERIOD)
    x, integral, rows = np.array([speed, 0.3]), 0.2, []
    y = np.clip(kp * (TARGET - speed) + integral, -limit, limit)  # that the start holds
    for _ in range(SAMPLES + 1):
        rows.append([*x, integral, y])
        error = TARGET - x[0]
        v = kp * error + integral
        y = np.clip(v, -limit, limit)
        integral += PERIOD * ki * error + min(PERIOD * ki / kp, 1.0) * (y - v)
        x = Ad @ x + Bd[:, 0] * y
    return np.array(rows)


def rows_of(motion):
    states = motion.states
    return jnp.stack(
        [
            states.velocities[:, 0],
            *(motion.internal(name) for name in ("motor.current", "loop.integral", "loop.output")),
        ],
        axis=1,
    )


@pytest.mark.parametrize(
    "limit", [pytest.param(None, marks=pytest.mark.long), pytest.param(2.5, marks=pytest.mark.long)]
)
def test_a_sampled_speed_loop_of_a_motor(limit):
    system = motor(limit=limit)
    ts = PERIOD * np.arange(SAMPLES + 1)
    motion = mbs.simulate(system, start(system), ts=ts, rtol=1e-11, atol=1e-12)
    wanted = recursion(limit=np.inf if limit is None else limit)
    assert np.ptp(wanted[:, 3]) > 1.0
    np.testing.assert_allclose(rows_of(motion), wanted, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("gradient", ["reverse", "forward"])
def test_derivatives_by_gains_and_start(gradient):
    """Against differences of the recursion, not of the motion."""
    like = motor()
    weights = np.arange(1.0, 5.0)

    def value(x):
        kp, ki, speed = x
        system = motor(kp, ki, like=like)
        motion = mbs.simulate(
            system, start(system, speed), t1=PERIOD * SAMPLES, rtol=1e-11, atol=1e-12, gradient=gradient, throw=False
        )
        return jnp.sum(jnp.sin(rows_of(motion)[-1]) * weights)

    found = (jax.grad if gradient == "reverse" else jax.jacfwd)(value)(jnp.array([KP, KI, 0.5]))

    def wanted(x):
        kp, ki, speed = x
        return np.sin(recursion(kp, ki, speed=speed)[-1]) @ weights

    x, h = np.array([KP, KI, 0.5]), 1e-5
    for k, way in enumerate(np.eye(3)):
        difference = (wanted(x + h * way) - wanted(x - h * way)) / (2 * h)
        assert abs(difference) > 1e-6
        np.testing.assert_allclose(found[k], difference, rtol=1e-6, atol=1e-8)
