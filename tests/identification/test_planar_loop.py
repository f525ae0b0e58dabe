"""Identifiable inertias of a four-bar by its driving torque alone, against virtual powers in NumPy; and of its tree."""

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


def four_bar(u, like=None):
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    for k, name in enumerate(LINKS):
        com = jnp.stack([u["x"][k], u["y"][k], 0.0 * u["x"][k]])
        inertia = jnp.stack([0.5 * u["inertia"][k], 0.5 * u["inertia"][k], u["inertia"][k]])
        b.body(name, mass=u["mass"][k], com=com, inertia=inertia, any_inertia=True)
    b.joint("motor", mbs.Revolute("z"), "ground", "crank")
    b.joint("knee", mbs.Revolute("z"), "crank", "coupler", parent_frame=mbs.Pose((CRANK, 0, 0)))
    b.joint("pivot", mbs.Revolute("z"), "ground", "rocker", parent_frame=mbs.Pose((BASE, 0, 0)))
    ends = {"parent_frame": mbs.Pose((COUPLER, 0, 0)), "child_frame": mbs.Pose((ROCKER, 0, 0))}
    b.joint("pin", mbs.Revolute("z"), "coupler", "rocker", **ends)
    return b.build(like=like, cut=["pin"])


def angles(crank):
    """Angles of crank, coupler and rocker to the horizontal: the circle about both ends, elbow up."""
    end = CRANK * np.array([np.cos(crank), np.sin(crank)])
    span = np.array([BASE, 0.0]) - end
    d = np.hypot(*span)
    turn = np.arccos((COUPLER**2 + d**2 - ROCKER**2) / (2 * COUPLER * d))
    coupler = np.arctan2(span[1], span[0]) + turn
    tip = end + COUPLER * np.array([np.cos(coupler), np.sin(coupler)])
    return np.array([crank, coupler, np.arctan2(tip[1], tip[0] - BASE)])


def motion(crank, rate, acceleration):
    """Angles, rates and accelerations (3, 3) of the links, by complex differences of time."""
    h = 1e-4
    at = lambda t: np.unwrap(angles(crank + rate * t + 0.5 * acceleration * t**2))  # noqa: E731
    ahead, now, back = at(h), at(0.0), at(-h)
    fine = lambda x: np.array([now[0] + x[0], now[1] + x[1], now[2] + x[2]])  # noqa: E731
    wrap = lambda x: (x + np.pi) % (2 * np.pi) - np.pi  # noqa: E731
    up, down = wrap(ahead - now), wrap(back - now)
    return fine(np.zeros(3)), (up - down) / (2 * h), (up + down) / h**2


def regressor(sample):
    """Torque of the motor by mass, first moments and moment about the origin of each link (12,): virtual power."""
    theta, omega, alpha = motion(*sample)
    unit = lambda a: np.array([np.cos(a), np.sin(a)])  # noqa: E731
    turn = lambda r: np.array([-r[1], r[0]])  # noqa: E731
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
    rng = np.random.default_rng(2)
    samples = np.stack([rng.uniform(0, 2 * np.pi, 60), rng.uniform(1, 6, 60), rng.uniform(-9, 9, 60)], axis=1)
    truth = {
        "mass": np.array([2.0, 3.0, 2.5]),
        "x": np.array([0.12, 0.35, 0.28]),
        "y": np.array([0.02, -0.03, 0.04]),
        "inertia": np.array([0.03, 0.2, 0.12]),
    }
    first = four_bar(truth)
    values = np.linalg.svd(np.stack([regressor(s) for s in samples]), compute_uv=False)
    count = int(np.sum(values > 1e-6 * values[0]))

    def states():
        for s in samples:
            theta = angles(s[0])
            guess = {"knee": theta[1] - theta[0], "pivot": theta[2]}
            yield mbs.State.at(first, motor=s[0], rates={"motor": s[1]}, guess=guess)

    stacked = jax.tree.map(lambda *x: jnp.stack(x), *states())

    @jax.jit
    def torques(u):
        system = four_bar(u, first)
        rate = lambda state, a: mbs.inverse_dynamics(system, state, {"motor": a}, driven=["motor"])  # noqa: E731
        return jax.vmap(rate)(stacked, jnp.asarray(samples[:, 2]))

    found = identify(torques, np.asarray(torques(truth)), truth, deviations=1e-3, largest=1e4)
    assert found.rank == count
