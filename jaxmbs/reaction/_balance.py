"""The balance of a mechanism at a state, and the reactions that it gives: what `reactions` traces.

Source: S1 (26)-(29); the wrench that a joint carries is the momentum rate of its subtree less the other loads on it.
"""

import functools
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..assembly._state import State
from ..constraints import _closures as closures
from ..constraints import _reaction_map as reaction_map
from ..constraints import _rows as rows
from ..constraints._joint_wrenches import joint_wrenches, wrenches_at_frames
from ..dynamics._bodies import acceleration_loads
from ..dynamics._distribution import least_compliance_reactions
from ..dynamics._efforts import efforts
from ..dynamics._joint_friction import FrictionSolution, cut_friction, friction_loads
from ..dynamics._loads import Loads
from ..dynamics._newton_euler import accelerations, bias_on, motion_with_friction
from ..dynamics._validity import has_ends, validity_at
from ..kinematics._configuration import VelocityKinematics, configuration, with_velocities
from ..kinematics._tree import ancestors
from ..kinematics._wrench_targets import body_targets
from ..math._spatial import scale
from ..model._system import System
from ..runtime import gather_static, segment_sum_static
from ._determinacy import joint_determinacy
from ._inverse_dynamics import balance_with_friction, tree_efforts
from ._named_loads import drive_loads, law_forces, row_loads
from ._result import JointReactions, Reactions
from ._row_residuals import ROUNDING_TOLERANCE, relative_row_residual, row_residuals
from ._self_stress import SaddleSolution, self_stresses, sparse_saddle_with_stresses
from ._without_drives import without_drives


def reactions_at(system: System, P: Array, state: State, a: Array | None, options: Any) -> Reactions:
    """The reactions at one state.

    Args: P: parameters of the tree; a: accelerations (nv,), None for those of the system itself; options: of
    `reactions`.
    """
    owners, acting = body_targets(system), []
    at = configuration(system, P, state.coordinates, state.t, internal=state.internal)
    at = with_velocities(system, at, state.velocities)
    F, Q, _ = efforts(system, at, owners, acting)
    still = bias_on(system, at, owners)
    bias = still._replace(loads=Loads(_on_nodes(system.topology, still.loads.wrench), still.loads.column))
    solved = _balance(system, at, a, (_on_nodes(system.topology, F), Q), bias, options)
    (system, at, (a, multipliers, gaps, stresses), given, friction), driven = solved, system
    top = system.topology
    moved = ancestors(top.nodes, scale(at.S, a))
    V_dot = still.V_dot + moved
    if friction is not None:
        rub = friction_loads(system, friction, owners)
        F, Q = F + rub.wrench, Q + rub.column
    lack = still.loads + acceleration_loads(system, at, a, owners, moved) - Loads(F)
    wrench, effort = _joint_wrenches(system, at, lack.wrench, multipliers, friction)
    if _needs_distribution(system, options.compliance):
        multipliers = least_compliance_reactions(system, at, wrench, multipliers, options.compliance, options.method)
        wrench, effort = _joint_wrenches(system, at, lack.wrench, multipliers, friction)
    inside = rows.column_efforts(system, rows.slopes(system, at), multipliers)
    gap = (lack + Loads(column=effort - Q - given)).column - inside
    residual = jnp.max(jnp.abs(gap), initial=0.0)
    size = jnp.max(jnp.abs(multipliers), initial=0.0) + jnp.max(jnp.abs(wrench), initial=0.0)
    least = ROUNDING_TOLERANCE[residual.dtype.itemsize]
    missed = relative_row_residual(system, at, a, V_dot, gaps, (wrench, effort, Q))
    # an absolute floor of 1e-3 N (1e-3 N m): a mechanism at rest without loads has no load to measure its residual by
    balanced = (residual <= least * (size + 1e-3)) & (missed <= least)  # false for NaN
    drives = drive_loads(system, multipliers, stresses, options.actuators(driven), given)
    placed = functools.partial(_wrenches_in_frames, system, at, options)
    marks = joint_determinacy(system, at, stresses[:, : top.num_rows], placed)
    return Reactions(
        _joint_reactions(system, placed(wrench), effort, drives, marks),
        multipliers,
        lax.stop_gradient(residual),
        state.ok & balanced,
        tuple(joint.name for joint in top.joints if joint.is_hidden),
        law_forces(system, acting),
        row_loads(system, at, multipliers, stresses),
        drives,
        options.frame,
        options.side,
        state.t,
        validity_at(system, at, multipliers) if has_ends(system) else None,
    )


