"""Warnings name the line of the user's that asked, however deep in the library they are noticed."""

import inspect

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs


def pendulum(friction=None):
    b = mbs.SystemBuilder()
    b.body("bob", 1.0, com=(0.0, 0.0, -1.0), inertia=0.1)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    if friction:
        b.friction("rub", "pin", **friction)
    return b.build()


def in_degrees():
    mbs.State.at(pendulum(), pin=90.0)


def in_degrees_inside_of_a_search():
    system = pendulum()
    mbs.minimise(lambda d: jnp.sum(mbs.State.at(system, pin=90.0).coordinates * d) ** 2, 1.0, steps=1, progress=False)


def unstable():
    system = pendulum()
    mbs.equilibrium(system, mbs.State.at(system, pin=np.pi))


def old_friction():
    pendulum({"mu": 0.1, "radius": 0.01})


def old_gear():
    mbs.forces.WormGear(1, 30, 2e-3, 0.02, friction=0.1, slip_speed=1e-3)


def old_room():
    mbs.kinematics.State  # noqa: B018


ASKED = {
    f.__name__: f for f in (in_degrees, in_degrees_inside_of_a_search, unstable, old_friction, old_gear, old_room)
}


@pytest.mark.parametrize("ask", ASKED.values(), ids=ASKED)
def test_the_line_of_the_user_is_named(ask):
    with pytest.warns(Warning) as found:
        ask()
    lines, first = inspect.getsourcelines(ask)
    if ask is old_friction:
        lines, first = inspect.getsourcelines(pendulum)
    assert all(w.filename == __file__ and first <= w.lineno < first + len(lines) for w in found), [
        str(w) for w in found
    ]
