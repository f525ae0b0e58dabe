"""Constraint rows: residual f(psi, t) of loops, drives, couplers; Jacobian A with `A u = -f_t`, and their rates.

Row order: cut joints and two-frame constraints group by group, then drives, couplers and user rows.  Rows of velocity
alone (rolling, blades; nonholonomic) stand among them in A but not in f: `topology.position_rows` picks the others;
f_t is what a row amounts to at rest.  Functions named `..._at` take the `Geometry` of the coordinates, so that one
walk of the tree serves them all.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math.linalg import RowScale, skew
from ..math.rows import summed, take
from ..model.question import question
from ..model.system import ClosureGroup, System
from .poses import coordinate_rate, frame_twists, geometry, node_parameters


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


def directions(system: System, geo):
    """`closure_directions` of every group, for the functions that take them where they are known already."""
    return tuple(closure_directions(group, geo.R, geo.x) for group in system.closures)


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
    rows = [jnp.zeros(0, psi.dtype)]
    for item in system.rows:
        if item.role == "drive":
            rows.append(psi[np.asarray(item.coordinates)] - jnp.reshape(item.law(t), (1,)))
        elif item.role == "coupler":
            rows.append(item.law.rows(psi[np.asarray(item.coordinates)]))
        elif item.role == "rows":
            rows.append(jnp.atleast_1d(item.law.function(psi, t)))
    return jnp.concatenate(rows)


def residual_at(system: System, geo, psi, t):
    """f(psi, t), shape (rows,): lengths [m], tangents of half angles, coordinates.  Source: S2 (1)-(2)."""
    parts = [
        jax.vmap(_rows)(group.kind, group.basis, *_ends(group, geo.R, geo.x)).reshape(-1)
        for group in system.closures
        if group.kind.num_rows > group.kind.num_slips
    ]
    if system.rows:
        parts.append(_coordinate_rows(system, psi, t))
    return jnp.concatenate(parts) if parts else jnp.zeros(0, psi.dtype)


def path_difference(system: System, group: ClosureGroup):
    """(elements, columns): +1 where a column moves frame B, -1 where it moves frame A, 0 where both or none."""
    path = np.vstack([system.topology.nodes.path, np.zeros((1, system.topology.nodes.size), bool)]).astype(float)
    node = np.asarray(system.topology.frame_node)
    return path[node[np.asarray(group.second)]] - path[node[np.asarray(group.first)]]


def jacobian_at(system: System, geo, psi, t, known=None):
    """Rows A (rows, nv) of the velocity constraints, `A u = -f_t`; A = f_psi T; known: `directions`.

    Source: S2 (3), (5)."""
    n, parts = system.topology.num_velocities, []
    for group, D in zip(system.closures, directions(system, geo) if known is None else known, strict=True):
        path = jnp.asarray(path_difference(system, group), psi.dtype)
        rows = jnp.einsum("erk,nk->ern", D, geo.S) * path[:, None, :]
        parts.append(rows.reshape(-1, n))
    if system.rows:
        along = jax.vmap(lambda u: coordinate_rates(system, psi, t, u), out_axes=1)
        parts.append(along(jnp.eye(n, dtype=psi.dtype)))
    return jnp.concatenate(parts) if parts else jnp.zeros((0, n), psi.dtype)


def coordinate_rates(system, psi, t, u):
    """Rates of the coordinate rows and the user's velocity rows at velocities u, without the part of time."""
    rate = coordinate_rate(system.topology, psi, u)
    rates = jax.jvp(lambda q: _coordinate_rows(system, q, t), (psi,), (rate,))[1]
    slips = jax.jvp(lambda v: _velocity_rows(system, psi, t, v), (jnp.zeros_like(u),), (u,))[1]
    return jnp.concatenate([rates, slips])


def _velocity_rows(system, psi, t, u):
    """The user's velocity rows; they come last."""
    rows = [row.law.rows(psi, u, t) for row in system.rows if row.role == "velocity"]
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
        sliding = row.role == "drive" and top.node_kind[row.columns[0]] == "prismatic"
        units += ["m" if sliding else "rad"] * sum(name == row.name for name in top.row_joint)
    unit = jnp.where(np.array([unit == "m" for unit in units], bool), 1.0 / system.length, 1.0)
    return RowScale(lax.stop_gradient(unit), np.unique(np.array(top.row_joint, str), return_inverse=True)[1])


def time_rate(system: System, psi, t):
    """f_t (rows,): the rates of the rows at rest, nonzero for drives and moving supports."""
    if not system.rows:
        return jnp.zeros(system.topology.num_rows, psi.dtype)
    rate = _coordinate_time_rates(system, psi, t)
    return jnp.concatenate([jnp.zeros(system.topology.num_rows - rate.shape[0], psi.dtype), rate])


def _frame_rates(system, geo, V):
    """Twists of the frames' carriers (frames, 6), and the rates of R and x they make."""
    carried = frame_twists(system, V)
    spin = jax.vmap(skew)(carried[:, :3])
    return carried, jnp.einsum("fij,fjk->fik", spin, geo.R), carried[:, 3:] + jnp.einsum("fij,fj->fi", spin, geo.x)


