"""Distribution of indeterminate reactions among redundant joints by the compliance of their bonds."""

import jax
import jax.numpy as jnp
import numpy as np

from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints import _reaction_map as reaction_map
from ..constraints._joint_wrenches import wrenches_at_frames
from ..constraints._saddle_operator import row_kinds
from ..kinematics._configuration import Configuration
from ..math._linalg import RowScale, few_columns, saddle_solve
from ..math._spatial import from_public_order, to_public_order
from ..math._spd import spd_solve
from ..model._rows import drives
from ..model._system import System
from ..runtime import gather_static, tuning
from ..statics import BodyNetwork, Bonds, bond_reactions
from ..statics._network_sums import body_wrenches


def bond_network(system: System) -> BodyNetwork:
    """Bodies, and as bonds every joint and two-frame constraint, in the order of `reaction_map.carriers`."""
    top, carriers = system.topology, reaction_map.reaction_carriers(system)
    ends = [tuple(top.frame_body[frame] for frame in frames) for _, *frames in carriers]
    parent, child = zip(*ends, strict=True)
    return BodyNetwork(top.body_names, tuple(name for name, *_ in carriers), parent, child)


def system_bonds(system: System, at: Configuration, wrench, compliance=None) -> Bonds:
    """The bonds at a configuration, at their child's frame; efforts along what they leave free are those of `wrench`.

    Args: wrench (carriers, 6): world wrenches (force, moment) on the children, as everywhere in `statics`;
        compliance: by name, see `reactions`.
    """
    own = np.array([b for *_, b in reaction_map.reaction_carriers(system)])
    twists = to_public_order(_free_twists(system, at), 1)
    effort = jnp.einsum("qij,qi->qj", twists, wrench)
    place = gather_static(at.x, own), gather_static(at.R, own)
    C = jax.vmap(jnp.diag)(_compliances(system, compliance, effort.dtype))
    return Bonds.from_twists(bond_network(system), *place, twists, effort, system.length, C)


def _compliances(system, compliance, dtype):
    """Compliances (carriers, 6) for force and moment: 1 and 1 / length^2 by default, none of hidden joints."""
    usual = jnp.concatenate([jnp.ones(3, dtype), jnp.full(3, system.length**-2, dtype)])
    given = {joint.name: 0.0 for joint in system.topology.joints if joint.is_hidden} | dict(compliance or {})
    each = [given.get(name, usual) for name, *_ in reaction_map.reaction_carriers(system)]
    return jnp.stack([jnp.broadcast_to(jnp.asarray(c, dtype), (6,)) for c in each])


def _free_twists(system, at):
    """Free twists (carriers, 6, 6): columns of the tree's joints that no drive prescribes, and for closures
    projectors onto the twists that they leave free."""
    top, S, names = system.topology, at.S, [name for name, *_ in reaction_map.reaction_carriers(system)]
    driven = {column for row in drives(system.rows) for column in row.columns}
    held, source = np.full((len(names), 6), len(S)), np.arange(len(names))  # the column after the last is zero
    for joint in top.joints:
        columns = [c for c in range(joint.velocities.start, joint.velocities.stop) if c not in driven]
        if columns and not joint.is_cut:
            held[names.index(joint.name), : len(columns)] = columns
    parts = [gather_static(jnp.concatenate([S, jnp.zeros((1, 6), S.dtype)]), held).transpose(0, 2, 1)]
    for group, D in zip(system.closures, closures.directions(system, at), strict=True):
        source[[names.index(name) for name in group.names]] = sum(map(len, parts)) + np.arange(len(group.names))
        parts.append(jax.vmap(_free_projector)(D))
    return gather_static(jnp.concatenate(parts), source)


def _free_projector(D):
    """Projector (6, 6) onto the twists that violate no row of D (rows, 6)."""
    if len(D) == 6:  # of a weld: what rounding leaves of the difference is no twist
        return jnp.zeros_like(D)
    return np.eye(6, dtype=D.dtype) - D.T @ spd_solve(D @ D.T, D)


def least_compliance_reactions(system: System, at: Configuration, wrench, multipliers, compliance, method="dense"):
    """Multipliers (rows,) changed along the self-stresses so that the complementary energy of all bonds is least.

    Args: wrench (carriers, 6), or (k, carriers, 6) with multipliers (k, rows): reactions in balance, for the
        multipliers given; method: "dense" solves for few rows at once.
    Source: S1 (28).
    """
    moved = _distributable_rows(system)
    if method == "dense" and len(moved) <= tuning.SHARED_ROWS:
        by = _distribute_by_rows if multipliers.ndim == 1 else _distribute_columns_by_rows
        return by(system, at, wrench, multipliers, compliance, moved)
    if multipliers.ndim == 1:
        return _distribute_by_bonds(system, at, wrench, multipliers, compliance, moved)
    return jax.vmap(lambda w, y: _distribute_by_bonds(system, at, w, y, compliance, moved))(wrench, multipliers)


