"""Constraint rows: residual f(psi, t) of loops, drives, couplers; Jacobian A with `A u = -f_t`, and their rates.

Row order: cut joints and two-frame constraints group by group, then drives, couplers and user rows.  Rows of velocity
alone (rolling, blades; nonholonomic) stand among them in A but not in f: `topology.position_rows` picks the others;
f_t is what a row amounts to at rest.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math.linalg import RowScale, skew
from ..math.rows import summed, take
from ..model.rows import Drive
from ..model.system import ClosureGroup, System
from .configuration import Configuration, Moving
from .poses import coordinate_rate, frame_twists


def _relative(basis, a, b):
    """Canonical axes of frame A, and the pose of frame B in them."""
    (R_a, x_a), (R_b, x_b) = a, b
    axes = R_a @ basis
    return axes, axes.T @ R_b @ basis, axes.T @ (x_b - x_a)


def _rows(kind, basis, a, b):
    _, R, d = _relative(basis, a, b)
    return kind.closure(R, d)


def _row_rates(kind, basis, a, b, twist):
    """Rates of the rows while B moves with the world `twist` relative to A."""
    axes, R, d = _relative(basis, a, b)
    omega, v = axes.T @ twist[:3], axes.T @ (twist[3:] + skew(twist[:3]) @ b[1])
    rates = []
    if kind.num_rows > kind.num_slips:
        rates.append(jax.jvp(kind.closure, (R, d), (skew(omega) @ R, v))[1])
    if kind.num_slips:
        rates.append(kind.slip(R, d, omega, v))
    return jnp.concatenate(rates)


def _directions(kind, basis, a, b):
    return jax.vmap(lambda twist: _row_rates(kind, basis, a, b, twist), out_axes=1)(jnp.eye(6, dtype=basis.dtype))


def _ends(group: ClosureGroup, *arrays):
    """The arrays at the elements' frames A, and at their frames B."""
    return tuple(tuple(take(x, end) for x in arrays) for end in (group.first, group.second))


def closure_directions(group: ClosureGroup, R, x):
    """Derivative of each row with respect to a world twist of frame B relative to frame A: (elements, rows, 6).

    Its transpose turns multipliers into the wrench (moment about the world origin, force) on frame B's body.
    """
    return jax.vmap(_directions)(group.kind, group.basis, *_ends(group, R, x))


def directions(system: System, at: Configuration):
    """`closure_directions` of every group, for the functions that take them where they are known already."""
    return tuple(closure_directions(group, at.R, at.x) for group in system.closures)


def closure_wrenches(system: System, known, multipliers):
    """Wrench (elements, 6) of the rows' multipliers on every element's B body, about the world origin, group by
    group; known: `directions`, or their rates."""
    first, wrenches = 0, []
    for group, D in zip(system.closures, known, strict=True):
        shape = (len(group.names), group.kind.num_rows)
        part = multipliers[first : first + shape[0] * shape[1]].reshape(shape)
        wrenches.append(jnp.einsum("erk,er->ek", D, part))
        first += shape[0] * shape[1]
    return wrenches


def sum_on_carriers(system: System, wrenches, carrier, n):
    """Wrenches of all elements on their carriers (n, 6), nodes or bodies: plus on B, minus on A."""
    both = jnp.concatenate([*wrenches, *(-wrench for wrench in wrenches)])
    ends = [end for side in ("second", "first") for group in system.closures for end in getattr(group, side)]
    return summed(both, np.asarray(carrier)[np.array(ends)] % (n + 1), n)


def _coordinate_rows(system: System, psi, t):
    """Rows of drives, couplers and user functions of position."""
    rows = [row.residual(psi, t) for row in system.rows if not row.restricts_velocity_alone]
    return jnp.concatenate([jnp.zeros(0, psi.dtype), *rows])


def residual(system: System, at: Configuration):
    """f(psi, t), shape (rows,): lengths [m], tangents of half angles, coordinates.  Source: S2 (1)-(2)."""
    parts = [
        jax.vmap(_rows)(group.kind, group.basis, *_ends(group, at.R, at.x)).reshape(-1)
        for group in system.closures
        if group.kind.num_rows > group.kind.num_slips
    ]
    if system.rows:
        parts.append(_coordinate_rows(system, at.psi, at.t))
    return jnp.concatenate(parts) if parts else jnp.zeros(0, at.psi.dtype)


def path_difference(system: System, group: ClosureGroup):
    """(elements, columns): +1 where a column moves frame B, -1 where it moves frame A, 0 where both or none."""
    path = np.vstack([system.topology.nodes.path, np.zeros((1, system.topology.nodes.size), bool)]).astype(float)
    node = np.asarray(system.topology.frame_node)
    return path[node[np.asarray(group.second)]] - path[node[np.asarray(group.first)]]


