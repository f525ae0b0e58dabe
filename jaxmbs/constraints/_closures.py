"""Rows of cut joints and two-frame constraints, group by group: residuals, directions, wrenches along them.

Frame A is on the parent, frame B on the child.  Twists of B relative to A are in world axes, about the world origin:
(omega, velocity of the point of B at the origin).  A row's direction is its derivative by that twist; multipliers
times directions are wrenches (moment about the world origin, force) on the body of B, their negatives on that of A.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import Partial
from jaxtyping import Array

from ..kinematics._configuration import At, ClosureDirections, Configuration
from ..kinematics._wrench_targets import WrenchTargets
from ..math._linalg import skew
from ..model._system import ClosureGroup, System
from ..runtime import gather_static, jit
from ._rows import slopes_at


def _relative_pose(basis, a, b):
    """Axes of frame A in the canonical order of the joint, and the pose of frame B in them."""
    (R_a, x_a), (R_b, x_b) = a, b
    axes = R_a @ basis
    return axes, axes.T @ R_b @ basis, axes.T @ (x_b - x_a)


def _position_rows(kind, basis, a, b, t):
    _, R, d = _relative_pose(basis, a, b)
    return kind.closure_at(R, d, t)


def _row_rates(kind, basis, a, b, t, twist):
    """Rows of position (k,), and rates of all rows while B moves with the world `twist` relative to A, time held."""
    axes, R, d = _relative_pose(basis, a, b)
    omega, v = axes.T @ twist[:3], axes.T @ (twist[3:] + skew(twist[:3]) @ b[1])
    rows, rates = jnp.zeros(0, d.dtype), []
    if kind.num_rows > kind.num_slips:
        rows, rate = jax.jvp(lambda R, d: kind.closure_at(R, d, t), (R, d), (skew(omega) @ R, v))
        rates.append(rate)
    if kind.num_slips:
        rates.append(kind.slip(R, d, omega, v))
    return rows, jnp.concatenate(rates)


def _element_directions(kind, basis, a, b, t):
    along = lambda twist: _row_rates(kind, basis, a, b, t, twist)
    return jax.vmap(along, out_axes=(None, 1))(np.eye(6, dtype=basis.dtype))


_GROUP_AXES = (0, 0, 0, 0, None)  # axes of kind, basis, frames A and B, time


def _frame_poses(group: ClosureGroup, *arrays):
    """The arrays at the elements' frames A, and at their frames B."""
    return tuple(tuple(gather_static(x, end) for x in arrays) for end in (group.first, group.second))


def _group_rows(group, R, x, t):
    """Rows (elements, k) of a group."""
    a, b = _frame_poses(group, R, x)
    return jax.vmap(_position_rows, _GROUP_AXES)(group.kind, group.basis, a, b, t)


@jit  # traced once for all the places of a program where rows are asked for
def _rows_and_directions(group, R, x, t):
    """Rows of position (elements, k) of a group, and `closure_directions`."""
    a, b = _frame_poses(group, R, x)
    return jax.vmap(_element_directions, _GROUP_AXES)(group.kind, group.basis, a, b, t)


def closure_directions(group: ClosureGroup, R, x, t):
    """Derivative of each row with respect to a world twist of frame B relative to frame A: (elements, rows, 6).

    Its transpose turns multipliers into the wrench (moment about the world origin, force) on frame B's body.
    """
    return _rows_and_directions(group, R, x, t)[1]


def directions(system: System, at: Configuration):
    """`closure_directions` of every group: those that the configuration holds, or else evaluated here."""
    if at.directions is not None:
        return at.directions.values
    return tuple(closure_directions(group, at.R, at.x, at.t) for group in system.closures)


def residual_and_directions(system: System, at: At) -> tuple[list[Array], At]:
    """`residual`, and the configuration with the directions that were evaluated with it, without their rates."""
    found = [_rows_and_directions(group, at.R, at.x, at.t) for group in system.closures]
    values = ClosureDirections(tuple(D for _, D in found), slopes_at(system, at.R, at.x, at.psi, at.t, values=True))
    return [rows.reshape(-1) for rows, _ in found], dataclasses.replace(at, directions=values)


def wrenches(system: System, directions, multipliers):
    """Wrench (elements, 6) of the rows' multipliers on every element's B body, about the world origin, group by
    group.

    Args: directions: (elements, rows, 6) of every group; their rates give the rates of the wrenches.
    """
    first, found = 0, []
    for group, D in zip(system.closures, directions, strict=True):
        shape = (len(group.names), group.kind.num_rows)
        part = multipliers[first : first + shape[0] * shape[1]].reshape(shape)
        found.append(jnp.einsum("erk,er->ek", D, part))
        first += shape[0] * shape[1]
    return found


