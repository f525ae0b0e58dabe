"""Implicit midpoint and the fourth-order Gauss method: orders, structure, derivatives, failures."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.kinematics._configuration import at_state
from jaxmbs.motion._formulations import Canonical
from jaxmbs.ode._gauss import solve_stages
from tests.cases import models
from tests.cases.test_double_pendulum import ANGLES
from tests.models import four_bar, four_bar_state

GAUSS = [mbs.ode.ImplicitMidpoint, mbs.ode.Gauss4]
ORDER = {mbs.ode.ImplicitMidpoint: 2, mbs.ode.Gauss4: 4}


@pytest.fixture(scope="module")
def double_pendulum():
    system = models.double_pendulum()
    return system, mbs.State.at(system, shoulder=np.pi / 2, elbow=0.0)


# ------------------------------------------------------------------------------------------------- order, structure
@pytest.mark.long
@pytest.mark.parametrize("solver", GAUSS)
def test_order_of_convergence(double_pendulum, solver):
    """D1 at 1 s: differences between halved steps shrink by 2^order; the limit is heyoka's."""
    system, state = double_pendulum

    def angles(dt):
        motion = mbs.simulate(system, state, ts=[1.0], dt=dt, solver=solver(), gradient="forward", throw=False)
        return jnp.cumsum(motion.states.coordinates[-1])

    angles = jax.jit(angles)
    coarse, middle, fine = (np.asarray(angles(dt)) for dt in (0.01, 0.005, 0.0025))
    power = 2.0 ** ORDER[solver]
    np.testing.assert_allclose((coarse - middle) / (middle - fine), power, rtol=0.05)
    limit = fine + (fine - middle) / (power - 1.0)
    np.testing.assert_allclose(limit, ANGLES[1], atol=0.02 * np.max(np.abs(fine - middle)))


def one_step(system, state, solver):
    """The compiled step (h, x) -> x in coordinates and momenta, and x at the state."""
    psi, u = state.coordinates, state.velocities
    problem, p = Canonical.begin(system, at_state(system, state), u)
    term = diffrax.ODETerm(lambda t, y, problem: problem.rate(t, y))
    scale = jnp.concatenate([jnp.ones_like(psi), problem.scale])

    def step(h, x):
        x = x / scale
        y = x[: psi.size], x[psi.size :], jnp.zeros(0)
        start = jnp.zeros(())
        memory = solver.init(term, start, h, y, problem)
        y1 = solver.step(term, start, h, y, problem, memory, True)[0]
        return scale * jnp.concatenate(y1[:2])

    return jax.jit(lambda h, x: (step(h, x), jax.jacfwd(step, argnums=1)(h, x))), scale * jnp.concatenate([psi, p])


@pytest.mark.long
@pytest.mark.parametrize("solver", [mbs.ode.ImplicitMidpoint, mbs.ode.Gauss4, diffrax.Dopri8])
def test_one_step_is_symplectic_and_reversible(double_pendulum, solver):
    """D^T J D = J and phi(-h, phi(h, x)) = x to rounding, at a coarse step; not so for Dopri8."""
    system, _ = double_pendulum
    state = mbs.State.at(system, shoulder=1.0, elbow=0.5, velocities={"shoulder": 2.0, "elbow": -3.0})
    is_dopri8 = solver is diffrax.Dopri8
    step, x = one_step(system, state, solver(scan_kind="lax") if is_dopri8 else solver())
    h = jnp.asarray(0.15)
    x1, D = step(h, x)
    J = np.kron([[0.0, 1.0], [-1.0, 0.0]], np.eye(2))
    defect = np.max(np.abs(D.T @ J @ D - J))
    back = np.max(np.abs(step(-h, x1)[0] - x))
    assert np.max(np.abs(x1 - x)) > 0.1
    if is_dopri8:
        assert defect > 1e-11 and back > 1e-11
    else:
        assert defect < 1e-13 and back < 1e-13