def jacobian(system: System, at: Configuration, known=None):
    """Rows A (rows, nv) of the velocity constraints, `A u = -f_t`; A = f_psi T; known: `directions`.

    Source: S2 (3), (5)."""
    n, parts = system.topology.num_velocities, []
    for group, D in zip(system.closures, directions(system, at) if known is None else known, strict=True):
        path = jnp.asarray(path_difference(system, group), at.psi.dtype)
        rows = jnp.einsum("erk,nk->ern", D, at.S) * path[:, None, :]
        parts.append(rows.reshape(len(group.names) * group.kind.num_rows, n))
    if system.rows:
        along = jax.vmap(lambda u: coordinate_rates(system, at.psi, at.t, u), out_axes=1)
        parts.append(along(jnp.eye(n, dtype=at.psi.dtype)))
    return jnp.concatenate(parts) if parts else jnp.zeros((0, n), at.psi.dtype)


def coordinate_rates(system, psi, t, u):
    """Rates of the coordinate rows and the user's velocity rows at velocities u, without the part of time."""
    rate = coordinate_rate(system.topology, psi, u)
    rates = jax.jvp(lambda q: _coordinate_rows(system, q, t), (psi,), (rate,))[1]
    slips = jax.jvp(lambda v: _velocity_rows(system, psi, t, v), (jnp.zeros_like(u),), (u,))[1]
    return jnp.concatenate([rates, slips])


def _velocity_rows(system, psi, t, u):
    """The user's velocity rows; they come last."""
    rows = [row.slip(psi, u, t) for row in system.rows if row.restricts_velocity_alone]
    return jnp.concatenate([jnp.zeros(0, psi.dtype), *rows])


def _coordinate_time_rates(system, psi, t):
    """The part of the same rows that remains at rest."""
    rate = jax.jvp(lambda t: _coordinate_rows(system, psi, t), (t,), (jnp.ones_like(t),))[1]
    rest = jnp.zeros(system.topology.num_velocities, psi.dtype)
    return jnp.concatenate([rate, _velocity_rows(system, psi, t, rest)])


def row_scale(system: System) -> RowScale:
    """Brings lengths to multiples of the characteristic length, angles and others as they are; rows by element."""
    top = system.topology
    units = [unit for group in system.closures for _ in group.names for unit in group.kind.row_units]
    for row in system.rows:
        sliding = isinstance(row, Drive) and top.node_kind[row.columns[0]] == "prismatic"
        units += ["m" if sliding else "rad"] * sum(name == row.name for name in top.row_joint)
    unit = jnp.where(np.array([unit == "m" for unit in units], bool), 1.0 / system.length, 1.0)
    return RowScale(lax.stop_gradient(unit), np.unique(np.array(top.row_joint, str), return_inverse=True)[1])


def time_rate(system: System, psi, t):
    """f_t (rows,): the rates of the rows at rest, nonzero for drives and moving supports."""
    if not system.rows:
        return jnp.zeros(system.topology.num_rows, psi.dtype)
    rate = _coordinate_time_rates(system, psi, t)
    return jnp.concatenate([jnp.zeros(system.topology.num_rows - rate.shape[0], psi.dtype), rate])


def _frame_rates(system, at):
    """Twists of the frames' carriers (frames, 6), and the rates of R and x they make."""
    carried = frame_twists(system, at.V)
    spin = jax.vmap(skew)(carried[:, :3])
    return carried, jnp.einsum("fij,fjk->fik", spin, at.R), carried[:, 3:] + jnp.einsum("fij,fj->fi", spin, at.x)


def acceleration_bias(system: System, at: Moving, V_dot, moving=None):
    """gamma (rows,) with `A u_dot = gamma`: `-(A_dot u + d f_t/dt)` along the motion.

    Args: V_dot (nodes, 6) twist rates at zero accelerations; moving: `moving_directions`, if known.
    """
    twist, R_dot, x_dot = _frame_rates(system, at)
    twist_dot, (known, along) = frame_twists(system, V_dot), moving or moving_directions(system, at)
    parts = []
    for group, D, D_dot in zip(system.closures, known, along(R_dot, x_dot), strict=True):
        relative, relative_dot = (take(v, group.second) - take(v, group.first) for v in (twist, twist_dot))
        rate = jnp.einsum("erk,ek->er", D_dot, relative) + jnp.einsum("erk,ek->er", D, relative_dot)
        parts.append(rate.reshape(-1))
    if system.rows:

        def row_speed(psi, t):
            return coordinate_rates(system, psi, t, at.u) + _coordinate_time_rates(system, psi, t)

        parts.append(jax.jvp(row_speed, (at.psi, at.t), _rates(system, at))[1])
    return -jnp.concatenate([jnp.zeros(0, at.psi.dtype), *parts])


