"""Models of joint friction: closed forms of a block on a level guide, and slopes beside differences."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.friction import BearingFriction, BrownMcPhee, LuGre, SmoothCoulomb

LOAD, SPEED, TRANSITION, MU, RATIO = 9.81 * 3.0, 0.02, 0.01, 0.1, 1.4


def block(model, mass=3.0, like=None):
    """A block on a level guide."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("block", mass=mass, inertia=1.0)
    b.joint("guide", mbs.Prismatic("x"), "ground", "block")
    b.friction("rub", "guide", model)
    return b.build(like=like)


def friction_of(model, speed, **state):
    system = block(model)
    return mbs.dynamics.joint_friction(system, mbs.State.at(system, velocities={"guide": speed}, **state))


@pytest.mark.slow
def test_models_of_a_block():
    w = SPEED / TRANSITION
    coulomb = MU * LOAD * np.tanh(w) * (1 + (RATIO - 1) * np.exp(-((w / 10) ** 2)))
    brown = MU * LOAD * (np.tanh(4 * w) + (RATIO - 1) * w / (w**2 / 4 + 0.75) ** 2)
    bearing = coulomb + 0.7 * np.tanh(w) + 5.0 * SPEED
    models = (
        (SmoothCoulomb, {}, coulomb),
        (BrownMcPhee, {}, brown),
        (BearingFriction, {"viscous": 5.0, "seal": 0.7}, bearing),
    )
    for kind, own, expected in models:
        model = kind(MU, RATIO * MU, TRANSITION, **own)
        found = friction_of(model, SPEED)
        assert found.efforts["guide"][0] == pytest.approx(-expected, rel=1e-12)
        assert found.powers["guide"] == pytest.approx(-expected * SPEED, rel=1e-12)


@pytest.mark.slow
def test_bristles_of_a_block():
    bend = 2e-5
    found = friction_of(LuGre(MU, 1e4, 30.0, 2.0, RATIO * MU, TRANSITION), SPEED, internal={"rub.bristle": bend})
    steady = MU * (1 + (RATIO - 1) * np.exp(-((SPEED / TRANSITION) ** 2))) / 1e4
    rate = SPEED * (1.0 - bend / steady)
    assert found.efforts["guide"][0] == pytest.approx(-LOAD * (1e4 * bend + 30.0 * rate + 2.0 * SPEED), rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "model",
    [
        lambda mu: BrownMcPhee(mu, RATIO * mu, TRANSITION),
        lambda mu: BearingFriction(mu, RATIO * mu, TRANSITION, viscous=5.0, seal=0.7),
        lambda mu: LuGre(mu, 1e3, 10.0, 2.0, RATIO * mu, TRANSITION),
    ],
)
def test_slopes_of_every_model(model):
    """Slopes of the acceleration by coefficient and speed beside differences."""
    system = block(model(MU))
    state = mbs.State.at(system, velocities={"guide": SPEED})

    def acceleration(mu, speed):
        at = mbs.State(state.t, state.coordinates, speed[None], internal=state.internal)
        return mbs.dynamics.forward_dynamics(block(model(mu), like=system), at)[0][0]

    point, h = (MU, np.asarray(SPEED)), 1e-6
    for k, slope in enumerate(jax.grad(acceleration, argnums=(0, 1))(*point)):
        up, down = ([x + s * h * (i == k) for i, x in enumerate(point)] for s in (1, -1))
        central = (acceleration(*up) - acceleration(*down)) / (2 * h)
        assert slope == pytest.approx(float(central), rel=1e-6, abs=1e-7)