class _Balance(NamedTuple):
    """The system whose rows carry, its configuration with the rows' directions, its solution, and efforts (nv,) of
    the actuators."""

    system: System
    at: VelocityKinematics
    saddle: SaddleSolution
    given: Array
    friction: FrictionSolution | None


def _balance(system, at, a, loads, bias, options):
    """Multipliers and efforts that balance the accelerations a (nv,), of drives or actuators; None: those of the
    system itself."""
    at, friction = closures.with_directions(system, at), None
    if a is None:
        if options.columns is None and options.method != "dense" and system.has_constraints:
            saddle = sparse_saddle_with_stresses(system, at, loads, options.method, bias)
            if system.friction is not None:
                friction = motion_with_friction(system, at, options.method, loads, options.compliance, bias)
                saddle = SaddleSolution(*friction[:3], saddle.stresses)
            return _Balance(system, at, saddle, jnp.zeros_like(at.u), friction)
        if system.friction is not None:
            friction = motion_with_friction(system, at, options.method, loads, options.compliance, bias)
        a, multipliers, gaps = (
            accelerations(system, at, options.method, loads, bias) if friction is None else friction[:3]
        )
        if options.columns is None:
            saddle = SaddleSolution(a, multipliers, gaps, self_stresses(system, at))
            return _Balance(system, at, saddle, jnp.zeros_like(at.u), friction)
    released = without_drives(system)
    if released is not system:
        at = closures.with_directions(released, at)
    need = tree_efforts(released, at, a, loads)
    found, friction = balance_with_friction(released, at, a, need, loads, options.columns, options.compliance)
    stresses = self_stresses(released, at, options.columns)
    saddle = SaddleSolution(a, found.multipliers, row_residuals(released, at, a), stresses)
    return _Balance(released, at, saddle, found.columns, friction)


def _joint_wrenches(system, at, lack, multipliers, friction):
    """`joint_wrenches`, with the friction of the cut joints."""
    found = joint_wrenches(system, at, lack, multipliers)
    if friction is None:
        return found
    names = [name for name, *_ in reaction_map.reaction_carriers(system)]
    return found._replace(wrench=found.wrench + cut_friction(system, friction, names))


def _needs_distribution(system, compliance):
    """True if compliances must distribute reactions: the build counted redundant rows, or the user gives
    compliances."""
    found = system.topology.analysis
    return bool(system.closures) and found is not None and (found.redundant > 0 or bool(compliance))


def _on_nodes(topology, wrenches):
    """Wrenches of bodies (bodies, 6) on the nodes that carry them."""
    return segment_sum_static(
        wrenches, np.asarray(topology.body_node, int) % (topology.nodes.size + 1), topology.nodes.size
    )


def _wrenches_in_frames(system, at, options, wrench):
    """Forces and moments (carriers, 3) in the axes and on the side asked, from world wrenches (carriers, 6)."""
    sign, end = (1.0, 1) if options.side == "child" else (-1.0, 0)
    own = [c[1 + end] for c in reaction_map.reaction_carriers(system)]
    return wrenches_at_frames(wrench, gather_static(at.R, own), gather_static(at.x, own), options.frame, sign)


def _joint_reactions(system, loads, total, drives, marks):
    """Reactions of joints and of two-frame constraints, from forces and moments (carriers, 3)."""
    joints, first = {joint.name: joint for joint in system.topology.joints}, len(total)
    own = {name: (first + a, first + b) for name, a, b in drives.places}
    names = [name for name, *_ in reaction_map.reaction_carriers(system)]
    columns = [joints[name].velocities if name in joints else slice(0, 0) for name in names]
    along = [(part.start, part.stop) for part in columns]
    efforts = jnp.concatenate([total, drives.vectors.effort])
    found = tuple(own.get(name, part) for name, part in zip(names, along, strict=True))
    return JointReactions(*loads, efforts, *marks, tuple(names), found, tuple(along))
