"""The ports of the paper's 1-junction: compliance, resistance, gravity and source efforts on independent velocities.

`Q = Q* + e_C + e_R + e_G`, S2 (76) (printed with e_C twice; the second is e_G).
"""

import jax
import jax.numpy as jnp

from ..kinematics.influence import body_kic_at, velocity_map, velocity_map_at
from ..kinematics.points import jacobian, locate, position
from ..kinematics.poses import coordinate_rate, geometry, node_parameters
from ..kinematics.tree import subtrees
from ..math.spatial import dot, unpack
from ..model.question import question
from ..model.system import System
from .efforts import efforts, stored_energy
from .elastic import gravity_loads
from .newton_euler import node_motion


def _gamma(system, state):
    return velocity_map(system, node_parameters(system), state.coordinates, state.t)[0]


def _element_efforts(system, state, u):
    """Efforts (nv,) of all force elements at velocities u, without gravity."""
    geo = geometry(system, node_parameters(system), state.coordinates)
    return _element_efforts_at(system, geo, state.coordinates, u, state.t)


def _element_efforts_at(system, geo, psi, u, t):
    F, Q, _ = efforts(system, geo, node_motion(system.topology, geo.S, u), psi, u, t)
    return dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, F))) + Q


def efforts_at_rest(system: System, P, psi, t):
    """(e_C, e_G, Q*), each (N,): `compliance_effort`, `gravity_effort` and `source_effort` in one walk."""
    geo = geometry(system, P, psi)
    Gamma, rest = velocity_map_at(system, geo, psi, t)[0], jnp.zeros(system.topology.num_velocities, psi.dtype)
    stored = -Gamma.T @ _energy_slope(system, P, psi, t)
    elements = Gamma.T @ _element_efforts_at(system, geo, psi, rest, t)
    return stored, _gravity_at(system, geo, Gamma, psi), elements - stored


def _energy_slope(system, P, psi, t):
    """Slope (nv,) of the stored energy by displacements of all columns."""

    def energy(delta):
        moved = psi + coordinate_rate(system.topology, psi, delta)
        return stored_energy(system, geometry(system, P, moved), moved, t)

    return jax.grad(energy)(jnp.zeros(system.topology.num_velocities, psi.dtype))


def _gravity_at(system, geo, Gamma, psi):
    effort = jnp.einsum("b,bcn,c->n", system.mass, body_kic_at(system, geo, Gamma)[:, 3:], system.gravity)
    if not system.elastic:
        return effort
    loads = gravity_loads(system, geo, psi)
    carried = dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, loads.wrench)))
    return effort + Gamma.T @ (carried + loads.column)


@question
def compliance_effort(system: System, state):
    """e_C (N,) = -dV/dphi of all springs, `-sum K_i G_C^T dq_C`.  Source: S2 (56)-(59), (62)-(64)."""
    return efforts_at_rest(system, node_parameters(system), state.coordinates, state.t)[0]


@question
def resistance_effort(system: System, state):
    """e_R (N,): the part of the elements' efforts that the velocities make, `-R phi_dot` for dampers.

    Source: S2 (72)-(73), on the system (72 prints the effort into the element).
    """
    moving = _element_efforts(system, state, state.velocities)
    return _gamma(system, state).T @ (moving - _element_efforts(system, state, jnp.zeros_like(state.velocities)))


@question
def resistance_field(system: System, state):
    """R (N, N) = `sum R_i G_R^T G_R`, the derivative of -e_R by phi_dot.  Source: S2 (74)."""
    geo = geometry(system, node_parameters(system), state.coordinates)
    return resistance_at(system, geo, velocity_map_at(system, geo, state.coordinates, state.t)[0], state)


def resistance_at(system: System, geo, Gamma, state):
    """`resistance_field` at known geometry and velocity map (nv, N)."""
    psi, t = state.coordinates, state.t
    return -Gamma.T @ jax.jacfwd(lambda u: _element_efforts_at(system, geo, psi, u, t))(state.velocities) @ Gamma


@question
def gravity_effort(system: System, state):
    """e_G (N,) = `sum m_k G_t^T g`.  Source: S2 (75)."""
    return efforts_at_rest(system, node_parameters(system), state.coordinates, state.t)[1]


@question
def source_effort(system: System, state):
    """Q* (N,): what the elements exert at rest beside their stored energy: loads, motors.  Source: S2 (76)."""
    return efforts_at_rest(system, node_parameters(system), state.coordinates, state.t)[2]


@question
def total_effort(system: System, state):
    """Q (N,) = `Q* + e_C + e_R + e_G` on the independent velocities.  Source: S2 (76)."""
    elements = _gamma(system, state).T @ _element_efforts(system, state, state.velocities)
    return elements + gravity_effort(system, state)


def spring_vector(system: System, state, frame_a, frame_b):
    """q_C (3,) from A to B and `G_hat = d q_C / dphi` (3, N), world axes.  Source: S2 (60)-(61)."""
    for frame in (frame_a, frame_b):
        locate(system, frame)
    ends = [jacobian(system, state, frame)[3:] for frame in (frame_a, frame_b)]
    q_C = position(system, state, frame_b) - position(system, state, frame_a)
    return q_C, (ends[1] - ends[0]) @ _gamma(system, state)
