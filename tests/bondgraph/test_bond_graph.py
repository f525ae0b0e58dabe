"""Powers, balances, causality and state equations of bond graphs against the dynamics they picture."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.bondgraph import junction_residual, state_equations
from jaxmbs.bondgraph.views import VIEWS
from jaxmbs.dynamics import fields, hamilton
from jaxmbs.dynamics.efforts import efforts, element_is_source, element_names, stored_energy
from jaxmbs.dynamics.energy import energies
from jaxmbs.kinematics.configuration import at_state, configuration, moving
from jaxmbs.kinematics.influence import dependent_columns, independent_columns, velocity_map
from jaxmbs.kinematics.poses import coordinate_rate, node_parameters

from ..cases import models
from ..cases.test_slider_crank import OMEGA, START, TIMES, TORQUE
from . import cases


def everything(system, state):
    """Powers and state equations of all views, and what they should be, in one compiled function."""
    P = node_parameters(system)

    @jax.jit
    def ask(state):
        powers = {view: mbs.bond_powers(system, state, view) for view in VIEWS}
        equations = {view: state_equations(system, state, view) for view in VIEWS}
        u_dot, _ = mbs.forward_dynamics(system, state)
        psi, u, t = state.coordinates, state.velocities, state.t
        along = (coordinate_rate(system.topology, psi, u), u_dot, jnp.ones_like(t))

        def energy(psi, u, t):
            at = moving(system, configuration(system, P, psi, t), u)
            return *energies(system, at), stored_energy(system, at)

        rates = jax.jvp(energy, (psi, u, t), along)[1]
        element_powers = efforts(system, moving(system, at_state(system, state), u))[2]
        return powers, equations, rates, element_powers, truth(system, state)

    return system, state, *ask(state)


def truth(system, state):
    """(p_dot, phi_dot, q_dot) by the paper's state equations, or with drives by those that are integrated."""
    if not system.rows:
        return fields.state_equations(system, state)
    at = at_state(system, state)
    p = velocity_map(system, at)[0].T @ mbs.mass_matrix(system, state) @ state.velocities
    _, p_dot, _, u = hamilton.independent_rate(system, at, p)
    return p_dot, u[independent_columns(system)], u[dependent_columns(system)]


@pytest.fixture(scope="module")
def crank():
    system = cases.slider_crank()
    return everything(system, cases.slider_crank_state(system))


@pytest.fixture(scope="module")
def arm():
    system = cases.driven_arm()
    return everything(system, cases.driven_arm_state(system))


@pytest.fixture(scope="module")
def beam():
    system = cases.elastic_arm()
    return everything(system, cases.elastic_arm_state(system))


@pytest.fixture(
    params=["crank", pytest.param("arm", marks=pytest.mark.long), pytest.param("beam", marks=pytest.mark.slow)]
)
def case(request):
    return request.getfixturevalue(request.param)


def largest(powers):
    return max(float(np.max(np.abs(p))) for p in powers.power.values())


def test_every_junction_passes_its_power_on(case):
    for powers in case[2].values():
        for name, power in junction_residual(powers).items():
            assert abs(float(power)) < 1e-12 * largest(powers), name


def test_powers_of_all_elements_sum_to_zero(case):
    for powers in case[2].values():
        assert abs(float(sum(powers.ports().values()))) < 1e-11 * largest(powers)


def test_stores_take_the_rates_of_the_energies(case):
    _, _, powers, _, (kinetic, potential, springs), _, _ = case
    gravity = potential - springs
    ports = {view: powers[view].ports() for view in VIEWS}
    close = {"rtol": 1e-10, "atol": 1e-12}
    detailed = sum(p for name, p in ports["detailed"].items() if name.split(":")[0] in ("I", "m", "GR"))
    np.testing.assert_allclose(detailed, kinetic, **close)
    for view in ("inertia", "hamiltonian"):  # the bond of I* alone does not conserve
        np.testing.assert_allclose(ports[view]["I*"] + ports[view]["GR"], kinetic, **close)
        assert abs(float(ports[view]["I*"] - kinetic)) > 1e-3
    np.testing.assert_allclose(sum(p for name, p in ports["inertia"].items() if name[:2] == "C:"), springs, **close)
    np.testing.assert_allclose(sum(p for name, p in ports["detailed"].items() if name[:3] == "mg:"), gravity, **close)
    np.testing.assert_allclose(ports["inertia"]["gravity"], gravity, **close)


def test_resistors_and_sources_pass_the_elements_powers(case):
    system, _, powers, _, _, elements, _ = case
    ports, elastic = powers["detailed"].ports(), {name for group in system.elastic for name in group.names}
    for name, is_source, power in zip(element_names(system), element_is_source(system), elements, strict=True):
        place = f"{name}.strain" if name in elastic else name
        found = ports.get(f"{'Se' if is_source else 'R'}:{place}", 0.0)
        np.testing.assert_allclose(found, -power, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("view", VIEWS)
def test_state_equations_read_back(case, view):
    system, state, _, equations, _, _, expected = case
    for found, right in zip(equations[view], expected, strict=True):
        np.testing.assert_allclose(found, right, rtol=1e-10, atol=1e-11)
    phi_dot, q_dot = fields.independent_rates(system, state), state.velocities[dependent_columns(system)]
    np.testing.assert_allclose(equations[view][1], phi_dot, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(equations[view][2], q_dot, rtol=1e-9, atol=1e-11)


@pytest.mark.slow
def test_wholly_driven_mechanism_along_its_motion():
    """Without freedom the drives are the only root, and their power is the textbook's torque times speed."""
    system = models.slider_crank(drive=lambda t: START + OMEGA * t, gas_force=-200.0)
    angles = START + OMEGA * TIMES
    states = [
        mbs.State.at(system, guess={"main": angle} | models.slider_crank_guess(angle), t=t)
        for angle, t in zip(angles, TIMES, strict=True)
    ]
    powers = mbs.bond_powers(system, cases.stacked(states))
    assert powers.graph.roots == ("drives",)
    np.testing.assert_allclose(-powers.into("drive"), TORQUE * OMEGA, rtol=1e-6)
    worst = max(np.max(np.abs(p)) for p in junction_residual(powers).values())
    assert worst < 1e-11 * largest(powers)
    graph = mbs.bond_graph(system, "detailed", states[0])
    assert set(graph.dependent) == {"I:crank", "m:crank", "I:rod", "m:rod", "m:slider"}


@pytest.mark.slow
def test_powers_differentiate(crank):
    system, state, powers, *_ = crank
    stiffness = system.forces[0].law.stiffness

    def power(k):
        changed = eqx.tree_at(lambda s: s.forces[0].law.stiffness, system, stiffness.at[0].set(k))
        return mbs.bond_powers(changed, state, "inertia").ports()["C:buffer"]

    slope = jax.jit(jax.grad(power))(300.0)
    np.testing.assert_allclose(slope, powers["inertia"].ports()["C:buffer"] / 300.0, rtol=1e-12)


def test_faults():
    system = cases.double_pendulum()
    with pytest.raises(ValueError, match="view must be one of detailed, inertia, hamiltonian"):
        mbs.bond_graph(system, "paper")
    b = mbs.SystemBuilder()
    b.body("block", 1.0, inertia=0.1)
    b.joint("glue", mbs.Weld(), "ground", "block")
    with pytest.raises(mbs.ModelError, match="nothing moves"):
        mbs.bond_graph(b.build())
