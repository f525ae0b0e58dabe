"""Constraint rows of loops, drives and couplers: residual f(psi, t), Jacobian A with `A u = -f_t`, and their rates.

Row order: cut joints and two-frame constraints group by group, then drives, couplers and user rows.
"""

import jax
import jax.numpy as jnp
import numpy as np

from ..model.system import ClosureGroup, System
from .poses import coordinate_rate, frame_poses, joint_twists, node_parameters, node_poses, step_coordinates


def _closure(group: ClosureGroup):
    """Rows of one element of a group from the world poses of its two frames."""

    def rows(kind, basis, R_a, x_a, R_b, x_b):
        axes = R_a @ basis
        return kind.closure(axes.T @ R_b @ basis, axes.T @ (x_b - x_a))

    return rows


def _closure_rows(group, R, x):
    a, b = np.asarray(group.first), np.asarray(group.second)
    return jax.vmap(_closure(group))(group.kind, group.basis, R[a], x[a], R[b], x[b])


def closure_directions(group: ClosureGroup, R, x):
    """Derivative of each row with respect to a world twist of frame B relative to frame A: (elements, rows, 6).

    Its transpose turns multipliers into the wrench (moment about the world origin, force) on frame B's body.
    """

    def directions(kind, basis, R_a, x_a, R_b, x_b):
        def moved(twist):
            omega, v = twist[:3], twist[3:]
            spin = jax.vmap(jnp.cross, in_axes=(None, 1), out_axes=1)(omega, R_b)
            return _closure(group)(kind, basis, R_a, x_a, R_b + spin, x_b + v + jnp.cross(omega, x_b))

        return jax.jacfwd(moved)(jnp.zeros(6, x_b.dtype))

    a, b = np.asarray(group.first), np.asarray(group.second)
    return jax.vmap(directions)(group.kind, group.basis, R[a], x[a], R[b], x[b])


def _coordinate_rows(system: System, psi, t):
    """Rows of drives, couplers and user functions."""
    rows = []
    for item in system.rows:
        if item.role == "drive":
            rows.append(psi[np.asarray(item.coordinates)] - jnp.reshape(item.law(t), (1,)))
        elif item.role == "coupler":
            rows.append(item.law.rows(psi[np.asarray(item.coordinates)]))
        else:
            rows.append(jnp.atleast_1d(item.law.function(psi, t)))
    return jnp.concatenate(rows)


def residual(system: System, P, psi, t):
    """f(psi, t), shape (rows,): lengths [m], tangents of half angles, coordinates.  Source: S2 (1)-(2)."""
    parts = []
    if system.closures:
        R, x = frame_poses(system, node_poses(system.topology, P, psi))
        parts += [_closure_rows(group, R, x).reshape(-1) for group in system.closures]
    if system.rows:
        parts.append(_coordinate_rows(system, psi, t))
    return jnp.concatenate(parts) if parts else jnp.zeros(0, psi.dtype)


def path_difference(system: System, group: ClosureGroup):
    """(elements, columns): +1 where a column moves frame B, -1 where it moves frame A, 0 where both or none."""
    path = np.vstack([system.topology.nodes.path, np.zeros((1, system.topology.nodes.size), bool)]).astype(float)
    node = np.asarray(system.topology.frame_node)
    return path[node[np.asarray(group.second)]] - path[node[np.asarray(group.first)]]


def jacobian(system: System, P, psi, t):
    """Rows A (rows, nv) of the velocity constraints, `A u = -f_t`; A = f_psi T.  Source: S2 (3), (5)."""
    top, parts = system.topology, []
    if system.closures:
        W = node_poses(top, P, psi)
        R, x = frame_poses(system, W)
        S = joint_twists(top, P, W)
        for group in system.closures:
            path = jnp.asarray(path_difference(system, group), psi.dtype)
            rows = jnp.einsum("erk,nk->ern", closure_directions(group, R, x), S) * path[:, None, :]
            parts.append(rows.reshape(-1, top.num_velocities))
    if system.rows:
        basis = jnp.eye(top.num_velocities, dtype=psi.dtype)

        def along(u):
            rate = coordinate_rate(top, psi, u)
            return jax.jvp(lambda q: _coordinate_rows(system, q, t), (psi,), (rate,))[1]

        parts.append(jax.vmap(along, out_axes=1)(basis))
    return jnp.concatenate(parts) if parts else jnp.zeros((0, top.num_velocities), psi.dtype)


