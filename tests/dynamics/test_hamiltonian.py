"""The state equations of S2 against Newton-Euler, energy derivatives and the printed signs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.dynamics import fields, hamiltonian, ports
from jaxmbs.dynamics.newton_euler import accelerations
from jaxmbs.kinematics.configuration import at_state, elsewhere, moving
from jaxmbs.kinematics.influence import independent_columns, velocity_map
from jaxmbs.kinematics.influence_second import along_independent

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


@pytest.fixture(params=["loop", "tree"])
def case(request):
    return request.getfixturevalue(request.param)


def test_inertia_field_is_the_projected_mass_matrix(case):
    system, state = case
    Gamma = velocity_map(system, at_state(system, state))[0]
    I_star = fields.inertia_field(system, state)
    np.testing.assert_allclose(I_star, Gamma.T @ mbs.mass_matrix(system, state) @ Gamma, rtol=1e-10, atol=1e-12)
    phi_dot = fields.independent_rates(system, state)
    np.testing.assert_allclose(fields.generalised_momentum(system, state), I_star @ phi_dot, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(0.5 * phi_dot @ I_star @ phi_dot, mbs.kinetic_energy(system, state), rtol=1e-10)


def test_gyristor_fields_differ_and_their_efforts_agree(loop, tree):
    for system, state in (loop, tree):
        phi_dot = fields.independent_rates(system, state)
        GR, direct = fields.gyristor_field(system, state), fields.gyristor_field_direct(system, state)
        assert np.max(np.abs(GR - direct)) > 1e-3
        np.testing.assert_allclose(GR @ phi_dot, direct @ phi_dot, rtol=1e-9, atol=1e-12)


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


def test_printed_second_gyristor_misses_a_half(loop):
    system, state = loop
    phi_dot = fields.independent_rates(system, state)
    twice = 2.0 * fields.gyristor_field_direct(system, state) @ phi_dot
    assert np.max(np.abs(twice - fields.gyristor_field(system, state) @ phi_dot)) > 1e-3


def test_the_hamiltonian_is_the_legendre_transform_of_the_lagrangian(case):
    """p = dL/d(phi_dot) = I* phi_dot, and H = p.phi_dot - L = 1/2 p.I*^-1 p, with p and not its rate."""
    system, state = case
    Gamma = velocity_map(system, at_state(system, state))[0]

    def lagrangian(phi_dot):
        return mbs.kinetic_energy(system, mbs.State(state.t, state.coordinates, Gamma @ phi_dot))

    phi_dot, I_star = fields.independent_rates(system, state), fields.inertia_field(system, state)
    L, p = jax.jit(jax.value_and_grad(lagrangian))(phi_dot)
    np.testing.assert_allclose(p, I_star @ phi_dot, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(p @ phi_dot - L, 0.5 * p @ np.linalg.solve(I_star, p), rtol=1e-9)


def test_independent_rate_equals_the_state_equations(case):
    system, state = case
    p = fields.inertia_field(system, state) @ fields.independent_rates(system, state)
    psi_dot, p_dot, _, u = jax.jit(hamiltonian.independent_rate)(system, at_state(system, state), p)
    np.testing.assert_allclose(u, state.velocities, atol=1e-9)
    np.testing.assert_allclose(p_dot, fields.state_equations(system, state)[0], rtol=1e-8, atol=1e-9)


def test_canonical_rate_projects_to_the_papers_momenta(case):
    """Gamma^T P of the canonical momentum obeys (42)-(44)."""
    system, state = case
    at = at_state(system, state)
    momenta = hamiltonian.momenta(system, moving(system, at, state.velocities))
    psi_dot, rate, _, u = jax.jit(hamiltonian.canonical_rate)(system, at, momenta)
    np.testing.assert_allclose(u, state.velocities, atol=1e-9)

    def seen(psi):
        return velocity_map(system, elsewhere(system, at, psi))[0].T @ momenta

    Gamma = velocity_map(system, at)[0]
    p_dot = Gamma.T @ rate + jax.jvp(seen, (state.coordinates,), (psi_dot,))[1]
    np.testing.assert_allclose(p_dot, fields.state_equations(system, state)[0], rtol=1e-7, atol=1e-9)


def test_ports_sum_to_the_total(case):
    system, state = case
    parts = [ports.source_effort, ports.compliance_effort, ports.resistance_effort, ports.gravity_effort]
    total = sum(part(system, state) for part in parts)
    np.testing.assert_allclose(total, ports.total_effort(system, state), rtol=1e-10, atol=1e-10)


def test_conservative_ports_are_the_slope_of_the_potential(four_bar, loop):
    for system, state in (four_bar, loop):

        def potential(at, system=system, state=state):
            return mbs.potential_energy(system, mbs.State(at.t, at.psi, state.velocities))

        slope = along_independent(system, at_state(system, state), potential)
        conservative = ports.compliance_effort(system, state) + ports.gravity_effort(system, state)
        np.testing.assert_allclose(conservative, -slope, rtol=1e-9, atol=1e-10)


def test_spring_port_from_the_spring_vector(loop):
    """(59) with G_hat (61) equals (64) with the derivative of the length, also off the free length."""
    system, state = loop
    q_C, G_hat = ports.spring_vector(system, state, "arm", "block")
    length = jnp.linalg.norm(q_C)
    n, K, q0 = q_C / length, 80.0, 0.3
    e_C = -K * G_hat.T @ (q_C - q0 * n)
    np.testing.assert_allclose(ports.compliance_effort(system, state), e_C, rtol=1e-9)
    G_C = jnp.outer(n, n @ G_hat)  # (65)
    np.testing.assert_allclose(-K * G_C.T @ (q_C - q0 * n), e_C, rtol=1e-9)
    assert np.max(np.abs(G_C - G_hat)) > 1e-2


def test_resistance_takes_power(loop):
    system, state = loop
    phi_dot = fields.independent_rates(system, state)
    R, e_R = ports.resistance_field(system, state), ports.resistance_effort(system, state)
    q_C, G_hat = ports.spring_vector(system, state, "arm", "block")
    G_R = (q_C / jnp.linalg.norm(q_C)) @ G_hat
    np.testing.assert_allclose(R, 1.0 * jnp.outer(G_R, G_R), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(e_R, -R @ phi_dot, rtol=1e-9)
    assert e_R @ phi_dot < 0.0
