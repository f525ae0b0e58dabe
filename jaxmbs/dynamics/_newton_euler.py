"""Newton-Euler on the tree: accelerations to efforts and back, O(nodes) for trees.

Source: S2 (28)-(29) body by body, `h_dot = wrench` about the world origin.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..assembly._state import State
from ..checks import is_concrete
from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._linear_solver import linear_solver
from ..constraints._saddle_operator import constraint_operator
from ..errors import ModelError
from ..kinematics._configuration import VelocityKinematics, at_state, node_accelerations, with_velocities
from ..kinematics._elastic import mass_matrix as inertia_matrix
from ..kinematics._tree import solve
from ..kinematics._wrench_targets import WrenchTargets, node_targets
from ..math._linalg import saddle_solve
from ..model._entry_points import state_function
from ..model._system import System
from ._bodies import inverse_dynamics_loads
from ._efforts import efforts
from ._joint_friction import FrictionSolution, friction_loads, friction_of_motion
from ._loads import Loads, on_columns
from ._saddle import saddle_without_matrix


def required_efforts(system: System, at: VelocityKinematics, V_dot, u_dot, loads):
    """Efforts (nv,) that twist rates V_dot and accelerations u_dot of the tree require beside gravity and the loads
    of its force elements, which are given on nodes (nodes, 6) and columns (nv,)."""
    F, Q = loads
    return (
        on_columns(system, at, inverse_dynamics_loads(system, at, V_dot, u_dot, node_targets(system)) - Loads(F)) - Q
    )


class Bias(NamedTuple):
    """Twist rates (nodes, 6) at zero accelerations, and the loads on nodes and columns that they require beside
    gravity."""

    V_dot: Array
    loads: Loads


def accelerations(system: System, at: VelocityKinematics, method=None, loads=None, bias: Bias | None = None):
    """Accelerations u_dot (nv,), multipliers (rows,) and gaps (rows,) of the rows.

    They satisfy `M u_dot + bias - Q = A^T lambda`; the gaps `A u_dot - gamma` are rounding where the rows are
    regular.

    Args:
        method: of `linear_solver`, by default the one of the system.
        loads: of the force elements on nodes and columns, where they are evaluated already; bias: likewise.
    """
    if system.friction is not None:
        found = motion_with_friction(system, at, method, loads, bias=bias)
        return found.accelerations, found.multipliers, found.gaps
    if system.is_rigid_tree:
        need = saddle_sides(system, at, loads, bias)[0]
        return solve(system.topology.nodes, at.S, at.J, need), *jnp.zeros((2, 0), at.psi.dtype)
    at = closures.with_rates(system, at)
    need, gamma = saddle_sides(system, at, loads, bias)
    method = linear_solver(system) if method is None else method
    if method != "dense":
        rows = constraint_operator(system, at)
        a, y = saddle_without_matrix(method, system, at, rows, need, gamma)
        return a, -y, rows.rates(a) / rows.unit - gamma
    A = constraints.jacobian(system, at)
    a, y = saddle_solve(inertia_matrix(system, at), A, need, gamma, constraints.row_scale(system))
    return a, -y, A @ a - gamma


def motion_with_friction(
    system: System, at: VelocityKinematics, method=None, loads=None, compliance=None, bias: Bias | None = None
) -> FrictionSolution:
    """Accelerations as those of `accelerations`, of a system whose joints rub, with the loads of the joints."""
    at = closures.with_rates(system, at)
    need, gamma, lack = _sides_and_lack(system, at, loads, bias)
    if system.is_rigid_tree:
        nodes, none = system.topology.nodes, jnp.zeros(0, need.dtype)

        def along(b, c):
            return jax.vmap(lambda b: solve(nodes, at.S, at.J, b))(b), c

        return friction_of_motion(system, at, lack, need, none, along)._replace(gaps=none)
    along, rates = saddle_solver(system, at, method)
    solution = friction_of_motion(system, at, lack, need, gamma, along, compliance)
    return solution._replace(gaps=rates(solution.accelerations) - gamma)


def saddle_solver(system: System, at: VelocityKinematics, method=None):
    """A function from efforts (k, nv) and rates of the rows (k, rows) to accelerations and multipliers of the same
    shapes, by one factor; and the rates of the rows of accelerations (nv,)."""
    method = linear_solver(system) if method is None else method
    if method == "dense":
        A, M, scale = constraints.jacobian(system, at), inertia_matrix(system, at), constraints.row_scale(system)

        def of_matrices(b, c):
            a, y = saddle_solve(M, A, b.T, c.T, scale)
            return a.T, -y.T

        return of_matrices, lambda a: A @ a
    rows = constraint_operator(system, at)

    def without_matrix(b, c):
        a, y = jax.vmap(lambda b, c: saddle_without_matrix(method, system, at, rows, b, c))(b, c)
        return a, -y

    return without_matrix, lambda a: rows.rates(a) / rows.unit


def all_efforts(system: System, at: VelocityKinematics):
    """Loads on nodes (nodes, 6) and columns (nv,) and powers of force elements, elastic bodies and friction."""
    F, Q, powers = efforts(system, at)
    if system.friction is None:
        return F, Q, powers
    found = motion_with_friction(system, at, loads=(F, Q))
    loads = Loads(F, Q) + friction_loads(system, found, node_targets(system))
    return loads.wrench, loads.column, jnp.concatenate([powers, found.powers])


def saddle_sides(system: System, at: VelocityKinematics, loads=None, bias: Bias | None = None):
    """Right-hand sides of the saddle system: efforts (nv,) less bias at zero accelerations, and gamma (rows,), None
    for a tree of rigid bodies."""
    return _sides_and_lack(system, at, loads, bias)[:2]


def bias_on(system: System, at: VelocityKinematics, owners: WrenchTargets) -> Bias:
    """The bias, its loads on owners."""
    none = jnp.zeros_like(at.u)
    V_dot = node_accelerations(system.topology, at, none)
    return Bias(V_dot, inverse_dynamics_loads(system, at, V_dot, none, owners))


def _sides_and_lack(system, at, loads=None, bias=None):
    """`saddle_sides`, and what the nodes need (nodes, 6) beside force elements and gravity at zero accelerations."""
    V_dot, own = bias_on(system, at, node_targets(system)) if bias is None else bias
    F, Q = efforts(system, at)[:2] if loads is None else loads
    lack = own - Loads(F)
    gamma = None if system.is_rigid_tree else constraints.acceleration_bias(system, at, V_dot)
    return Q - on_columns(system, at, lack), gamma, lack.wrench


def _velocity_kinematics(system, state):
    return with_velocities(system, at_state(system, state), state.velocities)


@state_function
def _forward_dynamics(system, state):
    at = _velocity_kinematics(system, state)
    if system.friction is None:
        return *accelerations(system, at)[:2], None
    found = motion_with_friction(system, at)
    return found.accelerations, found.multipliers, found.loads.unique


def forward_dynamics(system: System, state: State) -> tuple[Float[Array, "... nv"], Float[Array, "... rows"]]:
    """Accelerations and constraint multipliers of a state.

    Returns: u_dot (nv,) [m/s^2 or rad/s^2] and lambda (rows,), the efforts along the constraint rows: `A^T lambda`
    acts on the velocities.  Redundant rows share their load (see `reactions` for the least-norm choice).
    Where the friction of joints jams they are NaN in traced code.

    Raises: ModelError where a joint jams, with its name.  Source: S2 (28)-(29), (40) solved for accelerations.
    """
    a, multipliers, unique = _forward_dynamics(system, state)
    if unique is not None and is_concrete(unique) and not np.all(np.asarray(unique)):
        raise ModelError([jam_of(system)], "the state")
    return a, multipliers


def jam_of(system: System) -> str:
    """A sentence about joints that jam."""
    names = ", ".join(repr(system.topology.joints[j].name) for j in dict.fromkeys(system.joint_friction.joints))
    return (
        f"the friction of the joints {names} has no unique loads here: the mechanism jams; "
        "dynamics.joint_friction says at which of them, reduce mu, or give the bearing more length"
    )


@state_function
def mass_matrix(system: System, state: State) -> Float[Array, "nv nv"]:
    """Mass matrix (nv, nv) of the tree of rigid and elastic bodies, all loops cut.

    Source: S2 (35) with every coordinate independent.
    """
    return inertia_matrix(system, at_state(system, state))