def row_scale(system: System):
    """Weights (rows,) that bring lengths to multiples of the characteristic length, angles and others as they are."""
    top = system.topology
    length = 1.0 if top.analysis is None else top.analysis.length
    units = [unit for group in system.closures for _ in group.names for unit in group.kind.row_units]
    for row in system.rows:
        sliding = row.role == "drive" and top.node_kind[row.columns[0]] == "prismatic"
        units += ["m" if sliding else "rad"] * sum(name == row.name for name in top.row_joint)
    return jnp.asarray([1.0 / length if unit == "m" else 1.0 for unit in units])


def time_rate(system: System, P, psi, t):
    """f_t (rows,): the partial derivative in time, nonzero for drives and moving supports."""
    if not system.rows:
        return jnp.zeros(system.topology.num_rows, psi.dtype)
    rate = jax.jvp(lambda t: _coordinate_rows(system, psi, t), (t,), (jnp.ones_like(t),))[1]
    return jnp.concatenate([jnp.zeros(system.topology.num_rows - rate.shape[0], psi.dtype), rate])


def acceleration_bias(system: System, P, psi, u, t):
    """gamma (rows,) with `A u_dot = gamma`: `-(A_dot u + d f_t/dt)` along the motion."""

    def speed(psi, t):
        return jacobian(system, P, psi, t) @ u + time_rate(system, P, psi, t)

    rates = (coordinate_rate(system.topology, psi, u), jnp.ones_like(t))
    return -jax.jvp(speed, (psi, t), rates)[1]


def constraint_residual(system: System, state):
    """Residual f(psi, t) (rows,) of all loops, drives and couplers; zero when assembled.  Source: S2 (1)-(2)."""
    return residual(system, node_parameters(system), state.coordinates, state.t)


def constraint_jacobian(system: System, state):
    """Velocity rows A (rows, nv): `A u + f_t = 0`.  Source: S2 (3), (5)."""
    return jacobian(system, node_parameters(system), state.coordinates, state.t)


def perturbed(system: System, P, psi, t, delta):
    """Residual after a step `delta` (nv,) on the configuration space."""
    return residual(system, P, step_coordinates(system.topology, psi, delta), t)


def reaction_map(system: System, P, psi, t):
    """Joint reactions per unit multiplier, (joints, 6, rows): force then moment on the joint's child.

    About the origin and in the axes of the joint's child frame.  Multipliers of drives and couplers act inside
    their joints and load no body from outside.  Source: S1 (27)-(28), the homogeneous family of the loops.
    """
    top = system.topology
    num = len(top.joints)
    out = jnp.zeros((num, 6, top.num_rows), psi.dtype)
    if not system.closures:
        return out
    R, x = frame_poses(system, node_poses(top, P, psi))
    parts = []
    for group in system.closures:
        D = closure_directions(group, R, x)
        weight = jnp.asarray(_reaction_weights(top, group), D.dtype)
        parts.append(jnp.einsum("ej,erk->jker", weight, D).reshape(num, 6, -1))
    known = sum(part.shape[2] for part in parts)
    out = jnp.concatenate([*parts, out[:, :, known:]], axis=2)
    child = np.array([j.frames[1] for j in top.joints])
    moment, force = out[:, :3], out[:, 3:]
    moment = moment - jax.vmap(jax.vmap(jnp.cross, in_axes=(None, 1), out_axes=1))(x[child], force)
    turn = jnp.einsum("jba,jbm->jam", R[child], force), jnp.einsum("jba,jbm->jam", R[child], moment)
    return jnp.concatenate(turn, axis=1)


def _reaction_weights(top, group):
    """(elements, joints): share of an element's wrench that each joint carries on its child; static."""
    weights = np.zeros((len(group.names), len(top.joints)))
    for e, name in enumerate(group.names):
        a, b = (top.frame_body[end[e]] for end in (group.first, group.second))
        for k in range(top.bodies.size):
            below = float(b >= 0 and top.bodies.path[b, k]) - float(a >= 0 and top.bodies.path[a, k])
            joint = top.body_joint[k]
            weights[e, joint] = -below if top.joints[joint].child == k else below
        if name in top.joint_index:
            weights[e, top.joint_index[name]] = 1.0
    return weights
