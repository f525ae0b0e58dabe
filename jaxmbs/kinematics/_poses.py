"""Poses, joint twists and inertias of all nodes; rates of quaternions; steps on the configuration space.

Frames and signs.  A node is a simple joint: it turns by its coordinate q, right-handed about the z axis of its own
frame, or slides along it, or both (screw).  Its frame in that of the parent node is the constant placement R, p, then
the motion: `R Rz(q)` and `p + lead q R e_z`, so that frames at q = 0 are the placements.  World poses W are those of
the parent times these.  The twist of a unit rate is (z, X x z + lead z) about the origin, with the world axis z and
position X of the node; both are the same in the parent's and the node's frame, as the node turns about z.  A ball is
three nodes with one quaternion (w, x, y, z) of child in parent: its rates are angular velocities in child axes, one
column for each, and its columns' z axes are x, y and z of the child (`CYCLE`).
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math._rotation import quaternion_exp, quaternion_product, quaternion_rate
from ..math._spatial import (
    TRIANGLE,
    compose,
    quaternion_rotations,
    rotate_about_axis,
    rotations,
    rows,
    scale,
    screw_twists,
    world_inertia,
)
from ..model._pose import Pose
from ..model._system import System
from ..model._topology import Topology
from ..runtime import fusion_barrier, gather_static
from ._node_parameters import NodeParameters, positions, z_axes
from ._tree import poses

#: Cyclic rotation that takes z to x: a ball's three columns are x, y, z of the child by applying it thrice.
CYCLE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def broadcast_nodes(values, x):
    """Static numbers per node as an array that multiplies (nodes[, batch]) arrays like `x`."""
    return jnp.asarray(values, x.dtype).reshape((-1,) + (1,) * (x.ndim - 1))


def node_parameters(system: System):
    """Packed `NodeParameters` (nodes, 23) of a system."""
    top, n = system.topology, system.topology.nodes.size
    R, p = system.body_pose.rotation, system.body_pose.position
    com = p + jnp.einsum("bij,bj->bi", R, system.com)
    inertia = jnp.einsum("bij,bjk,blk->bil", R, system.inertia, R)
    node = np.asarray(top.body_node)
    if not np.array_equal(node, np.arange(n)):
        mass, com, inertia = _combine_welded_bodies(n, np.where(node < 0, n, node), system.mass, com, inertia)
    else:
        mass = system.mass
    upper = inertia.reshape(n, 9)[:, TRIANGLE]
    placement = system.placement
    return NodeParameters.pack(placement.rotation, placement.position, system.lead, mass, com, upper)


def _combine_welded_bodies(n, node, mass, com, inertia):
    """Mass, centre of mass and inertia of the bodies welded to each of `n` nodes (index n is the ground)."""

    def total(x):
        return jnp.zeros((n + 1, *x.shape[1:]), x.dtype).at[node].add(x)[:n]

    M = total(mass)
    safe = jnp.where(M > 0, M, 1.0)
    C = total(mass[:, None] * com) / safe[:, None]
    r = com - jnp.concatenate([C, jnp.zeros((1, 3), C.dtype)])[node]
    square = jnp.einsum("bi,bi->b", r, r)[:, None, None] * jnp.eye(3)[None] - r[:, :, None] * r[:, None, :]
    return M, C, total(inertia + mass[:, None, None] * square)


def local_transforms(topology: Topology, P, psi):
    """Pose of each node in its parent, (nodes, 12, ...), at coordinates psi (nq[, batch])."""
    nodes = NodeParameters(P)
    R, x = nodes.rotation, nodes.position
    simple = topology.is_simple
    start = np.asarray(topology.node_coordinate)
    q = psi if simple else psi[start]
    angle = q if all(topology.turns) else q * broadcast_nodes(topology.turns, q)
    turning, x = rows(rotate_about_axis(R, angle)), jnp.broadcast_to(x, (*x.shape[:2], *q.shape[1:]))
    if topology.has_translations:
        x = x + scale(nodes.axis, nodes.lead * q)
    local = jnp.concatenate([turning, x], axis=1)
    if simple:
        return local
    first = topology.balls
    turn = quaternion_rotations(jnp.stack([psi[start[first] + i] for i in range(4)], axis=1))
    ball = rows(compose(R[first], jnp.roll(turn, -1, axis=2)))
    position = jnp.broadcast_to(x[first], ball[:, :3].shape)
    return local.at[first].set(jnp.concatenate([ball, position], axis=1))


def append_batch_axes(P, psi):
    """Parameters with as many trailing batch axes as the coordinates."""
    missing = psi.ndim - (P.ndim - 1)
    return P.reshape(P.shape + (1,) * missing) if missing > 0 else P


def node_poses(topology: Topology, P, psi):
    """World pose (nodes, 12, ...) of every node; Source: S2 (1), the tree of links."""
    local = local_transforms(topology, append_batch_axes(P, psi), psi)
    return poses(topology.nodes, fusion_barrier(local))  # else its derivative is computed many times over


def joint_twists(topology: Topology, P, W):
    """World twist (nodes, 6, ...) of a unit rate of each column, about the world origin.  Source: S2 (11), (14)."""
    z, X, lead = z_axes(W), positions(W), NodeParameters(append_batch_axes(P, W[:, 0])).lead
    turn = None if all(topology.spins) else broadcast_nodes(topology.spins, W[:, 0])
    return screw_twists(z, X, turn, jnp.broadcast_to(lead, W[:, 0].shape))


def node_inertias(P, W):
    """World inertia (nodes, 10, ...) of every node about the world origin."""
    nodes = NodeParameters(append_batch_axes(P, W[:, 0]))
    return world_inertia(W, nodes.mass, nodes.com, nodes.inertia)


def coordinate_rate(topology: Topology, psi, u):
    """Rates of the coordinates (nq,) from velocities u (nv,): the map T(psi)."""
    if topology.is_simple:
        return u
    rate = _scatter_simple(topology, jnp.zeros_like(psi), u)
    parts, columns = _ball_parts(topology)
    turning = jax.vmap(quaternion_rate)(psi[parts], u[columns])
    return rate.at[parts].set(turning, unique_indices=True)


def step_coordinates(topology: Topology, psi, delta):
    """`psi (+) delta`: a step delta (nv,) on the configuration space, exact for quaternions."""
    if topology.is_simple:
        return psi + delta
    moved = psi + _scatter_simple(topology, jnp.zeros_like(psi), delta)
    parts, columns = _ball_parts(topology)
    turned = jax.vmap(quaternion_product)(psi[parts], jax.vmap(quaternion_exp)(delta[columns]))
    return moved.at[parts].set(turned, unique_indices=True)


def normalise(topology: Topology, psi):
    """Coordinates with quaternions of unit length."""
    if topology.is_simple:
        return psi
    parts, _ = _ball_parts(topology)
    q = psi[parts]
    return psi.at[parts].set(q * lax.rsqrt(jnp.sum(q * q, axis=1, keepdims=True)), unique_indices=True)


def neutral_coordinates(topology: Topology):
    """Zero coordinates (nq,), unit quaternions, in NumPy."""
    psi = np.zeros(topology.num_coordinates)
    for first in topology.balls:
        psi[topology.node_coordinate[first]] = 1.0
    return psi


def simple_columns(topology: Topology):
    """Velocity columns and coordinates that are rate and integral of each other."""
    columns = np.array([k for k, kind in enumerate(topology.node_kind) if kind != "ball"], int)
    return columns, np.asarray(topology.node_coordinate, int)[columns]


def _ball_parts(topology):
    """Coordinates (balls, 4) and velocity columns (balls, 3) of the balls."""
    first = topology.balls
    return np.asarray(topology.node_coordinate, int)[first][:, None] + np.arange(4), first[:, None] + np.arange(3)


def _scatter_simple(topology, into, values):
    columns, coordinates = simple_columns(topology)
    return into.at[coordinates].set(values[columns], unique_indices=True)


def first_body_position(topology: Topology, W):
    """World position (3, ...) of the first body that moves, a constant to derivatives."""
    nodes = [node for node in topology.body_node if node >= 0]
    return lax.stop_gradient(positions(W)[nodes[0]]) if nodes else jnp.zeros(3, W.dtype)


def shift_origin(W, origin):
    """Poses W (nodes, 12, ...) with positions from `origin` (3, ...)."""
    return jnp.concatenate([W[:, :9], positions(W) - origin[None]], axis=1)


def frame_poses(topology: Topology, frames: Pose, W, origin=None):
    """Pose of every frame: rotations (frames, 3, 3) and positions (frames, 3), like those of W from `origin`; no
    batch axes.

    Args: frames: of the system, in their nodes.
    """
    R = rotations(W)
    R = jnp.concatenate([R, np.eye(3, dtype=R.dtype)[None]])
    ground = jnp.zeros((1, 3), W.dtype) if origin is None else -origin[None]
    X = jnp.concatenate([positions(W), ground])
    node = np.asarray(topology.frame_node) % len(R)
    R, X = gather_static(R, node), gather_static(X, node)
    position = X + jnp.einsum("fij,fj->fi", R, frames.position)
    return jnp.einsum("fij,fjk->fik", R, frames.rotation), position


def frame_twists(system: System, V):
    """World twist (frames, 6) of the node that carries each frame, from those of the nodes (nodes, 6)."""
    V = jnp.concatenate([V, jnp.zeros((1, 6), V.dtype)])
    return gather_static(V, np.asarray(system.topology.frame_node) % len(V))


def body_frame(topology: Topology) -> np.ndarray:
    """Frame index of each body's own frame (frame 0 is the ground)."""
    return np.arange(1, topology.bodies.size + 1)
