"""Measures against the kinematics of frames, and driven laws against laws of the same effort in every question."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks

TIP = ("outer", (0.8, 0.1, -0.2))


def arm(add=lambda b: None):
    b = mbs.SystemBuilder()
    b.body("inner", mass=2.0, com=(0.3, 0.0, 0.1), inertia=(0.1, 0.2, 0.2))
    b.body("outer", mass=1.0, com=(0.2, 0.1, 0.0), inertia=(0.1, 0.1, 0.1))
    b.joint("shoulder", mbs.Revolute("y"), "ground", "inner")
    b.joint("elbow", mbs.Universal(), "inner", "outer", parent_frame=(1.0, 0.0, 0.0))
    add(b)
    return b.build()


def measures(b):
    b.frame("tip", *TIP)
    b.measure("angle", joint="shoulder")
    b.measure("rates", joint="elbow", of="velocity")
    b.measure("place", on="tip")
    b.measure("climb", on=TIP, of="velocity", axis="z")
    b.measure("spin", on="outer", of="angular velocity")
    b.measure("gap", between=("inner", TIP), of="distance")
    b.measure("gap rate", between=("inner", TIP), of="distance rate")
    b.measure("seen", between=("inner", TIP))
    b.measure("drift", between=("inner", TIP), of="velocity")
    b.measure("turn", between=("inner", TIP), of="angular velocity", axis="x")
    b.measure("sum", lambda at: at.t + at.coordinates["shoulder"] * at.velocities["elbow"][0] + at.velocity("tip")[0])


@pytest.mark.long
def test_measures_are_those_of_the_kinematics():
    system = arm(measures)
    state = mbs.State.at(
        system, shoulder=0.4, elbow=(0.3, -0.5), velocities={"shoulder": 1.5, "elbow": (0.7, -2.0)}, t=2.0
    )
    found = mbs.signals(system, state)

    def tip(state):
        R, x = mbs.rotation(system, state, "inner"), mbs.position(system, state, "inner")
        return R.T @ (mbs.position(system, state, "tip") - x)

    def moved(h):
        psi = state.coordinates + h * state.velocities
        return tip(mbs.State(state.t, psi, state.velocities, structure=state.structure))

    seen, rate = jax.jvp(moved, (0.0,), (1.0,))
    spin = mbs.kinematics.angular_velocity(system, state, "outer")
    turn = mbs.rotation(system, state, "inner").T @ (spin - mbs.kinematics.angular_velocity(system, state, "inner"))
    v = mbs.velocity(system, state, "tip")
    expected = {
        **{
            "angle": 0.4,
            "rates": [0.7, -2.0],
            "place": mbs.position(system, state, "tip"),
            "climb": v[2],
            "spin": spin,
        },
        **{"gap": jnp.linalg.norm(seen), "gap rate": seen @ rate / jnp.linalg.norm(seen), "seen": seen},
        **{"drift": rate, "turn": turn[0], "sum": 2.0 + 0.4 * 0.7 + v[0]},
    }
    assert list(found) == sorted(expected) or set(found) == set(expected)
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-12, atol=1e-12, err_msg=name)


def laws(b):
    b.force("hold", mbs.PD(0.7, 30.0, 2.0), joint="shoulder")
    b.force("push", mbs.Force(lambda t: jnp.array([0.0, 0.0, 5.0])), on=TIP)
    b.force("brake", mbs.Actuator(lambda x, v, t: -0.4 * v), joint="shoulder")


def driven(b):
    b.force("hold", mbs.Actuator(0.0), joint="shoulder")
    b.force("push", mbs.Force((0.0, 0.0, 0.0)), on=TIP)
    b.force("brake", mbs.Actuator(0.0), joint="shoulder")
    b.measure("angle", joint="shoulder")
    b.measure("rate", joint="shoulder", of="velocity")
    b.block(
        "servo",
        blocks.Function(lambda u, t: jnp.stack([30.0 * (0.7 - u[0]) - 2.0 * u[1], -0.4 * u[1]])),
        reads=("angle", "rate"),
        drives=("hold", "brake.function"),
    )
    b.block("lift", blocks.Function(lambda u, t: jnp.array([0.0, 0.0, 5.0]) + 0.0 * u), reads="angle", drives="push")


QUESTIONS = {
    "accelerations": lambda system, state: mbs.forward_dynamics(system, state)[0],
    "reactions": lambda system, state: mbs.reactions(system, state)["shoulder"].force,
    "force of an element": lambda system, state: mbs.reactions(system, state).law("hold").effort,
    "efforts": lambda system, state: mbs.inverse_dynamics(system, state, state.velocities),
    "poles": lambda system, state: mbs.linearise(system, state, inputs=("shoulder",)).state_space.A,
    "powers": lambda system, state: sum(jnp.sum(p) for p in mbs.bondgraph.bond_powers(system, state).power.values()),
    "total": lambda system, state: mbs.dynamics.total_effort(system, state),
    "stiffness": lambda system, state: mbs.stiffness(system, state).sources,
}


LONG = ("poles", "powers", "stiffness", "reactions", "accelerations", "force of an element")


@pytest.mark.parametrize(
    "question",
    [pytest.param(name, marks=pytest.mark.long if name in LONG else pytest.mark.slow) for name in QUESTIONS],
)
def test_driven_laws_answer_as_laws_of_the_same_effort(question):
    found = []
    for add in (laws, driven):
        system = arm(add)
        state = mbs.State.at(
            system, shoulder=0.4, elbow=(0.3, -0.5), velocities={"shoulder": 1.5, "elbow": (0.7, -2.0)}
        )
        found.append(QUESTIONS[question](system, state))
    if question == "stiffness":  # of a servo it is no stored energy
        np.testing.assert_allclose(found[1] - found[0], np.zeros((3, 3)), atol=1e-9)
    else:
        np.testing.assert_allclose(found[1], found[0], rtol=1e-10, atol=1e-10)
