"""Every public question of models at the edge: an answer, or an error in words; never a raw error from below."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests import models


def welded():
    """A structure of welds, a cantilever of two pieces."""
    b = mbs.SystemBuilder()
    b.body("a", mass=2.0, com=(0.3, 0, 0), inertia=0.1)
    b.body("c", mass=1.0, com=(0.1, 0, 0), inertia=0.1)
    b.joint("wall", mbs.Weld(), "ground", "a")
    b.joint("seam", mbs.Weld(), "a", "c", parent_frame=(0.6, 0, 0))
    return b.build()


def clamped():
    """A beam between two walls: six redundant rows."""
    b = mbs.SystemBuilder()
    b.body("a", mass=2.0, com=(0.3, 0, 0), inertia=0.1)
    b.joint("wall", mbs.Weld(), "ground", "a")
    b.joint("other", mbs.Weld(), "ground", "a", parent_frame=(0.6, 0, 0), child_frame=(0.6, 0, 0))
    return b.build()


def driven():
    """A crank that follows time."""
    b = mbs.SystemBuilder()
    b.body("a", mass=2.0, com=(0.3, 0, 0), inertia=0.1)
    b.joint("pin", mbs.Revolute("y"), "ground", "a", drive=mbs.Ramp(0.2, 3.0))
    return b.build()


def pendulum():
    return models.pendulum((0.0, 0.0, -0.3), body="a", mass=2.0, inertia=0.1)


def free():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("a", mass=2.0, inertia=(0.1, 0.2, 0.3))
    b.joint("free", mbs.Free(), "ground", "a")
    return b.build()


def massless():
    """A massless rod on a wall by a pin, moved by a drive."""
    b = mbs.SystemBuilder()
    b.body("a", mass=0.0)
    b.joint("pin", mbs.Revolute("y"), "ground", "a", drive=mbs.Ramp(0.2, 3.0))
    return b.build()


MODELS = {f.__name__: f for f in (welded, clamped, driven, pendulum, free, massless)}
JOINT = {"welded": "wall", "driven": "pin", "pendulum": "pin", "free": "free", "massless": "pin"}


@pytest.mark.slow
def test_a_clamped_beam_stays_where_it_is():
    system, state = model("clamped")
    motion = mbs.simulate(system, state, t1=1.0)
    assert motion.status == mbs.Status.SUCCESS and motion.end.velocities.shape == (0,)


@functools.cache
def model(name):
    system = MODELS[name]()
    return system, mbs.State.at(system, t=0.1)


def scaled(system, state, k):
    return mbs.dynamics.potential_energy(system, state) * k


QUESTIONS = {
    "acceleration": lambda s, x: mbs.dynamics.acceleration(s, x, "a", jnp.zeros(x.velocities.shape)),
    "angular_acceleration": lambda s, x: mbs.dynamics.angular_acceleration(s, x, "a", jnp.zeros(x.velocities.shape)),
    "angular_velocity": lambda s, x: mbs.kinematics.angular_velocity(s, x, "a"),
    "batch": lambda s, x: mbs.batch(functools.partial(scaled, s, x), jnp.arange(1.0, 3.0), progress=False).values,
    "bond_graph": lambda s, x: mbs.bondgraph.bond_graph(s),
    "bond_powers": lambda s, x: mbs.bondgraph.bond_powers(s, x),
    "check": lambda s, x: mbs.check(s),
    "constraint_jacobian": mbs.constraints.constraint_jacobian,
    "constraint_residual": mbs.constraints.constraint_residual,
    "equilibrium": mbs.equilibrium,
    "forward_dynamics": mbs.forward_dynamics,
    "frequency_response": lambda s, x: mbs.frequency_response(mbs.linearise(s, x), jnp.array([1.0])),
    "inverse_dynamics": lambda s, x: mbs.inverse_dynamics(s, x, jnp.zeros(x.velocities.shape)),
    "jacobian": lambda s, x: mbs.kinematics.jacobian(s, x, "a"),
    "kic": mbs.constraints.kic,
    "kic_rate": lambda s, x: mbs.constraints.kic_rate(
        mbs.constraints.kic_second(s, x).translational["a"], mbs.constraints.kic(s, x).translational["a"][0]
    ),
    "kic_second": mbs.constraints.kic_second,
    "kinetic_energy": mbs.dynamics.kinetic_energy,
    "linearise": mbs.linearise,
    "mass_matrix": mbs.mass_matrix,
    "minimise": lambda s, x: mbs.minimise(
        lambda d: (d["k"] - 1.0) ** 2 + 0.0 * mbs.dynamics.potential_energy(s, x),
        {"k": 0.3},
        {"k": (0.0, 2.0)},
        progress=False,
    ),
    "modes": mbs.modes,
    "peak": lambda s, x: mbs.motion.peak(
        s, mbs.simulate(s, x, t1=0.3, ts=[0.15, 0.2, 0.3]), lambda y: mbs.dynamics.potential_energy(s, y)
    ),
    "point_kic": lambda s, x: mbs.constraints.point_kic(s, x, "a"),
    "position": lambda s, x: mbs.position(s, x, "a"),
    "potential_energy": mbs.dynamics.potential_energy,
    "reaction_bonds": lambda s, x: mbs.reaction.reaction_bonds(s, x),
    "reactions": mbs.reactions,
    "reactions of a motion": lambda s, x: mbs.reactions(s, mbs.simulate(s, x, ts=[0.15, 0.2, 0.3])),
    "rotation": lambda s, x: mbs.rotation(s, x, "a"),
    "simulate": lambda s, x: mbs.simulate(s, x, ts=[0.15, 0.2, 0.3]),
    "stiffness": mbs.stiffness,
    "velocity": lambda s, x: mbs.velocity(s, x, "a"),
}


#: Questions that are about one state, and say so when they get several.
OF_ONE = ("equilibrium", "linearise", "modes", "frequency_response", "simulate", "peak", "reactions of a motion")
#: Those that neither need a state nor have an answer by state.
OF_NONE = ("batch", "bond_graph", "check", "kic_rate", "minimise")
#: Errors in words that are right: what is asked has no answer.
NO_ANSWER = {
    ("welded", "bond_graph"),
    ("welded", "bond_powers"),
    ("clamped", "bond_graph"),
    ("clamped", "bond_powers"),
}


LONG = ("welded", "massless", "free", "clamped", "pendulum", "driven")


def _marked(name):
    return pytest.param(name, marks=[pytest.mark.long] * (name in LONG))


@pytest.mark.parametrize("name", [_marked(name) for name in MODELS])
def test_every_question_has_an_answer(name):
    """All are asked, so that one report has every fault."""
    faults, refused, (system, state) = [], 0, model(name)
    for question, ask in QUESTIONS.items():
        try:
            numbers = [np.asarray(x) for x in jax.tree.leaves(ask(system, state)) if isinstance(x, jax.Array)]
            finite = all(np.isfinite(x).all() for x in numbers if x.dtype.kind in "fc")
            if (name, question) in NO_ANSWER or not finite:
                faults.append((question, "answers what is none, or not finite"))
        except Exception as error:  # noqa: BLE001 - that is what is looked for
            refused += isinstance(error, mbs.ModelError) and (name, question) in NO_ANSWER
            if not (isinstance(error, mbs.ModelError) and (name, question) in NO_ANSWER):
                faults.append((question, f"{type(error).__name__}: {str(error)[:200]}"))
    right = len(QUESTIONS) - refused - len(faults)
    print(f"\n{name}: {len(QUESTIONS)} questions, {right} answered, {refused} refused in words, {len(faults)} faults")
    assert not faults, faults


@pytest.mark.parametrize("name", [_marked(name) for name in ("welded", "driven", "pendulum")])
def test_every_question_takes_a_motion(name):
    """The answers for a motion are those for its states, one by one, in front the axis of times; or it says in words
    that it takes one state."""
    faults, (system, state) = [], model(name)
    motion = mbs.simulate(system, state, ts=[0.15, 0.2, 0.3])
    for question, ask in QUESTIONS.items():
        if question in OF_NONE or (name, question) in NO_ANSWER:
            continue
        if question in OF_ONE:
            with pytest.raises(ValueError, match="takes one state"):
                ask(system, motion.states)
            continue
        try:
            along, last = ask(system, motion.states), ask(system, motion[-1])
            for a, b in zip(jax.tree.leaves(along), jax.tree.leaves(last), strict=True):
                np.testing.assert_allclose(np.asarray(a)[-1], b, rtol=1e-9, atol=1e-9)
        except Exception as error:  # noqa: BLE001
            faults.append((question, f"{type(error).__name__}: {str(error)[:200]}"))
    assert not faults, faults