# --------------------------------------------------------------------------------------------------- linear systems
def oscillator(stiffness, damping, force=0.0):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", mass=2.0)
    b.joint("slide", mbs.Prismatic(axis="z"), "ground", "mass")
    b.force("spring", mbs.SpringDamper(stiffness=stiffness, damping=damping), joint="slide")
    b.force("push", mbs.Actuator(lambda x, v, t: force + 0.0 * x), joint="slide")
    return b.build()


def pade(z, order):
    """Diagonal Pade approximant of exp(z): what the methods make of a linear system."""
    one = np.eye(len(z))
    even, odd = (one, z / 2) if order == 2 else (one + z @ z / 12, z / 2)
    return np.linalg.solve(even - odd, even + odd)


@pytest.mark.long
@pytest.mark.parametrize("solver", [mbs.ode.ImplicitMidpoint, mbs.ode.Gauss4])
def test_stiff_linear_system(solver):
    """Steps of 16 radians: Newton's method yields the Pade approximant; fixed-point iteration too, or it says so."""
    k, c, m, h = 5e4, 2.0, 2.0, 0.1
    system = oscillator(k, c)
    start = mbs.State.at(system, slide=1.0, velocities={"slide": -3.0})
    options = {"ts": [5 * h], "dt": h, "gradient": "forward"}
    motion = mbs.simulate(system, start, solver=solver(newton=True), **options)
    R = pade(h * np.array([[0.0, 1.0], [-k / m, -c / m]]), ORDER[solver])
    expected = np.linalg.matrix_power(R, 5) @ [1.0, -3.0]
    found = [motion.states.coordinates[0, 0], motion.states.velocities[0, 0]]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    motion = mbs.simulate(system, start, solver=solver(), throw=False, **options)
    if motion.ok:
        np.testing.assert_allclose(motion.states.velocities[0, 0], expected[1], rtol=1e-9)
    else:
        assert "an implicit step was not solved" in str(mbs.Status(int(motion.status)))


@pytest.mark.long
@pytest.mark.parametrize("solver", GAUSS)
def test_between_steps(solver):
    """Under a constant force both methods and their dense output are exact; the work account too."""
    system = oscillator(0.0, 0.0, force=3.0)
    start = mbs.State.at(system, slide=1.0, velocities={"slide": -3.0})
    t = np.array([0.0, 0.07, 0.1, 0.23, 0.5])
    motion = mbs.simulate(system, start, ts=t, dt=0.1, solver=solver(), gradient="forward")
    travel = -3.0 * t + 0.75 * t**2
    np.testing.assert_allclose(motion.states.coordinates[:, 0], 1.0 + travel, atol=1e-13)
    np.testing.assert_allclose(motion.states.velocities[:, 0], -3.0 + 1.5 * t, atol=1e-13)
    np.testing.assert_allclose(motion.diagnostics.work["push"], 3.0 * travel, atol=1e-13)


def test_step_is_required(double_pendulum):
    with pytest.raises(ValueError, match="Gauss4 has no error estimate: give dt="):
        mbs.simulate(*double_pendulum, t1=1.0, solver=mbs.ode.Gauss4())


# ---------------------------------------------------------------------------------------------- derivatives, loops
@pytest.fixture(scope="module")
def damped():
    """Angle and work of a damped pendulum at 1 s, as a function of its length, by mode of derivative."""

    def build(length, like=None):
        b = mbs.SystemBuilder(gravity=models.DOWN_Y)
        b.body("bob", mass=1.0, com=jnp.stack([0.0 * length, -length, 0.0 * length]))
        b.joint("pivot", mbs.Revolute(axis="z"), "ground", "bob")
        b.force("damper", mbs.SpringDamper(stiffness=2.0, damping=0.3), joint="pivot")
        return b.build(like=like)

    like = build(jnp.asarray(1.0))

    def outcome(length, mode, newton=False):
        system, state = build(length, like), mbs.State(jnp.zeros(()), jnp.array([1.0]), jnp.zeros(1))
        motion = mbs.simulate(system, state, ts=[0.5], dt=0.05, solver=mbs.ode.Gauss4(newton), gradient=mode)
        return motion.states.coordinates[-1, 0] + motion.diagnostics.work["damper"][-1]

    def central(h):
        f = jax.jit(lambda length: outcome(length, "forward"))
        return (8 * (f(1.1 + h) - f(1.1 - h)) - (f(1.1 + 2 * h) - f(1.1 - 2 * h))) / (12 * h)

    return outcome, float(central(1e-3))


