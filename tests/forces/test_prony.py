"""Springs with memory against their complex stiffness and creep."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import forces as F

SPRINGS, TIMES = np.array([40.0, 25.0, 60.0, 10.0]), np.array([1e-3, 0.02, 0.5, 8.0])


def held(law, mass=2.0, **place):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=mass, inertia=0.3)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("rubber", law, **(place or {"joint": "x"}))
    return b.build()


@pytest.mark.parametrize(
    "frequency",
    [
        pytest.param(1e-2, marks=pytest.mark.long),
        pytest.param(1.0, marks=pytest.mark.long),
        pytest.param(1e2, marks=pytest.mark.long),
        1e4,
    ],
)
def test_complex_stiffness(frequency):
    """Receptance of the linearisation over six decades: `1 / (K(i w) - m w^2)`."""
    system = held(F.Prony(30.0, SPRINGS, TIMES))
    found = mbs.linearise(system, mbs.State.at(system, x=0.0))
    A, s = np.asarray(found.state_space.A), 1j * frequency
    answer = np.linalg.solve(s * np.eye(len(A)) - A, np.eye(len(A))[:, 1] / 2.0)[0]
    K = 30.0 + np.sum(SPRINGS * s * TIMES / (1.0 + s * TIMES))
    np.testing.assert_allclose(answer * (K + 2.0 * s**2), 1.0, rtol=1e-9)


@pytest.mark.long
def test_bushing_is_the_series_in_every_axis():
    """Small turns about x: a `PronyBushing` moves as a `Prony` on the joint."""
    stiffness, branches = np.full(6, 1.0), np.zeros((4, 6))
    stiffness[3], branches[:, 3] = 30.0, SPRINGS

    def turning(law, **place):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("rotor", mass=1.0, inertia=0.3)
        b.joint("turn", mbs.Revolute("x"), "ground", "rotor")
        b.force("rubber", law, **place)
        system = b.build()
        motion = mbs.simulate(system, mbs.State.at(system, turn=0.4), t1=1.0)
        return motion.states.coordinates[:, 0], motion.diagnostics.energy_residual

    by_joint, _ = turning(F.Prony(30.0, SPRINGS, TIMES), joint="turn")
    by_pose, residual = turning(F.PronyBushing(stiffness, branches, TIMES), between=("ground", "rotor"))
    np.testing.assert_allclose(by_pose, by_joint, atol=1e-8)
    assert np.abs(residual).max() < 1e-8


@pytest.mark.long
def test_bushing_keeps_its_energy_account_in_large_turns():
    law = F.PronyBushing([90.0, 80.0, 70.0, 6.0, 5.0, 4.0], 20.0 * np.ones((2, 6)), [0.05, 0.7])
    b = mbs.SystemBuilder()
    b.body("block", mass=2.0, inertia=(0.1, 0.2, 0.25))
    b.joint("free", mbs.Free(), "ground", "block")
    b.force("mount", law, between=("ground", "block"))
    system = b.build()
    start = mbs.State.at(system, velocities={"free": (0.3, -0.2, 0.1, 3.0, 2.0, -4.0)})
    motion = mbs.simulate(system, start, t1=1.0)
    pose = jnp.eye(3), *[jnp.zeros(3)] * 3
    heat = jax.vmap(lambda z: law.dissipated(*pose, {"stretch": z}, 0.0))(motion.internal("mount.stretch"))
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-8
    assert motion.diagnostics.work["mount"][-1] < 0.0 and np.all(np.asarray(heat) >= 0.0)


@pytest.mark.long
def test_slope_by_every_number():
    def end(numbers):
        system = held(F.Prony(*numbers))
        return mbs.simulate(system, mbs.State.at(system, x=0.3), t1=0.5, ts=[0.0, 0.5]).states.coordinates[-1, 0]

    numbers = jnp.asarray(30.0), jnp.asarray(SPRINGS[1:3]), jnp.asarray(TIMES[1:3])
    slopes, h = jax.grad(end)(numbers), 1e-4
    for k in range(3):
        step = [jnp.zeros_like(x) for x in numbers]
        step[k] = h * numbers[k]
        up, down = (end(jax.tree.map(lambda x, d, s=sign: x + s * d, numbers, tuple(step))) for sign in (1, -1))
        np.testing.assert_allclose(np.sum(slopes[k] * step[k] / h), (up - down) / (2 * h), rtol=1e-6)


def test_faults():
    assert "as many" in " ".join(F.Prony(1.0, [1.0, 2.0], [1.0]).faults())
    assert "times must be positive" in F.Prony(1.0, [1.0], [0.0]).faults()
    assert F.PronyBushing(np.ones(6), np.ones((2, 5)), [1.0, 2.0]).faults()