def _rates(system, at):
    """Rates of (psi, t)."""
    return coordinate_rate(system.topology, at.psi, at.u), jnp.ones_like(at.t)


def moving_directions(system: System, at: Configuration):
    """`directions`, and the function of (R_dot, x_dot) that gives their rates."""

    def of_frames(R, x):
        return tuple(closure_directions(group, R, x) for group in system.closures)

    return jax.linearize(of_frames, at.R, at.x)


def pull(system: System, at: Moving, sigma, moving):
    """What the multipliers sigma (rows,) of the momentum do to its rate: `A_dot^T sigma` in three parts.

    Args: moving: `moving_directions`.

    Returns: node wrenches D^T sigma (nodes, 6), their rates along the motion, and the coordinate rows' part (nv,):
    `A_dot^T sigma = S_dot . subtrees(wrenches) + S . subtrees(rates) + part`.
    """
    top = system.topology
    wrenches = rates = jnp.zeros((top.nodes.size, 6), at.psi.dtype)
    if system.closures:
        _, R_dot, x_dot = _frame_rates(system, at)

        known, along = moving

        def on_nodes(known):
            each = closure_wrenches(system, known, sigma)
            return sum_on_carriers(system, each, top.frame_node, top.nodes.size)

        wrenches, rates = on_nodes(known), on_nodes(along(R_dot, x_dot))
    part = jnp.zeros_like(at.u)
    if system.rows:
        efforts = lambda psi, t: coordinate_efforts(system, psi, t, sigma)  # noqa: E731
        part = jax.jvp(efforts, (at.psi, at.t), _rates(system, at))[1]
    return wrenches, rates, part


def coordinate_efforts(system: System, psi, t, multipliers):
    """Efforts (nv,) of the multipliers (rows,) of drives, couplers and user rows: their part of `A^T lambda`."""
    rest = jnp.zeros(system.topology.num_velocities, psi.dtype)
    if not system.rows:
        return rest
    known = system.topology.num_rows - sum(len(g.names) * g.kind.num_rows for g in system.closures)
    return jax.linear_transpose(lambda v: coordinate_rates(system, psi, t, v), rest)(multipliers[-known:])[0]


def carriers(system: System):
    """(name, frames A and B) of all that carries reactions: every joint, then every two-frame constraint."""
    top = system.topology
    elements = [e for g in system.closures for e in zip(g.names, g.first, g.second, strict=True)]
    return [(j.name, *j.frames) for j in top.joints] + [e for e in elements if e[0] not in top.joint_index]


def reaction_map(system: System, at: Configuration):
    """Reactions per unit multiplier, (carriers, 6, rows): force then moment on the joint's child or on frame B.

    About the origin and in the axes of that frame.  Multipliers of drives and couplers act inside their joints and
    load no body from outside.  Source: S1 (27)-(28), the homogeneous family of the loops.
    """
    top, names = system.topology, [name for name, *_ in carriers(system)]
    num = len(names)
    out = jnp.zeros((num, 6, top.num_rows), at.x.dtype)
    if not system.closures:
        return out
    parts = []
    for group in system.closures:
        D = closure_directions(group, at.R, at.x)
        weight = jnp.asarray(_reaction_weights(top, group, names), D.dtype)
        parts.append(jnp.einsum("ej,erk->jker", weight, D).reshape(num, 6, -1))
    known = sum(part.shape[2] for part in parts)
    out = jnp.concatenate([*parts, out[:, :, known:]], axis=2)
    own = np.array([b for *_, b in carriers(system)])
    R, x, moment, force = take(at.R, own), take(at.x, own), out[:, :3], out[:, 3:]
    moment = moment - jnp.einsum("jab,jbm->jam", jax.vmap(skew)(x), force)
    return jnp.concatenate([jnp.einsum("jba,jbm->jam", R, part) for part in (force, moment)], axis=1)


def _reaction_weights(top, group, names):
    """(elements, carriers): share of an element's wrench that each joint or constraint carries; static."""
    weights = np.zeros((len(group.names), len(names)))
    for e, name in enumerate(group.names):
        a, b = (top.frame_body[end[e]] for end in (group.first, group.second))
        for k in range(top.bodies.size):
            below = float(b >= 0 and top.bodies.path[b, k]) - float(a >= 0 and top.bodies.path[a, k])
            joint = top.body_joint[k]
            weights[e, joint] = -below if top.joints[joint].child == k else below
        weights[e, names.index(name)] = 1.0
    return weights
