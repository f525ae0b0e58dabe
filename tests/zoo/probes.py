"""What tests ask of a specimen, a compiled program per room; the answers are NumPy arrays by name, computed once."""

import functools
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import dynamics
from jaxmbs.bondgraph import graph_state_equations
from jaxmbs.bondgraph._views import VIEWS
from jaxmbs.constraints import _kic as first
from jaxmbs.constraints import _kic_second as second
from jaxmbs.constraints._kic import velocity_map
from jaxmbs.dynamics import _hamilton as hamilton
from jaxmbs.dynamics._efforts import efforts, stored_energy
from jaxmbs.dynamics._energy import energies
from jaxmbs.kinematics._configuration import at_coordinates, at_state, with_velocities
from jaxmbs.kinematics._poses import coordinate_rate


def probe(function):
    """`function(system, state)` -> answers by name, as a function of a specimen."""
    compiled = mbs.jit(function, compile="quick")

    @functools.cache
    @functools.wraps(function)
    def asked(specimen):
        return SimpleNamespace(**jax.tree.map(np.asarray, compiled(specimen.system, specimen.state)))

    return asked


@probe
def kinematics(system, state):
    """Influence coefficients of both orders beside the velocities that they give."""
    names, at = system.topology.body_names, at_state(system, state)
    K, H = mbs.constraints.kic(system, state), mbs.constraints.kic_second(system, state)
    return {
        "phi_dot": state.velocities[first.independent_columns(system)],
        "K": {"translational": K.translational, "rotational": K.rotational},
        "H": {"translational": H.translational, "rotational": H.rotational},
        "forward": second.body_kic_second(system, at),
        "vector": second.body_kic_second_vector(system, at),
        "velocities": {n: mbs.velocity(system, state, (n, system.com[k])) for k, n in enumerate(names)},
        "turning": {name: mbs.kinematics.angular_velocity(system, state, name) for name in names},
    }


@probe
def motion(system, state):
    """Accelerations, loads and powers, beside the rates along the motion of what they change."""
    names, at, u = system.topology.body_names, at_state(system, state), state.velocities
    u_dot, multipliers = mbs.forward_dynamics(system, state)

    def followed(psi, u, t):
        now = mbs.State(t, psi, u)
        here = with_velocities(system, at_state(system, now), u)
        kinetic, potential = energies(system, here)
        return {
            "places": {name: mbs.position(system, now, name) for name in names},
            "rotations": {name: mbs.rotation(system, now, name) for name in names},
            "velocities": {name: mbs.velocity(system, now, name) for name in names},
            "turning": {name: mbs.kinematics.angular_velocity(system, now, name) for name in names},
            "kinetic": kinetic,
            "potential": potential,
            "momenta": hamilton.momenta(system, here),
            "residual": mbs.constraints.constraint_residual(system, now),
        }

    along = (coordinate_rate(system.topology, state.coordinates, u), u_dot, jnp.ones_like(state.t))
    values, rates = jax.jvp(followed, (state.coordinates, u, state.t), along)
    return values | {
        "rate_of": rates,
        "u_dot": u_dot,
        "accelerations": {name: mbs.dynamics.acceleration(system, state, name, u_dot) for name in names},
        "angular_accelerations": {
            name: mbs.dynamics.angular_acceleration(system, state, name, u_dot) for name in names
        },
        "frames": {name: mbs.position(system, state, name) for name in system.topology.frame_names},
        "pull": mbs.constraints.constraint_jacobian(system, state).T @ multipliers,
        "powers": efforts(system, with_velocities(system, at, u))[2],
        "canonical": _rates(hamilton.canonical_rate(system, at, values["momenta"])),
        "loads": mbs.reactions(system, state),
    }


def _rates(found):
    """Rates and velocities."""
    return (*found[:3], found[3].u)


def _is_refused(system):
    """Whether the second form of the gyristor field has no answer: quaternions, rolling, drives."""
    return "ball" in system.topology.node_kind or system.topology.slip_rows or system.rows or system.paths


