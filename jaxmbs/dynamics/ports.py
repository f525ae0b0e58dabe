"""The ports of the paper's 1-junction: compliance, resistance, gravity and source efforts on independent velocities.

`Q = Q* + e_C + e_R + e_G`, S2 (76) (printed with e_C twice; the second is e_G).
"""

import jax
import jax.numpy as jnp

from ..kinematics.kic import body_kic, velocity_map
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
    P, psi, t = node_parameters(system), state.coordinates, state.t
    geo = geometry(system, P, psi)
    F, Q, _ = efforts(system, geo, node_motion(system.topology, geo.S, u), psi, u, t)
    return dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, F))) + Q


@question
def compliance_effort(system: System, state):
    """e_C (N,) = -dV/dphi of all springs, `-sum K_i G_C^T dq_C`.  Source: S2 (56)-(59), (62)-(64)."""
    P, psi, t = node_parameters(system), state.coordinates, state.t

    def energy(delta):
        moved = psi + coordinate_rate(system.topology, psi, delta)
        return stored_energy(system, geometry(system, P, moved), moved, t)

    return -_gamma(system, state).T @ jax.grad(energy)(jnp.zeros_like(state.velocities))


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
    Gamma = _gamma(system, state)
    slope = jax.jacfwd(lambda u: _element_efforts(system, state, u))(state.velocities)
    return -Gamma.T @ slope @ Gamma


@question
def gravity_effort(system: System, state):
    """e_G (N,) = `sum m_k G_t^T g`.  Source: S2 (75)."""
    P, psi = node_parameters(system), state.coordinates
    G = body_kic(system, P, psi, state.t)
    effort = jnp.einsum("b,bcn,c->n", system.mass, G[:, 3:], system.gravity)
    if not system.elastic:
        return effort
    geo = geometry(system, P, psi)
    loads = gravity_loads(system, geo, psi)
    carried = dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, loads.wrench)))
    return effort + _gamma(system, state).T @ (carried + loads.column)


@question
def source_effort(system: System, state):
    """Q* (N,): what the elements exert at rest beside their stored energy: loads, motors.  Source: S2 (76)."""
    at_rest = _element_efforts(system, state, jnp.zeros_like(state.velocities))
    return _gamma(system, state).T @ at_rest - compliance_effort(system, state)


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
