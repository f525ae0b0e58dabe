"""Small motions and rest of mechanisms whose joints rub: differences, closed forms, and refused at stick."""

import jax
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.friction import BearingFriction, SmoothCoulomb

from ..dynamics.slider_cranks import slider_crank

_MODELS = {"coulomb": {}, "bearing": {"viscous": 0.3, "seal": 0.5}}


def _model(mu, transition=0.01, **own):
    kind = BearingFriction if own else SmoothCoulomb
    return kind(mu, transition_speed=transition, **own)


def crank(mu=0.1, load=-40.0, effort=0.0, own={}):  # noqa: B006
    """A slider-crank with friction in its pins and its guide."""
    b = slider_crank(load)
    b.force("push", mbs.Torque((0, 0, effort)), on="crank")
    for name in ("A", "B", "C"):
        b.friction(f"rub {name}", name, _model(mu, **own), radius=0.02)
    b.friction("rub guide", "guide", _model(mu))
    return b.build(independent=["A"])


def at(system, angle=0.7, speed=3.0):
    return mbs.State.at(system, A=angle, guess={"B": -0.9, "guide": 0.35}, velocities={"A": speed})


def acceleration(system, angle=0.7, speed=3.0):
    return float(mbs.dynamics.forward_dynamics(system, at(system, angle, speed))[0][0])


@pytest.mark.long
@pytest.mark.parametrize("model", _MODELS)
def test_slopes_are_those_of_differences(model):
    system, h = crank(own=_MODELS[model]), 1e-5
    found = mbs.linearise(system, at(system), inputs=["A"], outputs=["guide"], loads=["A"])
    by_angle = (acceleration(system, 0.7 + h) - acceleration(system, 0.7 - h)) / (2 * h)
    by_speed = (acceleration(system, speed=3.0 + h) - acceleration(system, speed=3.0 - h)) / (2 * h)
    pushed = [acceleration(crank(own=_MODELS[model], effort=e)) for e in (1e-3, -1e-3)]
    assert found.state_space.A[1] == pytest.approx([by_angle, by_speed], rel=1e-7)
    assert found.state_space.B[1, 0] == pytest.approx((pushed[0] - pushed[1]) / 2e-3, rel=1e-7)

    def force(angle, speed):
        return mbs.reactions(system, at(system, angle, speed), frame="joint")["A"].force

    slopes = [
        (force(0.7 + h, 3.0) - force(0.7 - h, 3.0)) / (2 * h),
        (force(0.7, 3.0 + h) - force(0.7, 3.0 - h)) / (2 * h),
    ]
    assert found.state_space.C[1:4] == pytest.approx(np.stack(slopes, axis=1), rel=1e-6, abs=1e-5)
    poles = mbs.modes(found).roots
    assert np.sort_complex(poles) == pytest.approx(np.sort_complex(np.linalg.eigvals(found.state_space.A)), rel=1e-9)


def pendulum(mu=0.3, model=None, transition=0.01):
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("bob", mass=1.3, com=(0.4, 0, 0), inertia=(1e-3, 0.02, 0.02))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    b.friction("rub", "pin", _model(mu, transition) if model is None else model, radius=0.03)
    return b.build()


def rate(q, w, tau=0.0):
    """Closed equation of the pendulum that slides far above the transition speed, by a fixed point."""
    m, l, I, g, a = 1.3, 0.4, 0.02, 9.81, 0.0  # noqa: E741
    for _ in range(60):
        load = m * np.hypot(-l * (a * np.sin(q) + w * w * np.cos(q)), l * (a * np.cos(q) - w * w * np.sin(q)) + g)
        a = (tau - m * g * l * np.cos(q) - 0.3 * 0.03 * load) / (I + m * l * l)
    return a


@pytest.mark.long
def test_pendulum_that_slides():
    system, q, w, h = pendulum(), 0.4, 5.0, 1e-5
    found = mbs.linearise(system, mbs.State.at(system, pin=q, velocities={"pin": w}), inputs=["pin"])
    by = [(rate(q + h, w) - rate(q - h, w)), (rate(q, w + h) - rate(q, w - h)), (rate(q, w, h) - rate(q, w, -h))]
    assert [*found.state_space.A[1], found.state_space.B[1, 0]] == pytest.approx(np.array(by) / (2 * h), rel=1e-7)
    assert float(found.gyroscopic[0, 0]) == pytest.approx(0.0, abs=1e-12)  # all of its damping is friction


def test_joint_at_stick_is_refused_by_name():
    system = pendulum()
    with pytest.raises(mbs.ModelError, match="joint 'pin' sticks.*LuGre"):
        mbs.linearise(system, mbs.State.at(system, pin=0.4))


@pytest.mark.long
def test_equilibrium_is_that_without_friction():
    system = pendulum()
    found = mbs.equilibrium(system, mbs.State.at(system, pin=-1.2))
    assert float(found.state.coordinates[0]) == pytest.approx(-np.pi / 2, abs=1e-9)
    assert float(found.stiffness[0, 0]) == pytest.approx(1.3 * 9.81 * 0.4, rel=1e-9)
    with pytest.raises(mbs.ModelError, match="steady motion: no answer with friction in joints"):
        mbs.equilibrium(system, mbs.State.at(system, pin=-1.2, velocities={"pin": 1.0}), moving=["pin"])
    with pytest.raises(mbs.ModelError, match="bristles hold"):
        held = pendulum(model=mbs.friction.LuGre(0.3, 1e5, 300.0, stribeck_speed=0.01))
        mbs.equilibrium(held, mbs.State.at(held, pin=-1.2))


@pytest.mark.long
def test_linearisation_in_a_trace_and_side_by_side():
    system, h = pendulum(), 1e-5

    def slope(speed):
        return mbs.linearise(system, mbs.State.at(system, pin=0.4, velocities={"pin": speed})).state_space.A[1, 1]

    speeds = np.array([5.0, 0.1, -4.0, 5.0 + 1e-4, 5.0 - 1e-4])
    found, by_speed = jax.jit(jax.vmap(jax.value_and_grad(slope)))(speeds)
    assert np.isfinite(found).tolist() == [True, False, True, True, True]
    assert found[0] == pytest.approx((rate(0.4, 5.0 + h) - rate(0.4, 5.0 - h)) / (2 * h), rel=1e-7)
    assert by_speed[0] == pytest.approx(float(found[3] - found[4]) / 2e-4, rel=1e-5)


@pytest.mark.long
def test_bristles_have_a_stiffness():
    """Where bristles hold, the pole is that of the mass on their stiffness."""
    system = pendulum(model=mbs.friction.LuGre(0.3, 1e5, stribeck_speed=0.01))
    found = mbs.linearise(system, mbs.State.at(system, pin=-np.pi / 2))
    load, inertia = 1.3 * 9.81, 0.02 + 1.3 * 0.4**2
    stiffness = 1.3 * 9.81 * 0.4 + 1e5 * load * 0.03**2
    roots = mbs.modes(found).roots
    assert np.max(np.abs(roots.imag)) == pytest.approx(np.sqrt(stiffness / inertia), rel=1e-8)


def test_driven_input_is_refused_by_name():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("slider", mass=1.0)
    b.joint("guide", mbs.Prismatic("x"), "ground", "slider", drive=mbs.Ramp(0.0, 1.0))
    b.friction("rub", "guide", 0.1)
    system = b.build()
    with pytest.raises(mbs.ModelError, match="input 'guide' is a driven joint"):
        mbs.linearise(system, mbs.State.at(system), inputs=["guide"])