@probe
def fields(system, state):
    """The paper's fields, efforts and state equations."""
    at, p = at_state(system, state), dynamics.generalised_momentum(system, state)
    return {
        "Gamma": velocity_map(system, at)[0],
        "mass": mbs.mass_matrix(system, state),
        "kinetic": mbs.dynamics.kinetic_energy(system, state),
        "phi_dot": dynamics.independent_rates(system, state),
        "I_star": dynamics.inertia_field(system, state),
        "momentum": p,
        "GR": dynamics.gyristor_field(system, state),
        "direct": None if _is_refused(system) else dynamics.gyristor_field_direct(system, state),
        "state_equations": dynamics.state_equations(system, state),
        "independent": _rates(hamilton.independent_rate(system, at, p)),
        "canonical": _canonical(system, at, state.velocities),
        "e_S": dynamics.source_effort(system, state),
        "e_C": dynamics.compliance_effort(system, state),
        "e_R": dynamics.resistance_effort(system, state),
        "e_G": dynamics.gravity_effort(system, state),
        "total": dynamics.total_effort(system, state),
        "R": dynamics.resistance_field(system, state),
    }


def _canonical(system, at, u):
    """The rate of the paper's momenta Gamma^T P, and the velocities."""
    momenta = hamilton.momenta(system, with_velocities(system, at, u))
    psi_dot, rate, _, found = _rates(hamilton.canonical_rate(system, at, momenta))

    def seen(psi):
        return velocity_map(system, at_coordinates(system, at, psi))[0].T @ momenta

    return velocity_map(system, at)[0].T @ rate + jax.jvp(seen, (at.psi,), (psi_dot,))[1], found


@probe
def variations(system, state):
    """Slopes of Lagrangian, potential and momentum, which the fields are said to be."""
    at = at_state(system, state)
    Gamma, chosen = velocity_map(system, at)[0], first.independent_columns(system)
    phi_dot, u_dot = state.velocities[chosen], mbs.forward_dynamics(system, state)[0]

    def lagrangian(phi_dot):
        return mbs.dynamics.kinetic_energy(system, mbs.State(state.t, state.coordinates, Gamma @ phi_dot))

    def potential(at):
        return mbs.dynamics.potential_energy(system, mbs.State(at.t, at.psi, state.velocities))

    def inertia(at):
        return dynamics.inertia_field(system, mbs.State(at.t, at.psi, state.velocities))

    L, p = jax.value_and_grad(lagrangian)(phi_dot)
    turned = jnp.einsum("ijm,m,j->i", second.along_independent(system, at, inertia), phi_dot, phi_dot)
    return {
        "lagrangian": L,
        "momentum": p,
        "potential": second.along_independent(system, at, potential),
        "momentum_rate": inertia(at) @ u_dot[chosen] + turned,
    }


@probe
def bonds(system, state):
    """Powers and state equations of every view of the bond graph, and what they should be."""
    at, psi, u, t = at_state(system, state), state.coordinates, state.velocities, state.t
    along = (coordinate_rate(system.topology, psi, u), mbs.forward_dynamics(system, state)[0], jnp.ones_like(t))

    def energy(psi, u, t):
        at = with_velocities(system, at_state(system, mbs.State(t, psi, u)), u)
        return *energies(system, at), stored_energy(system, at)

    return {
        "powers": {view: mbs.bondgraph.bond_powers(system, state, view) for view in VIEWS},
        "equations": {view: graph_state_equations(system, state, view) for view in VIEWS},
        "energy_rates": jax.jvp(energy, (psi, u, t), along)[1],
        "of_elements": efforts(system, with_velocities(system, at, u))[2],
        "truth": _state_equations(system, state, at),
        "phi_dot": dynamics.independent_rates(system, state),
    }


def _state_equations(system, state, at):
    """(p_dot, phi_dot, q_dot) by the paper's state equations, or with drives by those that are integrated."""
    if not system.rows:
        return dynamics.state_equations(system, state)
    p = velocity_map(system, at)[0].T @ hamilton.momenta(system, with_velocities(system, at, state.velocities))
    _, p_dot, _, u = _rates(hamilton.independent_rate(system, at, p))
    return p_dot, u[first.independent_columns(system)], u[first.dependent_columns(system)]
