"""Laws with internal states on every kind of port, and the report of wrong ones."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs import forces as F
from tests.state_laws import Lag, PoseLag, Servo, Wake

MASS, HOLD = 2.0, 30.0
TIMES = np.linspace(0.1, 1.0, 10)


def block():
    """A block on a slide with a law of every kind; two of a kind have numbers of their own."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=MASS)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("hold", mbs.SpringDamper(HOLD), joint="x")
    b.force("rubber", F.Maxwell(40.0, 3.0), joint="x")
    b.force("cable", F.Maxwell(25.0, 2.0), between=(("ground", (-2.0, 0, 0)), "block"))
    b.force("jack", Lag(0.2, 4.0), joint="x")
    b.force("brake", Lag(0.4, -3.0), joint="x")
    b.force("mount", PoseLag(15.0, 6.0), between=("ground", "block"))
    b.force("air", Wake(1.5, 0.3), on="block")
    b.force("servo", Servo(8.0, [0.2], 0.5))
    return b.build()


# states: x, v, and z of rubber, z of cable, f of jack, f of brake, z of mount, w of air, i of servo
RATES = np.array(
    [
        [0, 1, 0, 0, 0, 0, 0, 0, 0],
        np.array([-HOLD, -0.5, -40.0, -25.0, 1.0, 1.0, -15.0, -1.5, 1.0]) / MASS,
        [0, 1, -40.0 / 3.0, 0, 0, 0, 0, 0, 0],
        [0, 1, 0, -25.0 / 2.0, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, -1 / 0.2, 0, 0, 0, 0],
        [0, 0, 0, 0, 0, -1 / 0.4, 0, 0, 0],
        [0, 1, 0, 0, 0, 0, -6.0, 0, 0],
        [0, 1 / 0.3, 0, 0, 0, 0, 0, -1 / 0.3, 0],
        [-8.0, 0, 0, 0, 0, 0, 0, 0, 0],
    ]
)
INPUT = np.array([0, 0, 0, 0, 4.0 / 0.2, -3.0 / 0.4, 0, 0, 8.0 * 0.2])
SPRINGS = ("rubber.stretch", "cable.stretch")
NAMES = (*SPRINGS, "jack.force", "brake.force", "mount.stretch", "air.wake", "servo.integral")


def exact(start, times):
    whole = np.zeros((10, 10))
    whole[:9, :9], whole[:9, 9] = RATES, INPUT
    return np.array([(expm(whole * t) @ [*start, 1.0])[:9] for t in times])


@pytest.fixture(scope="module")
def moving():
    system = block()
    given = {"jack.force": 1.5, "air.wake": [0.4, 0.0, 0.0], "cable.stretch": -0.02}
    state = mbs.State.at(system, x=0.3, velocities={"x": -0.7}, internal=given)
    return system, state, mbs.simulate(system, state, ts=TIMES)


@pytest.mark.long
def test_every_port_against_the_linear_equations(moving):
    system, state, motion = moving
    assert set(state.internal.named()) == set(NAMES)
    start = [0.3, -0.7, 0.0, -0.02, 1.5, 0.0, 0.0, 0.4, 0.03]  # the servo starts at a tenth of x
    truth = exact(start, TIMES)
    np.testing.assert_allclose(system.coordinates(motion.states)["x"], truth[:, 0], atol=1e-9)
    np.testing.assert_allclose(system.velocities(motion.states)["x"], truth[:, 1], atol=1e-9)
    for name, column in zip(NAMES, truth[:, 2:].T, strict=True):
        found = np.asarray(motion.internal(name)).reshape(len(TIMES), -1)
        np.testing.assert_allclose(found[:, 0], column, atol=1e-8)
        np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-12)


@pytest.mark.long
def test_accounts_close(moving):
    """Energy along the motion, and power at every instant: that of the accelerations is that of the elements."""
    system, _, motion = moving
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-9
    powers = mbs.bondgraph.bond_powers(system, motion)
    kinds = {
        "C:rubber.spring",
        "C:cable.spring",
        "R:cable.damper",
        "C:mount",
        "Se:jack",
        "Se:brake",
        "Se:air",
        "Se:servo",
    }
    assert kinds <= {element.name for element in powers.graph.elements}
    z, v = (np.asarray(x) for x in (motion.internal("rubber.stretch"), motion.states.velocities[:, 0]))
    taken = powers.net_power("C:rubber.spring") + powers.net_power("R:rubber.damper")
    np.testing.assert_allclose(taken, 40.0 * z * v, atol=1e-9)
    worst = max(np.abs(power).max() for power in mbs.bondgraph.junction_residual(powers).values())
    assert worst < 1e-10