def acceleration_bias(system: System, geo, V, V_dot, psi, u, t, moving=None):
    """gamma (rows,) with `A u_dot = gamma`: `-(A_dot u + d f_t/dt)` along the motion.

    Args: V, V_dot (nodes, 6) twists and their rates at zero accelerations; moving: `moving_directions`, if known.
    """
    twist, R_dot, x_dot = _frame_rates(system, geo, V)
    twist_dot, (known, along) = frame_twists(system, V_dot), moving or moving_directions(system, geo)
    parts = []
    for group, D, D_dot in zip(system.closures, known, along(R_dot, x_dot), strict=True):
        relative, relative_dot = (take(v, group.second) - take(v, group.first) for v in (twist, twist_dot))
        rate = jnp.einsum("erk,ek->er", D_dot, relative) + jnp.einsum("erk,ek->er", D, relative_dot)
        parts.append(rate.reshape(-1))
    if system.rows:

        def row_speed(psi, t):
            return coordinate_rates(system, psi, t, u) + _coordinate_time_rates(system, psi, t)

        rates = (coordinate_rate(system.topology, psi, u), jnp.ones_like(t))
        parts.append(jax.jvp(row_speed, (psi, t), rates)[1])
    return -jnp.concatenate([jnp.zeros(0, psi.dtype), *parts])


def moving_directions(system: System, geo):
    """`directions`, and the function of (R_dot, x_dot) that gives their rates."""
    return jax.linearize(lambda R, x: directions(system, geo._replace(R=R, x=x)), geo.R, geo.x)


def pull(system: System, geo, V, psi, u, t, sigma, moving):
    """What the multipliers sigma (rows,) of the momentum do to its rate: `A_dot^T sigma` in three parts.

    Args: moving: `moving_directions`.

    Returns: node wrenches D^T sigma (nodes, 6), their rates along the motion, and the coordinate rows' part (nv,):
    `A_dot^T sigma = S_dot . subtrees(wrenches) + S . subtrees(rates) + part`.
    """
    top = system.topology
    wrenches = rates = jnp.zeros((top.nodes.size, 6), psi.dtype)
    if system.closures:
        _, R_dot, x_dot = _frame_rates(system, geo, V)

        known, along = moving

        def on_nodes(known):
            each = closure_wrenches(system, known, sigma)
            return sum_on_carriers(system, each, top.frame_node, top.nodes.size)

        wrenches, rates = on_nodes(known), on_nodes(along(R_dot, x_dot))
    part = jnp.zeros_like(u)
    if system.rows:
        moving = (coordinate_rate(top, psi, u), jnp.ones_like(t))
        part = jax.jvp(lambda psi, t: coordinate_efforts(system, psi, t, sigma), (psi, t), moving)[1]
    return wrenches, rates, part


def coordinate_efforts(system: System, psi, t, multipliers):
    """Efforts (nv,) of the multipliers (rows,) of drives, couplers and user rows: their part of `A^T lambda`."""
    rest = jnp.zeros(system.topology.num_velocities, psi.dtype)
    if not system.rows:
        return rest
    known = system.topology.num_rows - sum(len(g.names) * g.kind.num_rows for g in system.closures)
    return jax.linear_transpose(lambda v: coordinate_rates(system, psi, t, v), rest)(multipliers[-known:])[0]


def residual(system: System, P, psi, t):
    """f(psi, t) (rows,) from the tree parameters P; see `residual_at`."""
    return residual_at(system, geometry(system, P, psi), psi, t)


def jacobian(system: System, P, psi, t):
    """A (rows, nv) from the tree parameters P; see `jacobian_at`."""
    return jacobian_at(system, geometry(system, P, psi), psi, t)


@question
def constraint_residual(system: System, state):
    """Residual f(psi, t) (rows,) of all loops, drives and couplers; zero when assembled.  Source: S2 (1)-(2)."""
    return residual(system, node_parameters(system), state.coordinates, state.t)


@question
def constraint_jacobian(system: System, state):
    """Velocity rows A (rows, nv): `A u + f_t = 0`.  Source: S2 (3), (5)."""
    return jacobian(system, node_parameters(system), state.coordinates, state.t)


def carriers(system: System):
    """(name, frames A and B) of all that carries reactions: every joint, then every two-frame constraint."""
    top = system.topology
    elements = [e for g in system.closures for e in zip(g.names, g.first, g.second, strict=True)]
    return [(j.name, *j.frames) for j in top.joints] + [e for e in elements if e[0] not in top.joint_index]


def reaction_map(system: System, geo):
    """Reactions per unit multiplier, (carriers, 6, rows): force then moment on the joint's child or on frame B.

    About the origin and in the axes of that frame.  Multipliers of drives and couplers act inside their joints and
    load no body from outside.  Source: S1 (27)-(28), the homogeneous family of the loops.
    """
    top, names = system.topology, [name for name, *_ in carriers(system)]
    num = len(names)
    out = jnp.zeros((num, 6, top.num_rows), geo.x.dtype)
    if not system.closures:
        return out
    parts = []
    for group in system.closures:
        D = closure_directions(group, geo.R, geo.x)
        weight = jnp.asarray(_reaction_weights(top, group, names), D.dtype)
        parts.append(jnp.einsum("ej,erk->jker", weight, D).reshape(num, 6, -1))
    known = sum(part.shape[2] for part in parts)
    out = jnp.concatenate([*parts, out[:, :, known:]], axis=2)
    at = np.array([b for *_, b in carriers(system)])
    R, x, moment, force = take(geo.R, at), take(geo.x, at), out[:, :3], out[:, 3:]
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
