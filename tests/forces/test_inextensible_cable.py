"""Inextensible cables: Atwood's machine, block and tackle, winch, and rotating sheaves against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Eyelet, Sheave, Winch

G, R = 9.81, 0.2


def atwood(light=3.0, heavy=5.0, radius=R, length=4.0, like=None, solver="auto", rub=False):
    """Two loads on a cable over a sheave, which turns on a pin of its own."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("wheel", 1.0, inertia=0.01)
    b.joint("pin", mbs.Revolute("y"), "ground", "wheel")
    for name, mass, x in (("light", light, -radius), ("heavy", heavy, radius)):
        b.body(name, mass)
        b.joint(name, mbs.Prismatic("z"), "ground", name, parent_frame=(x, 0, 0))
    path = [Attachment("light"), Sheave("wheel", radius, side="+", axis="y"), Attachment("heavy")]
    b.cable("rope", path, free_length=length, inextensible=True)
    if rub:
        b.friction("bearing", "pin", 0.2, radius=0.03)
    return b.build(like=like, linear_solver=solver)


def hanging(system, light=-1.0, **more):
    return mbs.State.at(system, light=light, pin=0.0, guess={"heavy": -2.0}, **more)


TENSION = 2 * 3.0 * 5.0 / 8.0 * G


def test_loads_of_a_unit_tension():
    """Against differences of the length that is left."""
    kinds = ("point", "sheave", "point")
    law = mbs.forces.InextensibleCable(kinds, [0.2], [[0.0, 1.0, 0.0]], [0.0], free_length=4.0)
    x, R = jnp.array([[-0.5, 0.1, -1.0], [0.0, 0.0, 0.0], [0.4, 0.2, -1.5]]), jnp.stack([jnp.eye(3)] * 3)
    force, moment = jax.jit(lambda R, x: law.unit_loads(R, x))(R, x)
    left = jax.jit(jax.vmap(lambda x: law.value(R, x, jnp.zeros(0), 0.0)[0]))
    steps = 1e-5 * np.eye(9).reshape(9, 3, 3)
    np.testing.assert_allclose(force.reshape(-1), (left(x[None] + steps) - left(x[None] - steps)) / 2e-5, atol=1e-8)
    # it pulls at its ends, and the loads balance
    assert force[0, 2] > 0.9 and force[2, 2] > 0.9
    np.testing.assert_allclose(np.sum(force, axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.sum(moment + np.cross(x, force), axis=0), 0.0, atol=1e-12)


@pytest.mark.long
def test_atwoods_machine():
    system = atwood()
    state = hanging(system, velocities={"light": 0.5})
    np.testing.assert_allclose(system.coordinates(state)["heavy"], -(4.0 - np.pi * R - 1.0), rtol=1e-12)
    np.testing.assert_allclose(system.velocities(state)["heavy"], -0.5, rtol=1e-12)
    loads = mbs.reactions(system, state)
    assert loads.ok
    np.testing.assert_allclose(loads.row("rope").multipliers, [TENSION], rtol=1e-10)
    np.testing.assert_allclose(loads["pin"].force, [0, 0, G + 2 * TENSION], atol=1e-9)  # the bearing carries both
    assert np.all(loads["pin"].unique_force) and loads["pin"].lacks_contact is not True
    rope = mbs.dynamics.cable_states(system, state)["rope"]
    np.testing.assert_allclose(rope.tensions, [TENSION, TENSION], rtol=1e-10)
    np.testing.assert_allclose(rope.rate, 0.0, atol=1e-12)
    np.testing.assert_allclose(rope.force[:, 2], [TENSION, -2 * TENSION, TENSION], rtol=1e-9)


def test_refusals():
    b = mbs.SystemBuilder()
    b.body("load", 1.0)
    b.joint("load", mbs.Prismatic("z"), "ground", "load")
    ends = [Attachment(("ground", (0, 0, 2.0))), Attachment("load")]
    b.cable("one", ends, stiffness=1e5, slack=True, inextensible=True)
    b.cable("two", [ends[0], Eyelet("load", friction=0.1), ends[0]], inextensible=True)
    b.cable("three", [Winch("ground", "load", 0.1), ends[1]], inextensible=True)
    b.cable("four", ends, free_length=-1.0, inextensible=True)
    b.cable("five", [ends[0], ends[0]], inextensible=True)
    faults = "\n".join(b.faults())
    for words in (
        "cable 'one': an inextensible cable takes no stiffness, slack",
        "cable 'two': element 1: an inextensible cable has one tension, so it takes no friction",
        "cable 'three': element 0: an inextensible cable takes no Winch",
        "constraint 'four': free_length must be positive",
        "constraint 'five': all its frames are on 'ground'",
    ):
        assert words in faults, words


@pytest.mark.long
@pytest.mark.parametrize("solver", ["frontal", "multifrontal"])
def test_sparse_solvers(solver):
    state = hanging(system := atwood(solver=solver))
    loads = mbs.reactions(system, state)
    np.testing.assert_allclose(loads.row("rope").multipliers, [TENSION], rtol=1e-9)
    np.testing.assert_allclose(loads["pin"].force, [0, 0, G + 2 * TENSION], atol=1e-6)


@pytest.mark.long
def test_motion_and_its_gradient():
    like = atwood()

    def height(heavy, radius, length):
        system = atwood(heavy=heavy, radius=radius, length=length, like=like)
        motion = mbs.simulate(system, hanging(system, light=-2.0), ts=np.linspace(0.0, 0.5, 3), rtol=1e-9, atol=1e-11)
        return jnp.sum(motion.end.coordinates[1:] * jnp.array([1.0, 2.0])), motion

    at = (jnp.asarray(5.0), jnp.asarray(R), jnp.asarray(4.0))
    slopes, motion = jax.grad(height, argnums=(0, 1, 2), has_aux=True)(*at)
    assert motion.ok and np.abs(motion.diagnostics.energy_residual).max() < 1e-9
    rise = G * (5.0 - 3.0) / 8.0 * 0.5**2 / 2
    np.testing.assert_allclose(motion.end.coordinates[1], -2.0 + rise, rtol=1e-9)
    # rise - 2 (length - pi r - 2 + rise): by the heavier mass, the radius, the length
    np.testing.assert_allclose(slopes, [-G * 6.0 / 64.0 * 0.125, 2 * np.pi, -2.0], rtol=1e-6)


@pytest.mark.long
def test_block_and_tackle():
    """Four falls: the load takes four tensions, the hauling end runs four times as fast."""
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("load", 40.0)
    b.joint("load", mbs.Prismatic("z"), "ground", "load", parent_frame=(0, 0, -3.0))
    b.body("hand", 12.0)
    b.joint("hand", mbs.Prismatic("z"), "ground", "hand", parent_frame=(0.6, 0, -1.0))
    top = lambda x: Sheave(("ground", (x, 0, 0)), 0.1, side="+", axis="y")
    low = lambda x: Sheave(("load", (x, 0, 0)), 0.1, side="-", axis="y")
    path = [Attachment(("ground", (-0.2, 0, 0))), low(-0.1), top(0.1), low(0.3), top(0.5), Attachment("hand")]
    b.cable("tackle", path, free_length=13.0 + 4 * np.pi * 0.1, inextensible=True)
    system = b.build()
    state = mbs.State.at(system, load=0.0, velocities={"load": 0.1}, guess={"hand": 0.0})
    np.testing.assert_allclose(system.coordinates(state)["hand"], 0.0, atol=1e-12)
    np.testing.assert_allclose(system.velocities(state)["hand"], -0.4, rtol=1e-9)
    a, multipliers = mbs.dynamics.forward_dynamics(system, state)
    rise = (4 * 12.0 - 40.0) * G / (40.0 + 16 * 12.0)
    np.testing.assert_allclose(a, [rise, -4 * rise], rtol=1e-9)
    np.testing.assert_allclose(multipliers, [40.0 * (G + rise) / 4], rtol=1e-9)


@pytest.mark.long
def test_length_in_time_does_the_work():
    b = mbs.SystemBuilder(gravity=(0, 0, -G))
    b.body("load", 10.0)
    b.joint("load", mbs.Prismatic("z"), "ground", "load")
    path = [Attachment(("ground", (0, 0, 3.0))), Attachment("load")]
    b.cable("hoist", path, free_length=lambda t: 3.0 - 0.1 * t**2, inextensible=True)
    system = b.build()
    motion = mbs.simulate(system, mbs.State.at(system, guess={"load": 0.0}), ts=np.linspace(0.0, 1.0, 5))
    assert motion.ok and np.abs(motion.diagnostics.energy_residual).max() < 1e-6
    np.testing.assert_allclose(motion.states.coordinates[:, 0], 0.1 * motion.states.t**2, atol=1e-8)
    rope = mbs.dynamics.cable_states(system, motion)["hoist"]
    np.testing.assert_allclose(rope.tension, 10.0 * (G + 0.2), rtol=1e-8)


@pytest.mark.long
def test_bearing_of_the_sheave_rubs_with_both_tensions():
    system = atwood(rub=True)
    state = mbs.State.at(system, {"light": -1.0, "pin": 0.0}, {"light": 0.0, "pin": 5.0}, guess={"heavy": -2.0})
    found = mbs.dynamics.joint_friction(system, state)
    np.testing.assert_allclose(found.loads["pin"], G + 2 * TENSION, rtol=1e-8)
    assert found.unique["pin"]
    acceleration = mbs.dynamics.forward_dynamics(system, state)[0][0]
    np.testing.assert_allclose(acceleration, -0.2 * 0.03 * (G + 2 * TENSION) / 0.01, rtol=1e-6)
