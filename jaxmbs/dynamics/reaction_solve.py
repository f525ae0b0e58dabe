"""Reactions of every joint: subtree sums on trees, multipliers in loops, compliances where statics cannot decide.

Source: S1 (26)-(29); the wrench a joint carries is the momentum rate of all that hangs on it, less other loads.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import known, no_such
from ..errors import UnknownNameError
from ..kinematics import closures, constraints, coordinate_rows, reaction_map
from ..kinematics.configuration import configuration, moving, node_accelerations
from ..kinematics.owners import single_bodies
from ..kinematics.poses import node_parameters
from ..kinematics.state import HasStates, State
from ..math.host import typed
from ..math.jit import jit
from ..math.linalg import relative
from ..math.rows import over_rows, summed, take
from ..model.question import rates_of, states_of
from ..model.system import System
from ..typing import ArrayLike
from .actuation import actuated_columns, balanced, needed
from .bodies import needed_loads
from .distribution import distributed
from .efforts import efforts
from .joint_reactions import JointReaction, Reactions
from .joint_wrenches import at_frames, joint_wrenches
from .loads import Loads
from .named_loads import law_forces, row_loads
from .newton_euler import accelerations
from .sparse_saddle import constraint_rows
from .undriven import undriven

_BALANCED = {8: 1e-6, 4: 1e-2}  # of the largest load: what may be left over
#: Velocities times states whose loads take milliseconds however they are compiled: quickly, which saves a second.
_FEW = 1000


def _reactions(system: System, P, state: State, a, options: "_Options") -> Reactions:
    owners, acting = single_bodies(system), []
    at = moving(system, configuration(system, P, state.coordinates, state.t), state.velocities)
    F, Q, _ = efforts(system, at, owners, acting)
    on_nodes = (_on_nodes(system.topology, F), Q)
    system, a, multipliers, gaps, given, known = _balance(system, at, a, on_nodes, options)
    top = system.topology
    V_dot = node_accelerations(top, at, a)
    lack = needed_loads(system, at, V_dot, a, owners) - Loads(F)
    wrench, effort = joint_wrenches(system, at.S, lack.wrench, multipliers, known)
    if top.analysis is not None and top.analysis.redundant:
        multipliers = distributed(system, at, wrench, multipliers, options.compliance, known, options.method)
        wrench, effort = joint_wrenches(system, at.S, lack.wrench, multipliers, known)
    gap = (lack + Loads(column=effort - Q - given)).column - coordinate_rows.efforts(
        system, at.psi, at.t, multipliers
    )
    residual = jnp.max(jnp.abs(gap), initial=0.0)
    hidden = tuple(joint.name for joint in top.joints if joint.is_hidden)
    size = jnp.max(jnp.abs(multipliers), initial=0.0) + jnp.max(jnp.abs(wrench), initial=0.0)
    least = _BALANCED[residual.dtype.itemsize]
    rate = _loads_over_mass(system, wrench, effort)
    missed = _missed(system, constraint_rows(system, at, known), V_dot, a, gaps, rate)
    # 1e-3 N: a mechanism at rest without loads has nothing to measure its residual by
    balanced = (residual <= least * (size + 1e-3)) & (missed <= least)  # false for NaN
    named, laws = _named(system, wrench, effort, at, options), law_forces(system, acting)
    return Reactions(
        named,
        multipliers,
        lax.stop_gradient(residual),
        state.ok & balanced,
        hidden,
        laws,
        row_loads(system, at, multipliers),
    )


class _Options(NamedTuple):
    """What `reactions` is asked; `columns` of the actuators, None where the drives do it."""

    frame: str
    side: str
    compliance: dict
    method: str
    columns: tuple | None


def _balance(system, at, a, loads, options):
    """What balances the accelerations a (nv,), None: those of the system itself: the drives, or actuators instead.

    Returns: the system whose rows carry, accelerations, multipliers (rows,), gaps (rows,) of the accelerations,
    efforts (nv,) of the actuators, and `closures.directions`.
    """
    directions = closures.moving_directions(system, at)
    if a is None:
        a, multipliers, gaps = accelerations(system, at, options.method, loads, directions)
        if options.columns is None:
            return system, a, multipliers, gaps, jnp.zeros_like(at.u), directions[0]
    released = undriven(system)
    if released is not system:
        directions = closures.moving_directions(released, at)
    found = balanced(released, at, needed(released, at, a, loads), options.columns)
    rest = node_accelerations(released.topology, at, jnp.zeros_like(at.u))
    gamma = constraints.acceleration_bias(released, at, rest, directions)
    gaps = constraints.jacobian(released, at, directions[0]) @ a - gamma
    return released, a, found.multipliers, gaps, found.columns, directions[0]


def _on_nodes(topology, wrenches):
    """Wrenches of bodies (bodies, 6) on the nodes that carry them."""
    return summed(wrenches, np.asarray(topology.body_node, int) % (topology.nodes.size + 1), topology.nodes.size)


def _loads_over_mass(system, wrench, effort):
    """What the loads of the joints would do to the heaviest body [rad/s^2 and lengths/s^2]: at rest, where every
    acceleration is rounding, the rows' gaps are measured by it."""
    top, length = system.topology, system.length
    force = jnp.max(jnp.abs(wrench[:, 3:]), initial=0.0)
    force = force + jnp.max(jnp.abs(effort) / jnp.where(np.asarray(top.spins) > 0, length, 1.0), initial=0.0)
    heaviest = jnp.maximum(jnp.max(system.mass, initial=0.0), jnp.finfo(force.dtype).tiny)
    return (jnp.sqrt(jnp.sum(system.gravity**2)) + force / heaviest) / length


