"""Every question to a mechanism with every model of friction, in joints and contacts: answered in numbers, or refused
by a sentence that names the joint or contact."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs import forces as F
from jaxmbs import friction as R

G = 9.81
MODELS = {
    "joint": [
        R.SmoothCoulomb(0.3, transition_speed=0.01),
        R.BrownMcPhee(0.3, transition_speed=0.01),
        R.BearingFriction(0.3, transition_speed=0.01, viscous=0.3, seal=0.5),
    ],
    "joint bristles": [R.LuGre(0.3, 1e3, 10.0, 0.1, stribeck_speed=0.01)],
    "contact": [R.SmoothCoulomb(0.3), R.BrownMcPhee(0.3)],
    "contact bristles": [R.LuGre(0.3, 300.0, 6.0, 0.1, 0.39, 0.02)],
    "law bristles": [F.FrictionForce(R.LuGre(1.0, 100.0, 1.0))],
}


def pendulum(family, model):
    """A pendulum whose pin rubs, and its coordinate."""
    b = mbs.SystemBuilder(gravity=(0, -G, 0))
    b.body("bob", mass=1.3, com=(0.4, 0, 0), inertia=(1e-3, 0.02, 0.02))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    b.force("spring", mbs.SpringDamper(30.0), joint="pin")
    if family == "law bristles":
        b.force("rub", model, joint="pin")
    else:
        b.friction("rub", "pin", model, radius=0.03)
    return b.build(), {"pin": 0.4}, {"pin": 0.5}


def block(_, model):
    """A block that presses on a slope by a point, on a spring along it."""
    b = mbs.SystemBuilder(gravity=G * np.array([np.sin(0.2), 0.0, -np.cos(0.2)]))
    b.body("carriage", 0.1)
    b.body("block", 2.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "carriage")
    b.joint("z", mbs.Prismatic("z"), "carriage", "block")
    b.force("spring", mbs.SpringDamper(200.0), joint="x")
    b.contact("slope", C.SphereOnPlane(0.0), "block", "ground", C.HuntCrossley(1e5, 1.0, 2.0), model)
    return b.build(), {"z": -2.0 * G * np.cos(0.2) / 1e5}, {"x": 0.5}


def zeros(system):
    return jnp.zeros(system.topology.num_velocities)


def twice(state):
    return jax.tree.map(lambda x: jnp.stack([x, x]), state)


def moved(system, state, **options):
    return mbs.simulate(system, state, ts=[0.01, 0.02], **options).states


def slope_of_a_motion(system, state):
    def end(u):
        at = mbs.State(state.t, state.coordinates, u, internal=state.internal)
        return jnp.sum(moved(system, at).coordinates[-1])

    return jax.grad(end)(state.velocities)


def batch_of_motions(system, state):
    def end(share):
        at = mbs.State(state.t, state.coordinates, share * state.velocities, internal=state.internal)
        return moved(system, at).coordinates

    return mbs.batch(end, jnp.array([1.0, 0.5])).values


def actuated(system, state):
    name = system.topology.joint_names[0]
    return mbs.inverse_dynamics(system, state, zeros(system), actuators=system.topology.joint_names)[name]


def joint_force(system, state, **options):
    return mbs.reactions(system, state, **options)[system.topology.joint_names[0]].force


QUESTIONS = {
    "forward_dynamics": mbs.forward_dynamics,
    "reactions": joint_force,
    "reactions along accelerations": lambda s, q: joint_force(s, q, accelerations=zeros(s)),
    "inverse_dynamics": lambda s, q: mbs.inverse_dynamics(s, q, zeros(s)),
    "inverse_dynamics of actuators": actuated,
    "joint_friction": lambda s, q: mbs.dynamics.joint_friction(s, q).efforts,
    "equilibrium": lambda s, q: mbs.equilibrium(s, q).state,
    "steady motion": lambda s, q: mbs.equilibrium(s, q, moving=s.topology.joint_names[:1]).state,
    "linearise": lambda s, q: mbs.linearise(s, q).state_space.A,
    "stiffness": mbs.stiffness,
    "impending_motion": lambda s, q: mbs.analysis.impending_motion(s, q, s.topology.joint_names[:1]).forward,
    "element_powers": lambda s, q: mbs.bondgraph.element_powers(s, twice(q)),
    "bond_powers": lambda s, q: mbs.bondgraph.bond_powers(s, twice(q)),
    "graph_state_equations": mbs.bondgraph.graph_state_equations,
    "reaction_bonds": mbs.reaction.reaction_bonds,
    "total_effort": mbs.dynamics.total_effort,
    "resistance_field": mbs.dynamics.resistance_field,
    "potential_energy": mbs.dynamics.potential_energy,
    "campbell": lambda s, q: mbs.analysis.campbell(s, [1.0, 2.0], s.topology.joint_names[0], q),
    "simulate": moved,
    "simulate, canonical": lambda s, q: moved(s, q, formulation="canonical"),
    "simulate, independent": lambda s, q: moved(s, q, formulation="independent"),
    "simulate, implicit": lambda s, q: moved(s, q, solver=mbs.ode.Rodas5P()),
    "gradient of a motion": slope_of_a_motion,
    "batch": batch_of_motions,
}

RUBS = r"no answer with friction in joints \('pin' by 'rub'\); .{20}"
CREEPS = "joint 'pin' sticks: .* linearise at a state that slides, give it friction.LuGre"
NO_JOINT = "no joint rubs: declare friction by SystemBuilder.friction"
REFUSED = {  # by family, question and state ("" for both); all else is answered
    ("joint", "linearise", "rests"): CREEPS,
    ("joint bristles", "equilibrium", ""): RUBS,
}
for _family in ("joint", "joint bristles"):
    for _question in ("steady motion", "stiffness", "total_effort", "resistance_field", "campbell"):
        REFUSED[_family, _question, ""] = RUBS
    REFUSED[_family, "impending_motion", "rests"] = "the state is at rest"
for _family in ("contact", "contact bristles", "law bristles"):
    for _question in ("joint_friction", "impending_motion"):
        REFUSED[_family, _question, ""] = NO_JOINT
    REFUSED[_family, "campbell", ""] = "joint 'x' slides, a rotor turns"
REFUSED["law bristles", "campbell", ""] = "nothing is free to vibrate beside the spin 'pin'"

CHEAP = ("equilibrium", "steady motion", "stiffness")
QUICK = [key for key in REFUSED if key[0] == "joint bristles" and key[1] in CHEAP]
ALL = [(family, question) for family in MODELS for question in QUESTIONS]


def build(family, model):
    system, places, speeds = (block if family.startswith("contact") else pendulum)(family, model)
    return system, {
        "slides": mbs.State.at(system, places, speeds),
        "rests": mbs.State.at(system, places),
    }


def numbers(answer):
    leaves = [np.asarray(x) for x in jax.tree.leaves(answer) if hasattr(x, "dtype")]
    return [x for x in leaves if np.issubdtype(x.dtype, np.inexact)]


def test_refusals_before_anything_is_compiled():
    system, states = build("joint bristles", MODELS["joint bristles"][0])
    for family, question, where in QUICK:
        with pytest.raises(mbs.ModelError, match=REFUSED[family, question, where]):
            QUESTIONS[question](system, states["rests"])


@pytest.mark.long
@pytest.mark.parametrize(("family", "question"), ALL)
def test_every_question_is_answered_or_refused_by_name(family, question):
    for model in MODELS[family]:
        system, states = build(family, model)
        for where, state in states.items():
            refused = REFUSED.get((family, question, where), REFUSED.get((family, question, "")))
            if refused is None:
                found = numbers(QUESTIONS[question](system, state))
                assert found and all(np.all(np.isfinite(x)) for x in found), (model, where)
                continue
            with pytest.raises((mbs.ModelError, mbs.SimulationError)) as said:
                QUESTIONS[question](system, state)
            assert re.search(refused, str(said.value)), (model, where, str(said.value))


@pytest.mark.long
def test_balance_at_the_bends_of_the_state():
    """With its bristles held, the block rests where spring, weight and bristles balance."""
    system, _ = build("contact bristles", MODELS["contact bristles"][0])
    normal, bend = 2.0 * G * np.cos(0.2), 4e-4
    bent = {"slope.bristle": np.array([[bend, 0.0, 0.0]])}
    state = mbs.State.at(system, {"z": -1.9e-4}, internal=bent)
    found = mbs.equilibrium(system, state, held=["slope.bristle"])
    x = (2.1 * G * np.sin(0.2) - normal * 300.0 * bend) / 200.0
    np.testing.assert_allclose(found.state.coordinates, [x, -normal / 1e5], rtol=1e-7)


@pytest.mark.long
def test_steady_sliding_on_bristles():
    """At a speed the block bends its bristles by the dynamic coefficient; the effort holds friction and weight."""
    system, states = build("contact bristles", MODELS["contact bristles"][0])
    found = mbs.equilibrium(system, states["slides"], moving=["x"])
    np.testing.assert_allclose(found.state.internal["slope.bristle"], [[0.3 / 300.0, 0.0, 0.0]], atol=1e-12)
    wanted = 2.0 * G * np.cos(0.2) * (0.3 + 0.1 * 0.5) - 2.1 * G * np.sin(0.2)
    np.testing.assert_allclose(found.efforts, [wanted, 0.0], atol=1e-6)
    rest = mbs.equilibrium(system, states["rests"])
    np.testing.assert_allclose(rest.state.internal["slope.bristle"], 0.0, atol=1e-12)  # the spring takes all
    np.testing.assert_allclose(rest.state.coordinates[0], 2.1 * G * np.sin(0.2) / 200.0, rtol=1e-9)