def _distributable_rows(system):
    """Rows that carry bond reactions, of closures and drives: other rows act inside their joints, as springs do."""
    kinds = row_kinds(system)
    return np.r_[np.arange(kinds.closures), np.sort(kinds.drives)].astype(int)


def _distribute_by_rows(system, at, wrench, multipliers, compliance, moved):
    """Least `1/2 w.C w`, `w = w_0 + W d`, over changes d of the multipliers that move no freedom, `A^T d = 0`."""
    W, A, C, unit = _rows_and_compliances(system, at, compliance, moved)
    w = _local_wrenches(system, at, wrench)
    change = saddle_solve(
        W.T @ (C[:, None] * W), A.T, -W.T @ (C * w.reshape(-1)), jnp.zeros(A.shape[1], A.dtype), unit
    )
    every = len(moved) == system.topology.num_rows
    return multipliers + change[0] if every else multipliers.at[moved].add(change[0])


def _distribute_columns_by_rows(system, at, wrench, multipliers, compliance, moved):
    """`_distribute_by_rows` of several wrenches (k, carriers, 6) and multipliers (k, rows), by one factor."""
    W, A, C, unit = _rows_and_compliances(system, at, compliance, moved)
    w = jax.vmap(lambda wrench: _local_wrenches(system, at, wrench).reshape(-1))(wrench)
    V = C[:, None] * W
    right = -few_columns(V.T, w.T)
    none = jnp.zeros((A.shape[1], len(w)), A.dtype)
    change = saddle_solve(few_columns(W.T, V), A.T, right, none, unit)[0].T
    every = len(moved) == system.topology.num_rows
    return multipliers + change if every else multipliers.at[:, moved].add(change)


def _rows_and_compliances(system, at, compliance, moved):
    """Wrenches W (carriers 6, rows) per unit multiplier, rows A (rows, nv), compliances C (carriers 6,), and the
    scale of efforts."""
    W, A = reaction_map.reaction_map(system, at), constraints.jacobian(system, at)
    if len(moved) != system.topology.num_rows:
        W, A = W[:, :, moved], A[moved]
    W, C = W.reshape(-1, len(moved)), _compliances(system, compliance, W.dtype).reshape(-1)
    spins = np.asarray(system.topology.spins) > 0
    return W, A, C, RowScale(jnp.where(spins, 1.0 / system.length, 1.0), np.zeros(len(spins), int))


def _local_wrenches(system, at, wrench):
    """World wrenches (carriers, 6) as force and moment at the child's frame of each, in its axes."""
    own = np.array([b for *_, b in reaction_map.reaction_carriers(system)])
    at_frames = wrenches_at_frames(wrench, gather_static(at.R, own), gather_static(at.x, own), "joint", 1.0)
    return jnp.concatenate(at_frames, axis=1)


def _distribute_by_bonds(system, at, wrench, multipliers, compliance, moved):
    """Distribution by the network of bonds, whose cost is linear in the number of loops."""
    wrench = to_public_order(wrench)
    bonds = system_bonds(system, at, wrench, compliance)
    loads = body_wrenches(bonds.network, wrench)
    change = from_public_order(bond_reactions(bonds, loads).wrench - wrench)
    names = list(bonds.network.bonds)
    moves = []
    for group, D in zip(system.closures, closures.directions(system, at), strict=True):
        index = np.array([names.index(name) for name in group.names])
        moves.append(jax.vmap(lambda D, w: spd_solve(D @ D.T, D @ w))(D, gather_static(change, index)).reshape(-1))
    moves += [_effort_change(system, at.S, change, names, row.columns[0])[None] for row in drives(system.rows)]
    return multipliers.at[moved].add(jnp.concatenate(moves))


def _effort_change(system, S, change, names, column):
    """Change of the effort along a column of a joint, from the changes of wrenches on the children.

    A joint of the tree carries its outer body, which may be its parent; then the sign is the opposite.
    """
    top = system.topology
    j = top.node_joint[column]
    outward = 1.0 if top.joints[j].child == top.body_joint.index(j) else -1.0
    return outward * (S[column] @ change[names.index(top.joints[j].name)])