def _missed(system, rows, V_dot, a, gaps, rate):
    """The largest of the gaps (rows,) of the rows' accelerations, of `rate` and the largest that adds up in them."""
    if not system.has_constraints:
        return jnp.zeros_like(rows.at.t)
    return relative(rows.unit * gaps, rows.sizes(V_dot, a) + lax.stop_gradient(rate))


def _named(system, wrench, effort, at, options):
    """`JointReaction` by name from the wrenches (carriers, 6): of joints and of two-frame constraints."""
    top, (sign, end) = system.topology, (1.0, 1) if options.side == "child" else (-1.0, 0)
    carriers = reaction_map.carriers(system)
    efforts = [effort[j.velocities] for j in top.joints] + [jnp.zeros(0)] * (len(carriers) - len(top.joints))
    marks = top.analysis.undetermined if top.analysis else [(False,) * 6] * len(carriers)
    own = [c[1 + end] for c in carriers]
    force, moment = at_frames(wrench, take(at.R, own), take(at.x, own), options.frame, sign)
    return {name: JointReaction(force[i], moment[i], efforts[i], marks[i]) for i, (name, *_) in enumerate(carriers)}


def _along(system, states, accelerations, batched, options):
    """`_reactions` of a state, or of every one of a batch."""
    P = node_parameters(system)
    one = lambda row: _reactions(system, P, *row, options)  # noqa: E731
    return over_rows(one, (states, accelerations)) if batched else one((states, accelerations))


_along_few, _along_many = jit(_along, compile="quick"), jit(_along)


def _compliance(name, value, dtype):
    """The compliances (6,) of one joint; ValueError where they are known and negative, not finite, or not six."""
    value = typed(value, dtype)
    if value.shape not in ((), (6,)):
        raise ValueError(f"compliance of {name!r} must be one number or six, got shape {value.shape}")
    if known(value) and not np.all(np.isfinite(value) & (np.asarray(value) >= 0.0)):
        raise ValueError(f"compliance of {name!r} must be finite and not negative, got {np.asarray(value)}")
    return value


def reactions(
    system: System,
    motion: State | HasStates,
    frame: str = "world",
    side: str = "child",
    compliance: Mapping | None = None,
    method: str = "dense",
    accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None,
    actuators: Sequence[str] | None = None,
) -> Reactions:
    """Reactions of all joints at a state or along a motion.

    Args:
        motion: a State, a Motion, or a State with one leading axis.
        frame: "world" axes, or "joint": those of the joint's frame on that side.
        side: "child": the wrench the parent applies on the child; "parent": the opposite one on the parent.
        compliance: name -> (6,), of joints and two-frame constraints for force x, y, z [m/N] and moment x, y, z
            [rad/(N m)] in their own axes on the child's side; default 1 and 1 / length^2 for those not named.
        method: how loops and drives are solved, with equal results: "dense" in the tree's velocities, or
            "block-sparse" on the graph of bodies, linear in their number.
        accelerations: (nv,) along a given trajectory, with the states' leading axis if they have one, or by joint;
            default those that the drives and force elements make.
        actuators: joints whose efforts keep the motion, in place of all drives and frame paths, see
            `inverse_dynamics`; default the drives, or every joint of the tree where accelerations are given.

    Returns: Reactions by joint name, and of two-frame constraints by theirs (on frame B, or A for the parent side).

    Of few states (velocities times states up to 1 000) its program is compiled quickly and takes milliseconds: in
    loops of thousands of calls put it into `mbs.jit`.

    Redundant loops: components that statics cannot determine have `unique_force` or `unique_moment` False.  They are
    shared so that the complementary energy `1/2 sum w.C w` of the compliances is least; by default that is the least
    norm, moments over the system's characteristic length `system.length`.

    Raises: ValueError for an unknown frame, side, method or name, and accelerations of another shape; ModelError for
    an actuator without freedom.  Source: S1 (26)-(29).
    """
    if frame not in ("world", "joint") or side not in ("child", "parent"):
        raise ValueError(f"frame must be 'world' or 'joint' and side 'child' or 'parent', got {frame!r}, {side!r}")
    if method not in ("dense", "block-sparse"):
        raise ValueError(f"method must be 'dense' or 'block-sparse', got {method!r}")
    states = states_of(system, motion)
    compliance = {} if compliance is None else dict(compliance)
    names = [name for name, *_ in reaction_map.carriers(system)]
    for name in compliance:
        if name not in names:
            raise UnknownNameError(f"compliance: {no_such('joint or constraint', name, names)}")
    compliance = {name: _compliance(name, c, states.coordinates.dtype) for name, c in compliance.items()}
    if accelerations is not None:
        accelerations = typed(rates_of(system, states, accelerations, "accelerations"), states.coordinates.dtype)
        every = [name for name, *_ in system.topology.structure]
        actuators = every if actuators is None else actuators
    columns = None if actuators is None else actuated_columns(system, actuators)
    options = _Options(frame, side, compliance, method, columns)
    along = _along_few if states.velocities.size <= _FEW else _along_many
    return along(system, states, accelerations, states.coordinates.ndim == 2, options)
