"""Numbers that events have changed: every question of a state takes those of the state."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import bondgraph, constraints, dynamics, kinematics
from jaxmbs.contact import HuntCrossley, SphereOnPlane
from jaxmbs.forces import Attachment
from jaxmbs.model._changes import Changes
from tests.models import four_bar, four_bar_state

FRAME = ("tip", (0.1, 0.0, 0.2))


def machine():
    """Two bars that rub in their joint, a spring with a damper, a rope, a contact and a maxwell element."""
    b = mbs.SystemBuilder(gravity=(0.3, 0.0, -9.81))
    b.body("arm", 2.0, com=(0.4, 0.0, 0.0), inertia=(0.1, 0.2, 0.3))
    b.body("tip", 1.0, com=(0.2, 0.0, 0.1), inertia=0.05)
    b.joint("shoulder", mbs.Revolute("y"), "ground", "arm", parent_frame=(0.0, 0.0, 1.0))
    b.joint("elbow", mbs.Revolute("y"), "arm", "tip", parent_frame=(1.0, 0.0, 0.0))
    b.force("spring", mbs.SpringDamper(300.0, 2.0, free_length=0.2), joint="elbow")
    b.force("lag", mbs.forces.Maxwell(50.0, 3.0), joint="shoulder")
    b.friction("rub", "elbow", 0.2, radius=0.05)
    b.cable("rope", [Attachment(("ground", (0.5, 0.0, 3.0))), Attachment("tip")], stiffness=200.0, free_length=1.0)
    b.contact("touch", SphereOnPlane(0.3), "tip", ("ground", (0, 0, 0.4)), HuntCrossley(1e4), 0.3)
    return b.build()


def varied(system, factor):
    """All numbers of a system times a factor, but for directions, whose length is one."""

    def other(path, x):
        name = jax.tree_util.keystr(path)
        fixed = not jnp.issubdtype(jnp.asarray(x).dtype, jnp.floating) or "rotation" in name or "basis" in name
        return x if fixed else jnp.asarray(x) * factor

    return jax.tree_util.tree_map_with_path(other, system)


def every_place(system, other):
    pairs = zip(*map(jax.tree.leaves, (system, other)), strict=True)
    return tuple(k for k, (a, b) in enumerate(pairs) if np.any(np.asarray(a) != np.asarray(b)))


@pytest.fixture(scope="module")
def modes():
    """A system, another one of other numbers, two states, and both with the numbers of one of the two."""
    system = machine()
    other = varied(system, 1.02)
    places = every_place(system, other)
    states = [
        mbs.State.at(system, shoulder=a, elbow=0.4, velocities={"shoulder": 0.7, "elbow": a}) for a in (0.3, 0.8)
    ]
    pairs = list(zip((system, other), states, strict=True))
    in_force = [dataclasses.replace(state, changes=Changes.of(here, places)) for here, state in pairs]
    return system, pairs, jax.tree.map(lambda *x: jnp.stack(x), *in_force)


QUESTIONS = {
    "reactions": lambda s, x: mbs.reactions(s, x)["elbow"].force,
    "reactions of laws": lambda s, x: mbs.reactions(s, x).law("spring").effort,
    "forward_dynamics": lambda s, x: mbs.forward_dynamics(s, x)[0],
    "inverse_dynamics": lambda s, x: mbs.inverse_dynamics(s, x, jnp.ones_like(x.velocities)),
    "inverse_dynamics of actuators": lambda s, x: (
        mbs.inverse_dynamics(s, x, jnp.ones_like(x.velocities), actuators=["shoulder", "elbow"]).efforts
    ),
    "mass_matrix": mbs.mass_matrix,
    "kinetic_energy": dynamics.kinetic_energy,
    "potential_energy": dynamics.potential_energy,
    "position": lambda s, x: mbs.position(s, x, FRAME),
    "velocity": lambda s, x: mbs.velocity(s, x, FRAME),
    "acceleration": lambda s, x: dynamics.acceleration(s, x, FRAME),
    "jacobian": lambda s, x: kinematics.jacobian(s, x, FRAME),
    "kic": lambda s, x: constraints.kic(s, x).translational,
    "cable_states": lambda s, x: dynamics.cable_states(s, x)["rope"].tension,
    "contact_load": lambda s, x: dynamics.contact_load(s, x, "touch").normal_force,
    "joint_friction": lambda s, x: dynamics.joint_friction(s, x).efforts,
    "bond_powers": lambda s, x: {k: b for k, b in bondgraph.bond_powers(s, x).effort.items()},
    "element_powers": lambda s, x: bondgraph.element_powers(s, x).mechanical,
    "reaction_bonds": lambda s, x: mbs.reaction.reaction_bonds(s, x)[1],
}


def assert_close(found, wanted):
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9), found, wanted)


@pytest.mark.long
@pytest.mark.parametrize("name", QUESTIONS)
def test_questions_take_the_numbers_of_the_state(modes, name):
    system, pairs, states = modes
    ask = QUESTIONS[name]
    found = ask(system, states)
    each = [ask(here, state) for here, state in pairs]
    for k, wanted in enumerate(each):
        assert_close(jax.tree.map(lambda x, k=k: x[k], found), wanted)
    stale = jax.tree.leaves(ask(system, pairs[1][1]))
    assert any(np.abs(a - b).max() > 1e-6 for a, b in zip(stale, jax.tree.leaves(each[1]), strict=True))


OF_ONE = {
    "equilibrium": lambda s, x: mbs.equilibrium(s, x).state.coordinates,
    "linearise": lambda s, x: mbs.linearise(s, x).state_space.A,
    "stiffness": lambda s, x: mbs.stiffness(s, x).total,
    "as_block": lambda s, x: mbs.as_block(s, state=x).derivatives(0.0, mbs.as_block(s, state=x).initial_state),
}


@pytest.mark.long
@pytest.mark.parametrize("name", OF_ONE)
def test_questions_of_one_state_take_its_numbers(name):
    b = mbs.SystemBuilder()
    b.body("bob", 2.0, com=(0.0, 0.0, -0.5), inertia=0.1)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("spring", mbs.SpringDamper(30.0, 1.0, free_length=0.3), joint="pin")
    system = b.build()
    other = varied(system, 1.1)
    plain = mbs.State.at(system, pin=0.2, velocities={"pin": 0.1})
    state = dataclasses.replace(plain, changes=Changes.of(other, every_place(system, other)))
    ask = OF_ONE[name]
    np.testing.assert_allclose(ask(system, state), ask(other, plain), rtol=1e-9)
    assert np.abs(np.asarray(ask(system, state)) - ask(system, plain)).max() > 1e-4


def test_a_system_of_another_structure_is_refused(modes):
    _, _, states = modes
    loop = four_bar()
    state = dataclasses.replace(four_bar_state(loop), changes=jax.tree.map(lambda x: x[0], states.changes))
    with pytest.raises(mbs.ModelError, match="pass the one that the motion was made with"):
        dynamics.kinetic_energy(loop, state)


def test_a_motion_goes_on_with_the_mechanism_in_force():
    """With the system of the event, or by a state made anew; not with one that may be meant or not."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("m", 2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "m")
    system = b.build()
    heavy = varied(system, 2.0)
    plain = mbs.State.at(system, velocities={"x": 1.0})
    state = dataclasses.replace(plain, changes=Changes.of(heavy, every_place(system, heavy)))
    with pytest.raises(mbs.ModelError, match="pass the system of that event"):
        mbs.simulate(system, state, t1=1.0)
    with pytest.raises(mbs.ModelError, match="pass the system of that event"):
        mbs.vector_field(system).start(state)
    field = mbs.vector_field(heavy)
    np.testing.assert_allclose(field.start(state).momenta, field.start(plain).momenta)
