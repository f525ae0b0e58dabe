"""The state equations of S2 against Newton-Euler, energy derivatives and the printed signs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.constraints import _closures as closures
from jaxmbs.constraints import _constraints as constraints
from jaxmbs.constraints._kic import dependent_columns
from jaxmbs.dynamics import _hamilton as hamilton
from jaxmbs.dynamics.paper import _springs as springs
from jaxmbs.kinematics._configuration import at_state, configuration, with_velocities
from jaxmbs.kinematics._poses import coordinate_rate
from tests.zoo import SPECIMENS, of_all
from tests.zoo.probes import fields, variations

LOOP = SPECIMENS["spatial_loop"]
of_free_motions = of_all(without=("drive", "rolling"), quick=("tree",), slow=("floating",))
of_free_motions_slowly = of_all(without=("drive", "rolling"), quick=(), slow=())


@of_free_motions_slowly
def test_inertia_field_is_the_projected_mass_matrix(specimen):
    of = fields(specimen)
    np.testing.assert_allclose(of.I_star, of.Gamma.T @ of.mass @ of.Gamma, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(of.momentum, of.I_star @ of.phi_dot, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(0.5 * of.phi_dot @ of.I_star @ of.phi_dot, of.kinetic, rtol=1e-10)


@of_all(without=("drive", "rolling", "ball"), quick=("tree",), slow=())
def test_gyristor_fields_differ_and_their_efforts_agree(specimen):
    """Where coordinates are integrals of their velocities; with one of them there is but one field."""
    of = fields(specimen)
    assert np.max(np.abs(of.GR - of.direct)) > 1e-3 or of.GR.shape == (1, 1)
    np.testing.assert_allclose(of.GR @ of.phi_dot, of.direct @ of.phi_dot, rtol=1e-9, atol=1e-12)


@of_free_motions_slowly
def test_state_equations_have_plus_before_the_gyristor(specimen):
    of, truth = fields(specimen), variations(specimen).momentum_rate
    p_dot, phi_dot, q_dot = of.state_equations
    np.testing.assert_allclose(p_dot, truth, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(phi_dot, of.phi_dot, rtol=1e-12)
    printed = of.total - of.GR @ of.phi_dot
    assert np.max(np.abs(printed - truth)) > 1e-3  # (42) as printed, with a minus, is another motion
    dependent = specimen.state.velocities[dependent_columns(specimen.system)]
    np.testing.assert_allclose(q_dot, dependent, atol=1e-10)


@pytest.mark.long
def test_printed_second_gyristor_misses_a_half():
    of = fields(LOOP)
    twice = 2.0 * of.direct @ of.phi_dot
    assert np.max(np.abs(twice - of.GR @ of.phi_dot)) > 1e-3


@of_free_motions_slowly
def test_the_hamiltonian_is_the_legendre_transform_of_the_lagrangian(specimen):
    """p = dL/d(phi_dot) = I* phi_dot, and H = p.phi_dot - L = 1/2 p.I*^-1 p, with p and not its rate."""
    of, L, p = fields(specimen), variations(specimen).lagrangian, variations(specimen).momentum
    np.testing.assert_allclose(p, of.I_star @ of.phi_dot, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(p @ of.phi_dot - L, 0.5 * p @ np.linalg.solve(of.I_star, p), rtol=1e-9)


@of_free_motions
def test_independent_rate_equals_the_state_equations(specimen):
    _, p_dot, _, u = fields(specimen).independent
    np.testing.assert_allclose(u, specimen.state.velocities, atol=1e-9)
    np.testing.assert_allclose(p_dot, fields(specimen).state_equations[0], rtol=1e-8, atol=1e-9)


@of_free_motions
def test_canonical_rate_projects_to_the_papers_momenta(specimen):
    """Gamma^T P of the canonical momentum obeys (42)-(44)."""
    p_dot, u = fields(specimen).canonical
    np.testing.assert_allclose(u, specimen.state.velocities, atol=1e-9)
    np.testing.assert_allclose(p_dot, fields(specimen).state_equations[0], rtol=1e-7, atol=1e-9)


@of_free_motions
def test_ports_sum_to_the_total(specimen):
    of = fields(specimen)
    np.testing.assert_allclose(of.e_S + of.e_C + of.e_R + of.e_G, of.total, rtol=1e-10, atol=1e-10)


@of_free_motions_slowly
def test_conservative_ports_are_the_slope_of_the_potential(specimen):
    conservative = fields(specimen).e_C + fields(specimen).e_G
    np.testing.assert_allclose(conservative, -variations(specimen).potential, rtol=1e-9, atol=1e-10)


@pytest.mark.long
def test_spring_port_from_the_spring_vector():
    """(59) with G_hat (61) equals (64) with the derivative of the length, also off the free length."""
    q_C, G_hat = springs.spring_vector(LOOP.system, LOOP.state, "arm", "block")
    length = jnp.linalg.norm(q_C)
    n, K, q0 = q_C / length, 80.0, 0.3
    e_C = -K * G_hat.T @ (q_C - q0 * n)
    np.testing.assert_allclose(fields(LOOP).e_C, e_C, rtol=1e-9)
    G_C = jnp.outer(n, n @ G_hat)  # (65)
    np.testing.assert_allclose(-K * G_C.T @ (q_C - q0 * n), e_C, rtol=1e-9)
    assert np.max(np.abs(G_C - G_hat)) > 1e-2


@pytest.mark.long
def test_resistance_takes_power():
    phi_dot, R, e_R = fields(LOOP).phi_dot, fields(LOOP).R, fields(LOOP).e_R
    q_C, G_hat = springs.spring_vector(LOOP.system, LOOP.state, "arm", "block")
    G_R = (q_C / jnp.linalg.norm(q_C)) @ G_hat
    np.testing.assert_allclose(R, 1.0 * jnp.outer(G_R, G_R), rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(e_R, -R @ phi_dot, rtol=1e-9)
    assert e_R @ phi_dot < 0.0


@pytest.mark.long
def test_multipliers_of_the_momentum_pull_with_the_rate_of_their_rows():
    """`A_dot^T sigma`, by the derivative of the rows along the motion."""
    system = LOOP.system

    @jax.jit
    def both(state):
        at, u = at_state(system, state), state.velocities
        sigma = jnp.arange(1.0, 1.0 + system.topology.num_rows)
        here = closures.with_directions(system, with_velocities(system, at, u))
        rates = [hamilton.tree_momentum_rate(system, here, *more)[0] for more in ((sigma,), ())]
        row_force = lambda psi: constraints.jacobian(system, configuration(system, at.P, psi, at.t)).T @ sigma
        along = coordinate_rate(system.topology, at.psi, u)
        return rates[0] - rates[1], jax.jvp(row_force, (at.psi,), (along,))[1]

    found, expected = both(LOOP.state)
    assert np.max(np.abs(expected)) > 0.1
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.max(np.abs(expected)))