@pytest.mark.parametrize(
    "mode, newton",
    [
        pytest.param("forward", False, marks=pytest.mark.long),
        pytest.param("reverse", False, marks=pytest.mark.long),
        pytest.param("forward", True, marks=pytest.mark.long),
    ],
)
def test_derivatives(damped, mode, newton):
    outcome, expected = damped
    derivative = jax.jacfwd if mode == "forward" else jax.grad
    found = jax.jit(derivative(lambda length: outcome(length, mode, newton)))(1.1)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize("newton", [False, True])
def test_implicit_function_theorem(newton):
    """z + z^3 / 5 = a: z' = 1 / (1 + 3 z^2 / 5), z'' = -6 z z'^3 / 5, forward, reverse and both."""

    def root(a):
        Z, converged = solve_stages(lambda Z: Z + Z**3 / 5 - a, jnp.zeros((1, 1)), jnp.ones(1), newton)
        return jnp.where(converged, Z[0, 0], jnp.nan)

    z = 0.5
    first = 1.0 / (1.0 + 0.6 * z**2)
    second = -1.2 * z * first**3
    derivatives = jax.jit(
        lambda a: (root(a), jax.jacfwd(root)(a), jax.grad(root)(a), jax.hessian(root)(a), jax.grad(jax.grad(root))(a))
    )
    np.testing.assert_allclose(derivatives(z + z**3 / 5), [z, first, first, second, second], rtol=1e-13)


@pytest.mark.long
def test_closed_loop():
    """Inside the projection: order and closure kept, against Dopri8 at 1e-11."""
    system = four_bar(stiffness=5.0)
    state = four_bar_state(system)
    expected = mbs.simulate(system, state, ts=[1.0], rtol=1e-11, atol=1e-11, gradient="forward").states.coordinates
    run = jax.jit(
        lambda dt: mbs.simulate(system, state, ts=[1.0], dt=dt, solver=mbs.ode.Gauss4(), gradient="forward")
    )
    motions = [run(dt) for dt in (0.02, 0.01)]
    coarse, fine = (np.max(np.abs(m.states.coordinates - expected)) for m in motions)
    assert fine < 3e-6 and 12.0 < coarse / fine < 20.0
    assert np.max(motions[0].diagnostics.constraint_drift) < 1e-12


@pytest.mark.parametrize(
    "solver", [mbs.ode.ImplicitMidpoint(newton=True), mbs.ode.Gauss4(newton=True)], ids=["2", "4"]
)
@pytest.mark.parametrize("stiffness", [1e6, 1e8, 1e10])
def test_steps_far_above_the_period_of_a_stiff_strut(solver, stiffness):
    """Rounding of the strut's force is more than that of what moves: the stages are found all the same."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    b.body("mass", 2.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "mass")
    b.force("strut", mbs.SpringDamper(stiffness, free_length=1.0), between=("ground", "mass"))
    system = b.build()
    motion = mbs.simulate(
        system, mbs.State.at(system, slide=1.0), ts=np.linspace(0.0, 0.1, 5), dt=1e-3, solver=solver
    )
    sunk = 2.0 * 9.81 / stiffness
    assert np.all(np.abs(motion.states.coordinates[:, 0] - 1.0 + sunk) < 1.01 * sunk + 1e-15)
