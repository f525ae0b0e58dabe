"""The ports of the paper's 1-junction: compliance, resistance, gravity and source efforts on independent velocities.

`Q = Q* + e_C + e_R + e_G`, S2 (76) (printed with e_C twice; the second is e_G).
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..kinematics.configuration import Configuration, Moving, at_state, elsewhere, moving, resting
from ..kinematics.influence import velocity_map
from ..kinematics.points import jacobian, locate, position
from ..kinematics.poses import coordinate_rate
from ..kinematics.state import State
from ..model.question import question
from ..model.system import System
from .bodies import bodies_of, total
from .efforts import efforts, stored_energy
from .loads import Loads, on_columns


def _gamma(system, state):
    return velocity_map(system, at_state(system, state, inertias=False))[0]


def _of_elements(system, at):
    """Efforts (nv,) of all force elements, without gravity."""
    F, Q, _ = efforts(system, at)
    return on_columns(system, at, Loads(F, Q))


def _moving(system, state):
    return moving(system, at_state(system, state, inertias=False), state.velocities)


def efforts_at_rest(system: System, at: Configuration):
    """(e_C, e_G, Q*), each (N,): `compliance_effort`, `gravity_effort` and `source_effort` in one walk."""
    Gamma = velocity_map(system, at)[0]
    stored = -Gamma.T @ _energy_slope(system, at)
    elements = Gamma.T @ _of_elements(system, resting(system, at))
    return stored, _of_gravity(system, at, Gamma), elements - stored


def _energy_slope(system, at):
    """Slope (nv,) of the stored energy by displacements of all columns."""

    def energy(delta):
        return stored_energy(system, elsewhere(system, at, at.psi + coordinate_rate(system.topology, at.psi, delta)))

    return jax.grad(energy)(jnp.zeros(system.topology.num_velocities, at.psi.dtype))


def _of_gravity(system, at, Gamma):
    return total(bodies.weight(system, at, Gamma) for bodies in bodies_of(system))


@question
def compliance_effort(system: System, state: State) -> Float[Array, " N"]:
    """e_C (N,) = -dV/dphi of all springs, `-sum K_i G_C^T dq_C`.  Source: S2 (56)-(59), (62)-(64)."""
    return efforts_at_rest(system, at_state(system, state, inertias=False))[0]


@question
def resistance_effort(system: System, state: State) -> Float[Array, " N"]:
    """e_R (N,): the part of the elements' efforts that the velocities make, `-R phi_dot` for dampers.

    Source: S2 (72)-(73), on the system (72 prints the effort into the element).
    """
    at = _moving(system, state)
    made = _of_elements(system, at) - _of_elements(system, resting(system, at))
    return velocity_map(system, at)[0].T @ made


@question
def resistance_field(system: System, state: State) -> Float[Array, "N N"]:
    """R (N, N) = `sum R_i G_R^T G_R`, the derivative of -e_R by phi_dot.  Source: S2 (74)."""
    at = at_state(system, state, inertias=False)
    return resistance(system, at, velocity_map(system, at)[0], state.velocities)


def resistance(system: System, at: Configuration, Gamma, u):
    """`resistance_field` at velocities u (nv,), with Gamma (nv, N) of `velocity_map`."""
    return -Gamma.T @ jax.jacfwd(lambda u: _of_elements(system, moving(system, at, u)))(u) @ Gamma


@question
def gravity_effort(system: System, state: State) -> Float[Array, " N"]:
    """e_G (N,) = `sum m_k G_t^T g`.  Source: S2 (75)."""
    return efforts_at_rest(system, at_state(system, state, inertias=False))[1]


@question
def source_effort(system: System, state: State) -> Float[Array, " N"]:
    """Q* (N,): what the elements exert at rest beside their stored energy: loads, motors.  Source: S2 (76)."""
    return efforts_at_rest(system, at_state(system, state, inertias=False))[2]


@question
def total_effort(system: System, state: State) -> Float[Array, " N"]:
    """Q (N,) = `Q* + e_C + e_R + e_G` on the independent velocities.  Source: S2 (76)."""
    at = _moving(system, state)
    return effort_along(system, at, velocity_map(system, at)[0])


def effort_along(system: System, at: Moving, Gamma):
    """`total_effort` with Gamma (nv, N) of `velocity_map`."""
    return Gamma.T @ _of_elements(system, at) + _of_gravity(system, at, Gamma)


def spring_vector(system: System, state, frame_a, frame_b):
    """q_C (3,) from A to B and `G_hat = d q_C / dphi` (3, N), world axes.  Source: S2 (60)-(61)."""
    for frame in (frame_a, frame_b):
        locate(system, frame)
    ends = [jacobian(system, state, frame)[:3] for frame in (frame_a, frame_b)]
    q_C = position(system, state, frame_b) - position(system, state, frame_a)
    return q_C, (ends[1] - ends[0]) @ _gamma(system, state)
