"""Efforts of gravity and force elements on the tree, their stored energy and the power of each element.

Every law is carried to its nodes as a world wrench or to its own velocity column, so a new law never touches
kinematics.  Source: S2 (56)-(76), total `Q = Q* + e_C + e_R + e_G`.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ..kinematics.configuration import Configuration, Moving
from ..kinematics.poses import frame_twists
from ..math.linalg import skew
from ..math.rows import summed, take
from ..math.spatial import cross, pack, scale, unpack
from ..model.system import ForceGroup, System
from .elastic import elastic_efforts, strain_energy


def gravity_wrench(J, gravity):
    """Wrench (nodes, 6, ...) of gravity on inertias J (nodes, 10, ...).  Source: S2 (75)."""
    j, g = unpack(J), tuple(gravity)
    return pack(cross(j[1:4], g) + scale(g, j[0]))


def _at(x, V):
    """Angular velocity and the velocity of the point x of a body with world twist V."""
    return V[:3], V[3:] + skew(V[:3]) @ x


def _wrench_at(x, moment, force):
    """World wrench about the origin of a force and moment at the point x."""
    return jnp.concatenate([moment + skew(x) @ force, force])


def _line(law, a, b, t):
    """Law along the line between two points: (wrench on A, wrench on B, power); Source: S2 (56)-(67), (72)."""
    (_, x_a, V_a, _), (_, x_b, V_b, _) = a, b
    d, v = x_b - x_a, _at(x_b, V_b)[1] - _at(x_a, V_a)[1]
    force = law.line_force(d, v, t)
    stored = jax.jvp(lambda d: law.line_potential(d, t), (d,), (v,))[1]
    wrench = _wrench_at(x_b, jnp.zeros_like(force), force)
    return -wrench, wrench, jnp.dot(force, v) + stored


def _pose_arguments(a, b):
    (R_a, x_a, V_a, _), (R_b, x_b, V_b, _) = a, b
    (w_a, v_a), (w_b, v_b) = _at(x_a, V_a), _at(x_b, V_b)
    d = x_b - x_a
    return R_a.T @ R_b, R_a.T @ d, R_a.T @ (w_b - w_a), R_a.T @ (v_b - v_a - skew(w_a) @ d)


def _pose(law, a, b, t):
    """Law between two frames: (wrench on A, wrench on B, power)."""
    R, d, w, v = _pose_arguments(a, b)
    local = law.wrench(R, d, w, v, t)
    spin = skew(w) @ R
    stored = jax.jvp(lambda R, d: law.potential(R, d, t), (R, d), (spin, v))[1]
    R_a, x_b = a[0], b[1]
    wrench = _wrench_at(x_b, R_a @ local[:3], R_a @ local[3:])
    return -wrench, wrench, jnp.dot(local, jnp.concatenate([w, v])) + stored


def _frame(law, a, _, t):
    """Load at a frame: (wrench on the frame's body, nothing, power); Source: S2 (76), Q*."""
    R, x, V, place = a
    w, v = _at(x, V)
    load = law.wrench(R, place, w, v, t)
    spin = skew(w) @ R
    stored = jax.jvp(lambda R, x: law.potential(R, x, t), (R, place), (spin, v))[1]
    wrench = _wrench_at(x, load[:3], load[3:])
    return wrench, jnp.zeros_like(wrench), jnp.dot(load, jnp.concatenate([w, v])) + stored


_PORTS = {"line": _line, "pose": _pose, "frame": _frame}


def _group_wrenches(system, group: ForceGroup, frames, t, owner):
    """Wrench on every owner (n, 6), nodes or bodies, and power of every element of a group between frames."""
    a, b = np.asarray(group.first), np.asarray(group.second)
    ends = [tuple(take(x, end) for x in frames) for end in (a, b)]
    on_a, on_b, power = jax.vmap(_PORTS[group.port], in_axes=(0, 0, 0, None))(group.law, *ends, t)
    of_frame, n = owner
    return summed(jnp.concatenate([on_a, on_b]), of_frame[np.concatenate([a, b])] % (n + 1), n), power


def _joint_efforts(system, group: ForceGroup, psi, u, t):
    """Efforts (nv,) and powers of scalar laws on joint coordinates."""
    q, v = take(psi, group.second), take(u, group.first)
    effort = jax.vmap(lambda law, q, v: law.effort(q, v, t))(group.law, q, v)
    slope = jax.vmap(lambda law, q, v: jax.jvp(lambda q: law.potential(q, t), (q,), (v,))[1])(group.law, q, v)
    return summed(effort, group.first, len(u)), effort * v + slope


def stored_wrench(law, R, x, t):
    """Part (6,) of a pose or body law's wrench that its potential makes: minus the slope by the twist."""

    def power(twist):
        return jax.jvp(lambda R, x: law.potential(R, x, t), (R, x), (skew(twist[:3]) @ R, twist[3:]))[1]

    return -jax.grad(power)(jnp.zeros(6, x.dtype))


def node_owner(system: System):
    """Carrier of every frame, for wrenches on nodes."""
    return np.asarray(system.topology.frame_node), system.topology.nodes.size


def body_owner(system: System):
    """Carrier of every frame, for wrenches on bodies."""
    return np.asarray(system.topology.frame_body), system.topology.bodies.size


def efforts(system: System, at: Moving, owner=None):
    """All force elements: wrench on every node (nodes, 6), or body by `owner`; effort on every column (nv,); powers.

    The power is what an element feeds in beside the energy it stores: negative for dissipation, positive for
    sources that drive; in the order of `element_names`.  Gravity is not included.
    """
    owner = owner or node_owner(system)
    F = jnp.zeros((owner[1], 6), at.psi.dtype)
    Q, powers = jnp.zeros_like(at.u), []
    frames = None
    for group in system.forces:
        if group.port in _PORTS:
            frames = frames or (at.R, at.x, frame_twists(system, at.V), at.x + at.origin[None])
            wrench, power = _group_wrenches(system, group, frames, at.t, owner)
            F = F + wrench
        elif group.port == "joint":
            effort, power = _joint_efforts(system, group, at.psi, at.u, at.t)
            Q = Q + effort
        else:
            effort = jax.vmap(lambda law: law.effort(at.t, at.psi, at.u), axis_size=len(group.names))(group.law)
            Q, power = Q + jnp.sum(effort, axis=0), effort @ at.u
        powers.append(power)
    if system.elastic:
        loads, power = elastic_efforts(system, at, owner)
        F, Q = F + loads.wrench, Q + loads.column
        powers.append(power)
    return F, Q, jnp.concatenate(powers) if powers else jnp.zeros(0, at.psi.dtype)


def element_names(system: System) -> tuple[str, ...]:
    """Names of the force elements in the order of their powers, then of the elastic bodies (their dampers)."""
    return tuple(name for group in (*system.forces, *system.elastic) for name in group.names)


def element_is_source(system: System) -> tuple[bool, ...]:
    """Whether the power of each element counts as input (else as dissipation)."""
    elastic = (False,) * sum(len(group.names) for group in system.elastic)
    return tuple(group.law.is_source for group in system.forces for _ in group.names) + elastic


def stored_energy(system: System, at: Configuration):
    """Potential energy [J] of all force elements and elastic bodies, without gravity.  Source: S2 (70), V."""
    total, R, x, t = strain_energy(system, at), at.R, at.x, at.t
    for group in system.forces:
        if group.port in _PORTS:
            a, b = np.asarray(group.first), np.asarray(group.second)
            if group.port == "line":
                parts = jax.vmap(lambda law, d: law.line_potential(d, t))(group.law, x[b] - x[a])
            elif group.port == "pose":
                turn = jnp.einsum("eji,ejk->eik", R[a], R[b])
                shift = jnp.einsum("eji,ej->ei", R[a], x[b] - x[a])
                parts = jax.vmap(lambda law, R, d: law.potential(R, d, t))(group.law, turn, shift)
            else:
                parts = jax.vmap(lambda law, R, x: law.potential(R, x, t))(group.law, R[a], x[a] + at.origin[None])
        elif group.port == "joint":
            q = at.psi[np.asarray(group.second)]
            parts = jax.vmap(lambda law, q: law.potential(q, t))(group.law, q)
        else:
            continue
        total = total + jnp.sum(parts)
    return total
