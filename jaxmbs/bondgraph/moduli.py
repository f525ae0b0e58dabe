"""The numbers of a bond graph at a state: moduli of transformers, flows of junctions, laws of the elements.

All flows are linear in the rates w = (phi_dot, s) at the roots, s the prescribed rates: `u = L w`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..dynamics.efforts import efforts, gravity_wrench, stored_wrench
from ..dynamics.newton_euler import node_motion
from ..kinematics import constraints
from ..kinematics.influence import independent_columns
from ..kinematics.poses import Geometry, body_frame, coordinate_rate, frame_twists, geometry, node_inertias
from ..kinematics.tree import subtrees
from ..math.jit import jit
from ..math.linalg import full_rank_lstsq
from ..math.spatial import dot, unpack
from ..model.system import System
from .views import drive_rows


def rate_map(system: System, geo: Geometry, psi, t):
    """L (nv, N + D): velocities per independent velocity and per prescribed rate, `u = L (phi_dot, s)`.

    Its first N columns are Gamma of `velocity_map`, the others times s its b.  Source: S2 (3)-(5).
    """
    n, driven = system.topology.num_velocities, drive_rows(system)
    pick = np.eye(n)[independent_columns(system)]
    if not system.has_constraints:
        return jnp.asarray(pick.T, psi.dtype)
    A = constraints.jacobian_at(system, geo, psi, t)
    right = np.zeros((A.shape[0] + len(pick), len(pick) + len(driven)))
    right[A.shape[0] :, : len(pick)] = np.eye(len(pick))
    right[driven, len(pick) + np.arange(len(driven))] = 1.0
    rows = jnp.concatenate([A, jnp.asarray(pick, psi.dtype)])
    return full_rank_lstsq(rows, jnp.asarray(right, psi.dtype))


def root_rates(system: System, psi, u, t):
    """w (N + D,): the independent velocities, then the prescribed rates s = -f_t."""
    prescribed = -constraints.time_rate(system, psi, t)[np.asarray(drive_rows(system), int)]
    return jnp.concatenate([u[independent_columns(system)], prescribed])


def body_flows(system: System, geo: Geometry, V):
    """(bodies, 6) angular velocity and velocity of the centre of mass from node twists V (nodes, 6)."""
    own = body_frame(system.topology)
    twist = frame_twists(system, V)[own]
    com = geo.x[own] + jnp.einsum("bij,bj->bi", geo.R[own], system.com)
    return jnp.concatenate([twist[:, :3], twist[:, 3:] + jnp.cross(twist[:, :3], com)], axis=1)


def port_flow(system: System, group, geo: Geometry, V, u):
    """Flow (n, size) of every element of a force group: relative velocity, twist, joint rate or all velocities."""
    V = frame_twists(system, V)
    a, b = np.asarray(group.first, int), np.asarray(group.second, int)
    w, v = V[:, :3], V[:, 3:] + jnp.cross(V[:, :3], geo.x)
    if group.port == "line":
        return v[b] - v[a]
    if group.port == "frame":
        return jnp.concatenate([w[a], v[a]], axis=1)
    if group.port == "pose":
        slide = v[b] - v[a] - jnp.cross(w[a], geo.x[b] - geo.x[a])
        return jnp.concatenate([jnp.einsum("nji,nj->ni", geo.R[a], part) for part in (w[b] - w[a], slide)], axis=1)
    if group.port == "joint":
        return u[a][:, None]
    return jnp.broadcast_to(u, (len(group.names), u.shape[0]))


def port_efforts(group, geo: Geometry, flow, psi, t):
    """(stored, total) (n, size): efforts on the system along the flows, of the potential and in all.

    Source: S2 (56)-(59), (72), (76).
    """
    a, b = np.asarray(group.first, int), np.asarray(group.second, int)
    if group.port == "system":
        total = jax.vmap(lambda law, u: law.effort(t, psi, u))(group.law, flow)
        return jnp.zeros_like(total), total
    if group.port == "joint":
        q = psi[b]
        stored = jax.vmap(lambda law, q: -jax.grad(law.potential)(q, t))(group.law, q)
        total = jax.vmap(lambda law, q, v: law.effort(q, v, t))(group.law, q, flow[:, 0])
        return stored[:, None], total[:, None]
    if group.port == "line":
        d = geo.x[b] - geo.x[a]
        stored = jax.vmap(lambda law, d: -jax.grad(law.line_potential)(d, t))(group.law, d)
        return stored, jax.vmap(lambda law, d, v: law.line_force(d, v, t))(group.law, d, flow)
    R, x = geo.R[a], geo.x[a] + geo.origin[None]
    if group.port == "pose":
        R, x = jnp.einsum("nji,njk->nik", R, geo.R[b]), jnp.einsum("nji,nj->ni", R, geo.x[b] - geo.x[a])
    stored = jax.vmap(stored_wrench, (0, 0, 0, None))(group.law, R, x, t)
    return stored, jax.vmap(lambda law, R, x, f: law.wrench(R, x, f[:3], f[3:], t))(group.law, R, x, flow)


def world_inertias(system: System, geo: Geometry):
    """Inertia (bodies, 3, 3) of every body about its centre of mass, world axes."""
    R = geo.R[body_frame(system.topology)]
    return jnp.einsum("bij,bjk,blk->bil", R, system.inertia, R)


def apply_inertia(system: System, inertia, flow):
    """(bodies, 6, ...) angular momentum about the centre of mass, then momentum, of flows (bodies, 6, ...).

    Source: S2 (31)-(32).
    """
    turning = jnp.einsum("bij,bj...->bi...", inertia, flow[:, :3])
    return jnp.concatenate([turning, jnp.einsum("b,bi...->bi...", system.mass, flow[:, 3:])], axis=1)


def _fields(system, P, psi, t):
    """Body moduli G (bodies, 6, r) and I* (r, r), the drives' columns included; beside them the geometry, the rate
    map, its twists (r, nodes, 6) and the world inertias.  Source: S2 (11)-(15), (35)."""
    geo = geometry(system, P, psi)
    L, inertia = rate_map(system, geo, psi, t), world_inertias(system, geo)
    twists = jax.vmap(lambda u: node_motion(system.topology, geo.S, u), 1)(L)
    G = jax.vmap(lambda V: body_flows(system, geo, V), out_axes=-1)(twists)
    I = jnp.einsum("bki,bkj->ij", G, apply_inertia(system, inertia, G))
    return (G, I), (geo, L, twists, inertia)


def body_moduli(system: System, P, psi, t):
    """G (bodies, 6, N + D): flows of the bodies per root rate.  Source: S2 (11)-(15)."""
    return _fields(system, P, psi, t)[0][0]


class Numbers(NamedTuple):
    """Numbers of all views at a state; r = N + D root rates, bodies' flows being (turning 3, sliding 3).

    Attributes:
        geo, twists (nodes, 6), velocities u (nv,): where the tree is and how it moves.
        rates (r,), map L (nv, r): `u = L w`.
        modulus, modulus_rate (bodies, 6, r), flow (bodies, 6), inertias (bodies, 3, 3): of the bodies.
        inertia, inertia_rate (r, r): I* and its rate; gyristor (r, r): GR.
        ports: by force group modulus (n, size, r), flow, stored and total effort (n, size).
        total (r,): the effort Q of all ports and gravity.
    """

    geo: Geometry
    twists: Array
    velocities: Array
    rates: Array
    map: Array
    modulus: Array
    modulus_rate: Array
    flow: Array
    inertias: Array
    inertia: Array
    inertia_rate: Array
    gyristor: Array
    ports: list
    total: Array


@jit
def numbers(system: System, P, psi, u, t) -> Numbers:
    """Numbers of the graph at a state; accelerations are not needed.  Source: S2 (31)-(41), (56)-(76)."""
    moving = (coordinate_rate(system.topology, psi, u), jnp.ones_like(t))
    (G, I), (G_dot, I_dot), (geo, L, twists, inertias) = jax.jvp(
        lambda psi, t: _fields(system, P, psi, t), (psi, t), moving, has_aux=True
    )
    V, ports = node_motion(system.topology, geo.S, u), []
    for group in system.forces:
        flow = port_flow(system, group, geo, V, u)
        modulus = jax.vmap(
            lambda V, u, group=group: port_flow(system, group, geo, V, u), in_axes=(0, 1), out_axes=-1
        )(twists, L)
        ports.append((modulus, flow, *port_efforts(group, geo, flow, psi, t)))
    return Numbers(
        geo=geo,
        twists=V,
        velocities=u,
        rates=root_rates(system, psi, u, t),
        map=L,
        modulus=G,
        modulus_rate=G_dot,
        flow=body_flows(system, geo, V),
        inertias=inertias,
        inertia=I,
        inertia_rate=I_dot,
        gyristor=jnp.einsum("bki,bkj->ij", G_dot, apply_inertia(system, inertias, G)),
        ports=ports,
        total=L.T @ tree_loads(system, P, geo, V, psi, u, t),
    )


def tree_loads(system: System, P, geo: Geometry, V, psi, u, t):
    """Efforts (nv,) of gravity and all force elements on the tree's velocities.  Source: S2 (76)."""
    F, Q, _ = efforts(system, geo, V, psi, u, t)
    F = F + gravity_wrench(node_inertias(P, geo.W), system.gravity)
    return dot(unpack(geo.S), unpack(subtrees(system.topology.nodes, F))) + Q
