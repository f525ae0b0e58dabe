"""Implicit methods of linear systems: stages solved with one inverse, against closed forms and iterated stages."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs.forces import BumpStop
from jaxmbs.linear import LinearSystem
from jaxmbs.ode import _integrate
from jaxmbs.vibration import CoordinateLaw

TIMES = np.linspace(0.0, 1.0, 21)
PUSH = {"a x": np.sin(5.0 * TIMES)}
SOLVERS = {"Kvaerno5": diffrax.Kvaerno5(), "midpoint": mbs.ode.ImplicitMidpoint(newton=True)}


def system(stiffness=50.0, fast=400.0):
    """Two masses, the second one small and stiff: 8 and some 2e4 rad/s."""
    K = jnp.array([[1.0, 0.0], [0.0, 0.0]]) * stiffness + jnp.array([[1.0, -1.0], [-1.0, 1.0]]) * fast
    C = jnp.array([[0.3, 0.0], [0.0, 0.0]])
    mass = [[1.0, 0.0], [0.0, 1e-6]]
    return LinearSystem(mass=mass, stiffness=K, damping=C, interface=[0, 1], coordinates=["a x", "b x"])


def stop(gap=0.02):
    return [CoordinateLaw(BumpStop(4000.0, upper=gap, damping=0.1), {"a x": 1.0})]


def closed_form():
    """Displacements (T, 2) by the matrix exponential from kink to kink of the load."""
    s = system()
    K, C, M = (np.asarray(x) for x in (s.stiffness, s.damping, s.mass))
    A = np.zeros((6, 6))  # displacements, velocities, the load and its slope
    A[:2, 2:4] = np.eye(2)
    A[2:4, :4] = -np.linalg.solve(M, np.hstack([K, C]))
    A[2, 4] = A[4, 5] = 1.0
    over, y, rows = scipy.linalg.expm(A * TIMES[1]), np.zeros(6), [np.zeros(2)]
    for k in range(len(TIMES) - 1):
        y[4:] = PUSH["a x"][k], (PUSH["a x"][k + 1] - PUSH["a x"][k]) / TIMES[1]
        y = over @ y
        rows.append(y[:2])
    return np.array(rows)


@pytest.mark.long
def test_steps_are_set_by_the_slow_motion():
    """An explicit method takes thousands of steps for 20 000 rad/s."""
    motion = mbs.simulate(system(), ts=TIMES, forces=PUSH, solver=diffrax.Kvaerno5())
    assert motion.num_steps < 200
    np.testing.assert_allclose(motion.displacement, closed_form(), atol=2e-6)


@pytest.mark.long
@pytest.mark.parametrize("name", SOLVERS)
def test_steps_are_those_of_the_method(name, monkeypatch):
    """With fixed steps, other than the expected ones at the end too, and a law; its own iterations beside ours."""

    def run():
        options = {"solver": SOLVERS[name], "dt": 0.03, "rtol": 1e-12, "atol": 1e-12}
        return mbs.simulate(system(fast=0.02), ts=TIMES, forces=PUSH, laws=stop(), **options)

    ours = run()
    monkeypatch.setattr(_integrate, "solves_stages", lambda *_: False)
    jax.clear_caches()
    theirs = run()
    assert ours.num_steps == theirs.num_steps and np.max(ours.displacement[:, 0]) > 0.022
    np.testing.assert_allclose(ours.displacement, theirs.displacement, atol=1e-10)
    np.testing.assert_allclose(ours.velocity, theirs.velocity, atol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("name", SOLVERS)
def test_derivatives_are_those_of_the_steps(name):
    """By stiffness and gap, reverse and forward, a batch too, against differences of the same steps."""

    def last(p, gradient="reverse"):
        options = {"solver": SOLVERS[name], "dt": 0.05, "gradient": gradient}
        motion = mbs.simulate(system(p[0], 0.02), ts=TIMES, forces=PUSH, laws=stop(p[1]), **options)
        return jnp.sum(motion.displacement[10:] ** 2)

    points = jnp.array([[50.0, 0.02], [40.0, 0.015]])
    value = jax.jit(jax.vmap(last))
    reverse = jax.jit(jax.vmap(jax.grad(last)))(points)
    forward = jax.jit(jax.vmap(jax.jacfwd(lambda p: last(p, "forward"))))(points)
    steps = jnp.diag(jnp.array([1e-3, 1e-6]))
    difference = [(value(points + step) - value(points - step)) / (2.0 * jnp.sum(step)) for step in steps[:, None]]
    np.testing.assert_allclose(reverse, np.stack(difference, 1), rtol=1e-6)
    np.testing.assert_allclose(forward, reverse, rtol=1e-9)
