"""The ports of the paper's 1-junction: compliance, resistance, gravity and source efforts on independent velocities.

`Q = Q* + e_C + e_R + e_G`, S2 (76) (printed with e_C twice; the second is e_G).
"""

import jax
from jaxtyping import Array, Float

from ...assembly._state import State
from ...constraints._kic import velocity_map
from ...constraints._mobility import independent_state_function
from ...friction._joint_friction import refuse_friction
from ...kinematics._configuration import Configuration, VelocityKinematics, at_rest, at_state, with_velocities
from ...model._system import System
from .._bodies import bodies_of, total
from .._conservative_efforts import conservative_efforts, source_efforts
from .._efforts import efforts
from .._loads import Loads, on_columns


def _configuration_and_map(system, state):
    """The configuration of a state, and Gamma (nv, N) of `velocity_map`."""
    at = at_state(system, state, inertias=False)
    return at, velocity_map(system, at)[0]


def _element_efforts(system, at):
    """Efforts (nv,) of all force elements, without gravity."""
    refuse_friction(system, "the efforts of the paper", "it has no friction fed by reactions; see forward_dynamics")
    F, Q, _ = efforts(system, at)
    return on_columns(system, at, Loads(F, Q))


def projected_gravity_effort(system: System, at: Configuration, Gamma):
    """`gravity_effort` with Gamma (nv, N) of `velocity_map`."""
    return total(bodies.weight(system, at, Gamma) for bodies in bodies_of(system))


@independent_state_function
def compliance_effort(system: System, state: State) -> Float[Array, " N"]:
    """e_C (N,) = -dV/dphi of all springs, `-sum K_i G_C^T dq_C`.  Source: S2 (56)-(59), (62)-(64), (67)."""
    at, Gamma = _configuration_and_map(system, state)
    return Gamma.T @ conservative_efforts(system, at)(at)


@independent_state_function
def resistance_effort(system: System, state: State) -> Float[Array, " N"]:
    """e_R (N,): the part of the elements' efforts that the velocities make, `-R phi_dot` for dampers.

    Source: S2 (72)-(73), on the system (72 prints the effort into the element).
    """
    at, Gamma = _configuration_and_map(system, state)
    at = with_velocities(system, at, state.velocities)
    return Gamma.T @ (_element_efforts(system, at) - _element_efforts(system, at_rest(system, at)))


@independent_state_function
def resistance_field(system: System, state: State) -> Float[Array, "N N"]:
    """R (N, N) = `sum G_R^T R_i G_R`, the derivative of -e_R by phi_dot; as unsymmetric as the elements are.

    Source: S2 (74).
    """
    at, Gamma = _configuration_and_map(system, state)
    return projected_resistance_field(system, at, Gamma, state.velocities)


def projected_resistance_field(system: System, at: Configuration, Gamma, u):
    """`resistance_field` at velocities u (nv,), with Gamma (nv, N) of `velocity_map`."""
    return -Gamma.T @ jax.jacfwd(lambda u: _element_efforts(system, with_velocities(system, at, u)))(u) @ Gamma


@independent_state_function
def gravity_effort(system: System, state: State) -> Float[Array, " N"]:
    """e_G (N,) = `sum m_k G_t^T g`.  Source: S2 (75)."""
    return projected_gravity_effort(system, *_configuration_and_map(system, state))


@independent_state_function
def source_effort(system: System, state: State) -> Float[Array, " N"]:
    """Q* (N,): what the elements exert at rest beside their stored energy: loads, motors.  Source: S2 (76)."""
    at, Gamma = _configuration_and_map(system, state)
    return Gamma.T @ source_efforts(system, at)


@independent_state_function
def total_effort(system: System, state: State) -> Float[Array, " N"]:
    """Q (N,) = `Q* + e_C + e_R + e_G` on the independent velocities.  Source: S2 (76)."""
    at, Gamma = _configuration_and_map(system, state)
    return projected_total_effort(system, with_velocities(system, at, state.velocities), Gamma)


def projected_total_effort(system: System, at: VelocityKinematics, Gamma):
    """`total_effort` with Gamma (nv, N) of `velocity_map`."""
    return Gamma.T @ _element_efforts(system, at) + projected_gravity_effort(system, at, Gamma)
