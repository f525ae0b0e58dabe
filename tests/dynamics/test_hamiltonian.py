"""The state equations of S2 against Newton-Euler, energy derivatives and the printed signs."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.dynamics import fields, hamilton, ports, springs
from jaxmbs.dynamics.newton_euler import accelerations
from jaxmbs.kinematics import closures, constraints
from jaxmbs.kinematics.configuration import at_state, configuration, elsewhere, moving
from jaxmbs.kinematics.influence import independent_columns, velocity_map
from jaxmbs.kinematics.influence_second import along_independent
from jaxmbs.kinematics.poses import coordinate_rate

from .. import systems


@pytest.fixture(scope="module")
def four_bar():
    system = systems.four_bar()
    return system, systems.four_bar_state(system)


@pytest.fixture(scope="module")
def loop():
    system = systems.spatial_loop()
    return system, mbs.State.at(
        system, cross=(0.2, -0.3), velocities={"cross": (0.7, -0.4)}, guess={"elbow": (0.1, 0.4)}
    )


@pytest.fixture(scope="module")
def tree():
    system = systems.spatial_tree()
    return system, systems.general_state(system)


@jax.jit
def _asked(system, state):
    """What the tests ask of a system: one program."""
    return {
        "Gamma": velocity_map(system, at_state(system, state))[0],
        "mass": mbs.mass_matrix(system, state),
        "kinetic": mbs.kinetic_energy(system, state),
        "phi_dot": fields.independent_rates(system, state),
        "I_star": fields.inertia_field(system, state),
        "momentum": fields.generalised_momentum(system, state),
        "GR": fields.gyristor_field(system, state),
        "direct": fields.gyristor_field_direct(system, state),
        "p_dot": fields.state_equations(system, state)[0],
        "e_S": ports.source_effort(system, state),
        "e_C": ports.compliance_effort(system, state),
        "e_R": ports.resistance_effort(system, state),
        "e_G": ports.gravity_effort(system, state),
        "total": ports.total_effort(system, state),
        "R": ports.resistance_field(system, state),
    }


@pytest.fixture(scope="module")
def of_loop(loop):
    return SimpleNamespace(**_asked(*loop))


@pytest.fixture(scope="module")
def of_tree(tree):
    return SimpleNamespace(**_asked(*tree))


@pytest.fixture(params=["loop", "tree"])
def case(request):
    return request.getfixturevalue(request.param)


@pytest.fixture(params=["loop", "tree"])
def of_case(request):
    return request.getfixturevalue(f"of_{request.param}")


@pytest.mark.slow
def test_inertia_field_is_the_projected_mass_matrix(of_case):
    Gamma, I_star, phi_dot = of_case.Gamma, of_case.I_star, of_case.phi_dot
    np.testing.assert_allclose(I_star, Gamma.T @ of_case.mass @ Gamma, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(of_case.momentum, I_star @ phi_dot, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(0.5 * phi_dot @ I_star @ phi_dot, of_case.kinetic, rtol=1e-10)


@pytest.mark.long
def test_gyristor_fields_differ_and_their_efforts_agree(of_loop, of_tree):
    for of in (of_loop, of_tree):
        assert np.max(np.abs(of.GR - of.direct)) > 1e-3
        np.testing.assert_allclose(of.GR @ of.phi_dot, of.direct @ of.phi_dot, rtol=1e-9, atol=1e-12)


def momentum_rate_of_the_motion(system, state):
    """d/dt (I* phi_dot) along the motion, from the accelerations of Newton-Euler."""
    at, chosen = at_state(system, state), np.asarray(independent_columns(system))
    u_dot, *_ = accelerations(system, moving(system, at, state.velocities))
    slope = along_independent(system, at, lambda at: fields._inertia_field(system, at))
    phi_dot = state.velocities[chosen]
    I_star = fields.inertia_field(system, state)
    return I_star @ u_dot[chosen] + jnp.einsum("ijm,m,j->i", slope, phi_dot, phi_dot)


@pytest.mark.long
def test_state_equations_have_plus_before_the_gyristor(case):
    system, state = case
    p_dot, phi_dot, q_dot = fields.state_equations(system, state)
    truth = momentum_rate_of_the_motion(system, state)
    np.testing.assert_allclose(p_dot, truth, rtol=1e-8, atol=1e-10)
    printed = ports.total_effort(system, state) - fields.gyristor_field(system, state) @ phi_dot
    assert np.max(np.abs(printed - truth)) > 1e-3  # (42) as printed, with a minus, is another motion
    dependent = np.setdiff1d(np.arange(system.topology.num_velocities), independent_columns(system))
    np.testing.assert_allclose(q_dot, state.velocities[dependent], atol=1e-10)


@pytest.mark.slow
def test_printed_second_gyristor_misses_a_half(of_loop):
    twice = 2.0 * of_loop.direct @ of_loop.phi_dot
    assert np.max(np.abs(twice - of_loop.GR @ of_loop.phi_dot)) > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["loop", "tree"])
def test_the_hamiltonian_is_the_legendre_transform_of_the_lagrangian(name, request):
    """p = dL/d(phi_dot) = I* phi_dot, and H = p.phi_dot - L = 1/2 p.I*^-1 p, with p and not its rate."""
    (system, state), of = request.getfixturevalue(name), request.getfixturevalue(f"of_{name}")

    def lagrangian(phi_dot):
        return mbs.kinetic_energy(system, mbs.State(state.t, state.coordinates, of.Gamma @ phi_dot))

    phi_dot, I_star = of.phi_dot, of.I_star
    L, p = jax.jit(jax.value_and_grad(lagrangian))(phi_dot)
    np.testing.assert_allclose(p, I_star @ phi_dot, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(p @ phi_dot - L, 0.5 * p @ np.linalg.solve(I_star, p), rtol=1e-9)


@pytest.mark.parametrize("name", [pytest.param("loop", marks=pytest.mark.slow), "tree"])
def test_independent_rate_equals_the_state_equations(name, request):
    (system, state), of = request.getfixturevalue(name), request.getfixturevalue(f"of_{name}")
    rate = jax.jit(lambda system, state, p: hamilton.independent_rate(system, at_state(system, state), p))
    _, p_dot, _, u = rate(system, state, of.I_star @ of.phi_dot)
    np.testing.assert_allclose(u, state.velocities, atol=1e-9)
    np.testing.assert_allclose(p_dot, of.p_dot, rtol=1e-8, atol=1e-9)


@jax.jit
def _canonical(system, state):
    """The rate of the paper's momenta Gamma^T P, and the velocities."""
    at = at_state(system, state)
    momenta = hamilton.momenta(system, moving(system, at, state.velocities))
    psi_dot, rate, _, u = hamilton.canonical_rate(system, at, momenta)

    def seen(psi):
        return velocity_map(system, elsewhere(system, at, psi))[0].T @ momenta

    Gamma = velocity_map(system, at)[0]
    return Gamma.T @ rate + jax.jvp(seen, (state.coordinates,), (psi_dot,))[1], u


