"""Identifiable inertias of a four-bar by its driving torque, against virtual powers in NumPy; and of its tree."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.identification import identify

pytestmark = pytest.mark.long
CRANK, COUPLER, ROCKER, BASE = 0.3, 0.8, 0.6, 0.9
GRAVITY = np.array([0.0, -9.81])
LINKS = ("crank", "coupler", "rocker")


def add_link(b, name, u, k):
    moments = (0.5 * u["inertia"][k], 0.5 * u["inertia"][k], u["inertia"][k])
    b.body(name, mass=u["mass"][k], com=(u["x"][k], u["y"][k], 0.0), inertia=moments, any_inertia=True)


def own_moments(u):
    """Masses, first moments and moments about the origins (12,)."""
    m, x, y = u["mass"], u["x"], u["y"]
    return np.stack([m, m * x, m * y, u["inertia"] + m * (x**2 + y**2)], axis=1).ravel()


def four_bar(u, like=None):
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    for k, name in enumerate(LINKS):
        add_link(b, name, u, k)
    b.joint("motor", mbs.Revolute("z"), "ground", "crank")
    b.joint("knee", mbs.Revolute("z"), "crank", "coupler", parent_frame=mbs.Pose((CRANK, 0, 0)))
    b.joint("pivot", mbs.Revolute("z"), "ground", "rocker", parent_frame=mbs.Pose((BASE, 0, 0)))
    ends = {"parent_frame": mbs.Pose((COUPLER, 0, 0)), "child_frame": mbs.Pose((ROCKER, 0, 0))}
    b.joint("pin", mbs.Revolute("z"), "coupler", "rocker", **ends)
    b.drive("motor", lambda t: 1.3 * t + 0.8 * jnp.sin(2.1 * t))
    return b.build(like=like, cut=["pin"], guess={"knee": 1.0, "pivot": 1.5})


def angles(crank):
    """Angles of crank, coupler and rocker to the horizontal: the circle about both ends, elbow up."""
    end = CRANK * np.array([np.cos(crank), np.sin(crank)])
    span = np.array([BASE, 0.0]) - end
    d = np.hypot(*span)
    turn = np.arccos((COUPLER**2 + d**2 - ROCKER**2) / (2 * COUPLER * d))
    coupler = np.arctan2(span[1], span[0]) + turn
    tip = end + COUPLER * np.array([np.cos(coupler), np.sin(coupler)])
    return np.array([crank, coupler, np.arctan2(tip[1], tip[0] - BASE)])


def path(t):
    """Angle of the crank, and its rates."""
    return 1.3 * t + 0.8 * np.sin(2.1 * t)


def motion(t):
    """Angles, rates and accelerations (3,) each of the links, by differences of fourth order."""
    h = 1e-3
    steps = np.unwrap([angles(path(t + k * h)) for k in range(-2, 3)], axis=0)
    rates = np.array([1, -8, 0, 8, -1]) @ steps / (12 * h)
    return steps[2], rates, np.array([-1, 16, -30, 16, -1]) @ steps / (12 * h**2)


def regressor(t):
    """Torque of the motor by mass, first moments and moment about the origin of each link (12,): virtual power."""
    theta, omega, alpha = motion(t)
    unit = lambda a: np.array([np.cos(a), np.sin(a)])
    turn = lambda r: np.array([-r[1], r[0]])
    arm = CRANK * unit(theta[0])
    origins = {
        1: (omega[0] * turn(arm), alpha[0] * turn(arm) - omega[0] ** 2 * arm),
        0: (np.zeros(2), np.zeros(2)),
        2: (np.zeros(2), np.zeros(2)),
    }
    row = []
    for k in range(3):
        v, a = origins[k]
        powers = [np.dot(a - GRAVITY, v)]
        for r in (unit(theta[k]), turn(unit(theta[k]))):
            powers.append(np.dot(a - GRAVITY, omega[k] * turn(r)) + np.dot(alpha[k] * turn(r) - omega[k] ** 2 * r, v))
        row += [*powers, alpha[k] * omega[k]]
    return np.array(row) / omega[0]


def test_base_parameters_of_loop_and_tree():
    times = np.linspace(0.0, 6.0, 60)
    truth = {
        "mass": np.array([2.0, 3.0, 2.5]),
        "x": np.array([0.12, 0.35, 0.28]),
        "y": np.array([0.02, -0.03, 0.04]),
        "inertia": np.array([0.03, 0.2, 0.12]),
    }
    first = four_bar(truth)
    values = np.linalg.svd(np.stack([regressor(t) for t in times]), compute_uv=False)
    count = int(np.sum(values > 1e-6 * values[0]))
    state, states = mbs.State.at(first, t=0.0), []
    for t in times:
        states.append(state := mbs.State.at(first, t=t, near=state))
    states = jax.tree.map(lambda *x: jnp.stack(x), *states)

    @jax.jit
    def torques(u):
        return mbs.inverse_dynamics(four_bar(u, first), states, actuators=["motor"])["motor"][:, 0]

    @jax.jit
    def tree_torques(u):
        arm = mbs.SystemBuilder(gravity=(0, -9.81, 0))
        for k, (parent, name) in enumerate(zip(("ground", *LINKS[:2]), LINKS, strict=True)):
            add_link(arm, name, u, k)
            place = (0, CRANK, COUPLER)[k]
            arm.joint(f"j{k}", mbs.Revolute("z"), parent, name, parent_frame=mbs.Pose((place, 0, 0)))
        system = arm.build()
        effort = lambda q, v, a: mbs.inverse_dynamics(system, mbs.State(jnp.zeros(()), q, v), a)
        return jax.vmap(effort)(*jnp.asarray(np.random.default_rng(0).normal(size=(3, 40, 3))))

    theirs = np.stack([regressor(t) for t in times]) @ own_moments(truth)
    np.testing.assert_allclose(torques(truth), theirs, rtol=1e-6, atol=1e-6)
    found = identify(torques, np.asarray(torques(truth)), truth, deviations=1e-3, largest=1e4)
    tree = identify(tree_torques, np.asarray(tree_torques(truth)), truth, deviations=1e-3, largest=1e4)
    assert tree.rank == 9  # of a planar arm of three links in the plane of gravity: three numbers a link
    assert found.rank == count != 9