def accumulate_wrenches(owners: WrenchTargets, system: System, wrenches):
    """Wrenches of all elements on their owners (n, 6): plus on that of B, minus on that of A."""
    both = jnp.concatenate([*wrenches, *(-wrench for wrench in wrenches)])
    ends = [end for side in ("second", "first") for group in system.closures for end in getattr(group, side)]
    return owners.collect(ends, both)


def with_directions(system: System, at: At, values: bool = False) -> At:
    """The configuration with the directions of all rows of this system and the map to their rates.

    Args: values: True to keep the values of the rows that are no closures, too.
    """

    def of_frames(R, x, psi, t):
        slopes = slopes_at(system, R, x, psi, t, values)
        directions = tuple(closure_directions(group, R, x, t) for group in system.closures)
        return (directions, tuple(slope._replace(values=None) for slope in slopes)), [s.values for s in slopes]

    (directions, slopes), along, kept = jax.linearize(of_frames, at.R, at.x, at.psi, at.t, has_aux=True)
    slopes = tuple(slope._replace(values=value) for slope, value in zip(slopes, kept, strict=True))
    rates = Partial(_rates_in_time, along, at.t)  # a pytree, so that configurations pass through `vmap` and `jit`
    return dataclasses.replace(at, directions=ClosureDirections(directions, slopes, rates))


def with_rates(system: System, at: At) -> At:
    """The configuration with directions and the map to their rates: those that it holds, or else evaluated here."""
    is_known = at.directions is not None and at.directions.rates is not None
    return at if is_known else with_directions(system, at)


def _rates_in_time(along, t, R_dot, x_dot, psi_dot):
    return along(R_dot, x_dot, psi_dot, jnp.ones_like(t))


def direction_rates(at: Configuration, R_dot, x_dot, psi_dot):
    """Rates in time of the directions (elements, rows, 6) of every group of closures, and of the slopes of the other
    rows, of a configuration `with_directions`."""
    assert at.directions is not None and at.directions.rates is not None
    return at.directions.rates(R_dot, x_dot, psi_dot)


def time_rates(system: System, at: Configuration, frame_rates=None):
    """Rates (rows,) of all closures' rows at rest, nonzero for paths in time; with the rates (R_dot, x_dot) of the
    frames, the time derivatives of these rates along the motion."""

    def rate(group, R, x, t):
        return jax.jvp(lambda t: _group_rows(group, R, x, t), (t,), (jnp.ones_like(t),))[1].reshape(-1)

    parts = [jnp.zeros(0, at.psi.dtype)]
    for group in system.closures:
        one = functools.partial(rate, group)
        if not group.kind.may_depend_on_time:
            parts.append(jnp.zeros(len(group.names) * group.kind.num_rows, at.psi.dtype))
        elif frame_rates is None:
            parts.append(one(at.R, at.x, at.t))
        else:
            parts.append(jax.jvp(one, (at.R, at.x, at.t), (*frame_rates, jnp.ones_like(at.t)))[1])
    return jnp.concatenate(parts)


def residual(system: System, at: Configuration):
    """Residuals of every group with rows of position: lengths [m] and twice the tangents of half angles."""
    return [
        _group_rows(group, at.R, at.x, at.t).reshape(-1)
        for group in system.closures
        if group.kind.num_rows > group.kind.num_slips
    ]


def jacobian(system: System, at: Configuration):
    """Rows (rows, nv) of every group."""
    parts = []
    for group, D in zip(system.closures, directions(system, at), strict=True):
        path = jnp.asarray(path_difference(system, group), at.psi.dtype)
        rows = jnp.einsum("erk,nk->ern", D, at.S) * path[:, None, :]
        parts.append(rows.reshape(len(group.names) * group.kind.num_rows, system.topology.num_velocities))
    return parts


def path_difference(system: System, group: ClosureGroup):
    """(elements, columns): +1 where a column moves frame B, -1 where it moves frame A, 0 where both or none."""
    path = np.vstack([system.topology.nodes.path, np.zeros((1, system.topology.nodes.size), bool)]).astype(float)
    node = np.asarray(system.topology.frame_node)
    return path[node[np.asarray(group.second)]] - path[node[np.asarray(group.first)]]