@pytest.mark.parametrize("name", ["loop", "tree"])
def test_canonical_rate_projects_to_the_papers_momenta(name, request):
    """Gamma^T P of the canonical momentum obeys (42)-(44)."""
    (system, state), of = request.getfixturevalue(name), request.getfixturevalue(f"of_{name}")
    p_dot, u = _canonical(system, state)
    np.testing.assert_allclose(u, state.velocities, atol=1e-9)
    np.testing.assert_allclose(p_dot, of.p_dot, rtol=1e-7, atol=1e-9)


def test_ports_sum_to_the_total(of_case):
    total = of_case.e_S + of_case.e_C + of_case.e_R + of_case.e_G
    np.testing.assert_allclose(total, of_case.total, rtol=1e-10, atol=1e-10)


@pytest.mark.slow
def test_conservative_ports_are_the_slope_of_the_potential(four_bar, loop):
    @jax.jit
    def both(system, state):
        def potential(at):
            return mbs.potential_energy(system, mbs.State(at.t, at.psi, state.velocities))

        slope = along_independent(system, at_state(system, state), potential)
        return ports.compliance_effort(system, state) + ports.gravity_effort(system, state), slope

    for system, state in (four_bar, loop):
        conservative, slope = both(system, state)
        np.testing.assert_allclose(conservative, -slope, rtol=1e-9, atol=1e-10)


def test_spring_port_from_the_spring_vector(loop, of_loop):
    """(59) with G_hat (61) equals (64) with the derivative of the length, also off the free length."""
    system, state = loop
    q_C, G_hat = springs.spring_vector(system, state, "arm", "block")
    length = jnp.linalg.norm(q_C)
    n, K, q0 = q_C / length, 80.0, 0.3
    e_C = -K * G_hat.T @ (q_C - q0 * n)
    np.testing.assert_allclose(of_loop.e_C, e_C, rtol=1e-9)
    G_C = jnp.outer(n, n @ G_hat)  # (65)
    np.testing.assert_allclose(-K * G_C.T @ (q_C - q0 * n), e_C, rtol=1e-9)
    assert np.max(np.abs(G_C - G_hat)) > 1e-2


def test_resistance_takes_power(loop, of_loop):
    system, state = loop
    phi_dot, R, e_R = of_loop.phi_dot, of_loop.R, of_loop.e_R
    q_C, G_hat = springs.spring_vector(system, state, "arm", "block")
    G_R = (q_C / jnp.linalg.norm(q_C)) @ G_hat
    np.testing.assert_allclose(R, 1.0 * jnp.outer(G_R, G_R), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(e_R, -R @ phi_dot, rtol=1e-9)
    assert e_R @ phi_dot < 0.0


def test_multipliers_of_the_momentum_pull_with_the_rate_of_their_rows(loop):
    """`A_dot^T sigma`, by the derivative of the rows along the motion."""
    system, state = loop

    @jax.jit
    def both(state):
        at, u = at_state(system, state), state.velocities
        sigma = jnp.arange(1.0, 1.0 + system.topology.num_rows)
        here, directions = moving(system, at, u), closures.moving_directions(system, at)
        rates = [hamilton.tree_momentum_rate(system, here, *more)[0] for more in ((sigma, directions), ())]
        row_force = lambda psi: constraints.jacobian(system, configuration(system, at.P, psi, at.t)).T @ sigma  # noqa: E731
        along = coordinate_rate(system.topology, at.psi, u)
        return rates[0] - rates[1], jax.jvp(row_force, (at.psi,), (along,))[1]

    found, expected = both(state)
    assert np.max(np.abs(expected)) > 0.1
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.max(np.abs(expected)))
