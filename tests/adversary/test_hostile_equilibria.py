"""Random equilibria of a double pendulum on springs under large loads, against its potential in NumPy."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.status import Status

G, CASES = 9.81, 60
RNG = np.random.default_rng(11)
#: Stiffness of both hinges, free angles, forces on the end, and the angles of the start.
NUMBERS = np.concatenate(
    [
        10.0 ** RNG.uniform(-2, 3, (CASES, 2)),
        RNG.uniform(-3, 3, (CASES, 2)),
        RNG.uniform(-200, 200, (CASES, 2)),
        RNG.uniform(-3, 3, (CASES, 2)),
    ],
    axis=1,
)


def pendulum(x, like=None):
    b = mbs.SystemBuilder()
    for name in ("upper", "lower"):
        b.body(name, mass=2.0, com=(0.0, 0.0, -0.5), inertia=0.1)
    b.joint("shoulder", mbs.Revolute("y"), "ground", "upper")
    b.joint("elbow", mbs.Revolute("y"), "upper", "lower", parent_frame=(0.0, 0.0, -1.0))
    b.force("first", mbs.SpringDamper(x[0], free_length=x[2]), joint="shoulder")
    b.force("second", mbs.SpringDamper(x[1], free_length=x[3]), joint="elbow")
    b.frame("end", on="lower", position=(0.0, 0.0, -1.0))
    b.force("load", mbs.Force(jnp.stack([x[4], 0.0 * x[4], x[5]])), on="end")
    return b.build(like=like)


def potential(x, q):
    """Of the springs, the weights and the force."""
    a, c = q[0], q[0] + q[1]
    middles = [(-0.5 * np.sin(a), -0.5 * np.cos(a)), (-np.sin(a) - 0.5 * np.sin(c), -np.cos(a) - 0.5 * np.cos(c))]
    end = (-np.sin(a) - np.sin(c), -np.cos(a) - np.cos(c))
    springs = 0.5 * x[0] * (q[0] - x[2]) ** 2 + 0.5 * x[1] * (q[1] - x[3]) ** 2
    return springs + 2.0 * G * sum(z for _, z in middles) - x[4] * end[0] - x[5] * end[1]


def slopes(x, q, h=1e-4):
    """Gradient (2,) and Hessian (2, 2) of the potential by differences."""
    e = h * np.eye(2)
    gradient = np.array([potential(x, q + d) - potential(x, q - d) for d in e]) / (2 * h)
    second = [[potential(x, q + d + f) - potential(x, q + d - f) for f in e] for d in e]
    before = [[potential(x, q - d + f) - potential(x, q - d - f) for f in e] for d in e]
    return gradient, (np.array(second) - np.array(before)) / (4 * h**2)


@pytest.fixture(scope="module")
def first():
    return pendulum(jnp.asarray(NUMBERS[0, :6]))


@pytest.mark.slow
def test_every_verdict_is_that_of_the_potential(first):
    """What is found is stationary, its status that of the Hessian; few are lost, some are followed to stable ones.

    What is followed and unstable was not found at first.
    """
    counts = dict.fromkeys(Status, 0)
    followed = 0
    for numbers in NUMBERS:
        system = pendulum(jnp.asarray(numbers[:6]), like=first)
        state = mbs.State.at(system, shoulder=numbers[6], elbow=numbers[7])
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            found = mbs.equilibrium(system, state, throw=False)
        counts[found.status] += 1
        assert len(told) == (found.status == Status.UNSTABLE)
        if not found.ok:
            assert np.isnan(found.stiffness).all() and not found.stable
            continue
        gradient, hessian = slopes(numbers, np.asarray(found.state.coordinates))
        size = np.max(np.abs(hessian)) + 100.0
        np.testing.assert_allclose(gradient, 0.0, atol=1e-6 * size)
        np.testing.assert_allclose(found.stiffness, hessian, atol=1e-5 * size)
        least = np.linalg.eigvalsh(hessian)[0]
        if abs(least) > 1e-4 * size:
            assert (found.status == Status.UNSTABLE) == (least < 0) and bool(found.stable) == (least > 0)
        followed += bool(found.followed) and found.status == Status.SUCCESS
        if found.followed and found.status == Status.UNSTABLE:
            assert not mbs.equilibrium(system, state, throw=False, follow=False).ok
    # half of the starts lie on paths that end at saddles or tops, which stand as found
    assert counts[Status.SUCCESS] > 0.4 * CASES and followed > 2 and counts[Status.NO_EQUILIBRIUM] <= 2


@pytest.mark.slow
def test_traces_find_the_same(first):
    """With `follow=True` within a batch as outside; without, the first ones, whose status is known there too."""

    def rest(x, follow):
        system = pendulum(x, like=first)
        start = mbs.State.at(system, shoulder=x[6], elbow=x[7])
        found = mbs.equilibrium(system, start, throw=False, follow=follow)
        return found.state.coordinates, found.result, found.followed

    some = jnp.asarray(NUMBERS[:24])
    for follow in (True, None):
        angles, codes, _ = mbs.jit(jax.vmap(lambda x, follow=follow: rest(x, follow)), compile="quick")(some)
        for k, numbers in enumerate(NUMBERS[:24]):
            system = pendulum(some[k], like=first)
            state = mbs.State.at(system, shoulder=numbers[6], elbow=numbers[7])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = mbs.equilibrium(system, state, throw=False, follow=bool(follow))
            assert found.result == codes[k]
            np.testing.assert_allclose(angles[k], found.state.coordinates, atol=1e-7)


@pytest.mark.slow
def test_a_rest_is_not_left(first):
    """Every unstable rest is its own answer, and so is a stable one."""
    x = jnp.asarray([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    system = pendulum(x, like=first)
    for shoulder in (0.0, np.pi):
        start = mbs.State.at(system, shoulder=shoulder)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rest = mbs.equilibrium(system, start, follow=False)
            again = mbs.equilibrium(system, rest.state)
        np.testing.assert_allclose(again.state.coordinates, rest.state.coordinates, atol=1e-9)
        assert again.status == rest.status and not bool(again.followed)