@pytest.mark.long
def test_dissipation_of_maxwell(moving):
    """All work of an element that is no source is heat."""
    system, state, _ = moving
    motion = mbs.simulate(system, state, ts=np.linspace(0.0, 1.0, 201))
    law = F.Maxwell(40.0, 3.0)
    heat = jax.vmap(lambda z: law.dissipated(0.0, 0.0, {"stretch": z}, 0.0))(motion.internal("rubber.stretch"))
    lost = np.trapezoid(heat, motion.ts)
    np.testing.assert_allclose(motion.diagnostics.work["rubber"][-1], -lost, rtol=2e-4)


@pytest.mark.long
def test_the_description_lists_them(moving):
    assert "internal states: " in moving[0].describe() and "jack.force [N]" in moving[0].describe()


@pytest.mark.long
def test_accelerations_follow_the_internal_states(moving):
    system, state, _ = moving
    push = lambda f: mbs.forward_dynamics(system, with_force(f))[0][0]

    def with_force(f):
        return mbs.State.at(system, x=0.3, internal={"jack.force": f})

    np.testing.assert_allclose(jax.grad(push)(2.0), 1.0 / MASS)
    assert state.internal["mount.stretch"].shape == (3,)
    with pytest.raises(mbs.errors.UnknownNameError, match="did you mean 'jack.force'"):
        state.internal["jack.forc"]


# ------------------------------------------------------------------------------------------------ what is refused
class NoRate(Lag):
    """A rate by another name."""

    def rate(self, x, v, s, t):
        return {"forse": 0.0 * x}


class WrongShape(Lag):
    """Three rates of one state, a start of two."""

    def rate(self, x, v, s, t):
        return {"force": jnp.zeros(3)}

    def start(self, x, v, t):
        return {"force": jnp.zeros(2)}


class NoScale(Lag):
    """A scale of zero."""

    @property
    def internal_states(self):
        return {"force": F.InternalState((), "N", 0.0)}


class Undeclared(Lag):
    """No declaration."""

    @property
    def internal_states(self):
        return {}


class Vanishing(Lag):
    """A rate that divides by a distance that may vanish."""

    def rate(self, x, v, s, t):
        return {"force": 1.0 / x}


def on_a_slide(law, **place):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("jack", law, **(place or {"joint": "x"}))
    return b.build()


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (NoRate(1.0), "rate gives 'forse', which is no internal state.*rate lacks the internal state 'force'"),
        (WrongShape(1.0), r"rate: 'force' has shape \(3,\), not \(\).*start: 'force' has shape \(2,\)"),
        (NoScale(1.0), "scale must be positive and finite"),
        (Undeclared(1.0), "internal_states must be a dict"),
        (Wake(1.0, 1.0), "Wake takes on="),
        (F.Maxwell(-1.0, 0.0), "stiffness must be positive.*damping must be positive"),
    ],
)
def test_wrong_laws_are_refused_at_build(law, message):
    with pytest.raises(mbs.errors.ModelError, match="(?s)force 'jack'.*" + message):
        on_a_slide(law)


def test_one_report_of_wrong_values():
    system = on_a_slide(Lag(1.0))
    wrong = {"jack.forse": 1.0, "jack.force": [1.0, 2.0]}
    faults = r"(?s)no joint 'y'.*no internal state 'jack.forse'.*shape \(2,\)"
    with pytest.raises(mbs.errors.ModelError, match=faults):
        mbs.State.at(system, y=1.0, internal=wrong)
    with pytest.raises(mbs.errors.ModelError, match="takes finite real numbers, got nan"):
        mbs.State.at(system, internal={"jack.force": np.nan})
    with pytest.raises(mbs.errors.ModelError, match="internal= takes values by name"):
        mbs.State.at(system, internal=3.0)


def test_rates_that_are_not_finite_at_the_start():
    system = on_a_slide(Vanishing(1.0))
    with pytest.raises(mbs.errors.ModelError, match="jack.force have rates that are not finite"):
        mbs.State.at(system, x=0.0)
    assert mbs.State.at(system, x=0.5).ok


@pytest.mark.long
def test_states_of_other_systems():
    system, plain = on_a_slide(Lag(1.0)), on_a_slide(mbs.SpringDamper(1.0))
    with pytest.raises(mbs.errors.ModelError, match="has the internal states none; this system has jack.force"):
        mbs.forward_dynamics(system, mbs.State(0.0, [0.0], [0.0]))
    with pytest.raises(mbs.errors.ModelError, match="has the internal states jack.force; this system has none"):
        mbs.simulate(plain, mbs.State.at(system), t1=1.0)
    with pytest.raises(mbs.errors.ModelError, match="no force element of the motion has internal states"):
        mbs.simulate(plain, mbs.State.at(plain), t1=0.1).internal("jack.force")
