"""Rows of drives, couplers, cables and user functions, group by group: values, slopes, rates, wrenches and efforts.

A row's slope by a frame is its derivative by the frame's twist, in world axes about the origin; multipliers times
slopes are wrenches (moment, force) on the frame's body.  Rows of velocity alone come last among all.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..kinematics._configuration import Configuration
from ..kinematics._poses import coordinate_rate
from ..kinematics._wrench_targets import WrenchTargets
from ..model._rows import RowGroup
from ..model._system import System
from ..runtime import gather_static, segment_sum_static


class RowSlopes(NamedTuple):
    """Slopes of the rows of a group: by twists of their frames (n, r, k, 6), by velocities that they read (n, r, m),
    and the rows (n, r) where they are asked with them.

    Rows that read all coordinates have all velocities as columns.
    """

    frames: Array
    columns: Array
    values: Array | None = None


def has_frames(system: System) -> bool:
    """True if some row acts on frames (static)."""
    return any(group.frames[0] for group in system.rows)


def at_frames(group: RowGroup, *arrays):
    """Rows of arrays (frames, ...) at the frames of each element: (n, k, ...)."""
    return tuple(_gathered(x, group.frames) for x in arrays)


def residual(system: System, at: Configuration):
    """The rows of position, in order: lengths [m], angles, or what the user's function gives."""
    known = [slope.values for slope in at.directions.rows] if at.directions and at.directions.rows else []
    groups, values = [], []
    for group, value in itertools.zip_longest(system.rows, known):
        if not group.law.is_nonholonomic:
            groups.append(group)
            values.append(_values(group, at.R, at.x, at.psi, at.t) if value is None else value)
    return _in_order(groups, values, at.psi.dtype)


def slopes(system: System, at: Configuration) -> tuple[RowSlopes, ...]:
    """Slopes of every group: those that the configuration holds, or else evaluated here."""
    if at.directions is not None and at.directions.rows is not None:
        return at.directions.rows
    return slopes_at(system, at.R, at.x, at.psi, at.t)


def slopes_at(system: System, R, x, psi, t, values: bool = False) -> tuple[RowSlopes, ...]:
    """Slopes of every group at poses of all frames and all coordinates, with the rows of position where asked."""
    each = (_slopes(system, group, R, x, psi, t) for group in system.rows)
    return tuple(each if values else (slope._replace(values=None) for slope in each))


def rates(system: System, slopes, twists, u):
    """Rates of all rows, in order, at twists of all frames (frames, 6) and velocities u (nv,), time held."""
    parts = []
    for group, slope in zip(system.rows, slopes, strict=True):
        rate = jnp.zeros(slope.columns.shape[:2], u.dtype)
        if group.frames[0]:
            rate = jnp.einsum("nrkj,nkj->nr", slope.frames, _gathered(twists, group.frames))
        if group.law.reads_all:
            rate = rate + slope.columns @ u
        elif group.columns[0]:
            rate = rate + jnp.einsum("nrm,nm->nr", slope.columns, _gathered(u, group.columns))
        parts.append(rate)
    return _in_order(system.rows, parts, u.dtype)


def magnitudes(slopes) -> tuple[RowSlopes, ...]:
    """Slopes without signs."""
    return jax.tree.map(jnp.abs, slopes)


def matrix(system: System, at: Configuration):
    """The rows of A (rows, nv)."""
    top, parts = system.topology, []
    for group, slope in zip(system.rows, slopes(system, at), strict=True):
        rows = jnp.zeros((*slope.columns.shape[:2], top.num_velocities), at.psi.dtype)
        if group.frames[0]:
            path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])  # of the ground: none
            moves = path[np.asarray(top.frame_node)[np.asarray(group.frames)]].astype(float)
            rows = jnp.einsum("nrkv,nkv->nrv", jnp.einsum("nrkj,vj->nrkv", slope.frames, at.S), moves)
        if group.law.reads_all:
            rows = rows + slope.columns
        elif group.columns[0]:
            units = np.eye(top.num_velocities)[np.asarray(group.columns)]
            rows = rows + jnp.einsum("nrm,nmv->nrv", slope.columns, units)
        parts.append(rows)
    return _in_order(system.rows, parts, at.psi.dtype, (top.num_velocities,))


def wrenches(system: System, slopes, multipliers) -> tuple[np.ndarray, Array]:
    """Frames, and the wrenches (n, 6) on them about the origin, of all multipliers (rows,).

    Args: slopes: or their rates, which give the rates of the wrenches.
    """
    frames: list[int] = []
    parts = [jnp.zeros((0, 6), multipliers.dtype)]
    for group, slope in zip(system.rows, slopes, strict=True):
        if group.frames[0]:
            frames += [frame for each in group.frames for frame in each]
            loads = jnp.einsum("nrkj,nr->nkj", slope.frames, _gathered(multipliers, group.places))
            parts.append(loads.reshape(-1, 6))
    return np.array(frames, int), jnp.concatenate(parts)


def wrenches_on(owners: WrenchTargets, system: System, at: Configuration, multipliers):
    """World wrenches (n, 6) of all multipliers (rows,) on the owners."""
    return owners.collect(*wrenches(system, slopes(system, at), multipliers))


def column_efforts(system: System, slopes, multipliers):
    """Efforts (nv,) inside of joints of all multipliers (rows,), without those of wrenches on frames."""
    number = system.topology.num_velocities
    efforts = jnp.zeros(number, multipliers.dtype)
    for group, slope in zip(system.rows, slopes, strict=True):
        if group.law.reads_all or group.columns[0]:
            effort = jnp.einsum("nrm,nr->nm", slope.columns, _gathered(multipliers, group.places))
            if not group.law.reads_all:
                effort = segment_sum_static(effort.reshape(-1), np.asarray(group.columns).reshape(-1), number)
            efforts = efforts + effort.reshape(number)
    return efforts


def time_rates(system: System, R, x, psi, t):
    """Rates of all rows, in order, at rest: derivatives by time, and rows of velocity at none."""
    parts = [_time_rates(system, group, R, x, psi, t) for group in system.rows]
    return _in_order(system.rows, parts, psi.dtype)


def follow_drives(system: System, psi, t, names):
    """Coordinates (nq,) with those of some drives at their values at a time; no derivative."""
    for group in system.rows:
        driven = np.flatnonzero([group.law.prescribes and name in names for name in group.names])
        if len(driven):
            R, x = _no_frames(psi)
            gap = _values(group, R, x, psi, t)[driven]
            psi = psi.at[np.asarray(group.coordinates)[driven]].add(-jax.lax.stop_gradient(gap))
    return psi


def depend_on_time(system: System) -> bool:
    """True if some row may depend on time (static)."""
    return any(group.law.may_depend_on_time for group in system.rows)


def reads_time(system: System, group: RowGroup) -> bool:
    """True if the traced code of the rows reads the time."""
    top, frames = system.topology, len(system.frames.position)
    x, psi = np.zeros((frames, 3)), np.zeros(top.num_coordinates)

    def at(t):
        if group.law.is_nonholonomic:
            return _slips(group, psi, np.zeros(top.num_velocities), t)
        return _values(group, np.zeros((frames, 3, 3)), x, psi, t)

    traced = jax.make_jaxpr(at)(0.0).jaxpr
    read = any(traced.invars[0] is x for equation in traced.eqns for x in equation.invars)
    return group.law.may_depend_on_time and read


def _in_order(groups, parts, dtype, more=()):
    """Numbers (rows, ...) of some groups' rows, from those of each group (n, r, ...)."""
    places = np.concatenate([np.zeros(0, int), *(np.reshape(group.places, -1) for group in groups)])
    rows = [part.reshape(-1, *more) for part in parts]
    rows = rows[0] if len(rows) == 1 else jnp.concatenate([jnp.zeros((0, *more), dtype), *rows])
    return rows if np.all(np.diff(places) > 0) else gather_static(rows, np.argsort(places))


def _gathered(x, places):
    """Rows of x (p, ...) at places (n, k): (n, k, ...)."""
    places = np.asarray(places, int)
    if not places.size:
        return np.zeros((*places.shape, *x.shape[1:]), x.dtype)
    return gather_static(x, places.reshape(-1)).reshape(*places.shape, *x.shape[1:])


def _values(group, R, x, psi, t):
    """Rows (n, r) of a group."""
    return _of_each(group, lambda law, R, x, q: law.value(R, x, q, t), R, x, psi)


def _slips(group, psi, u, t):
    """Rows of velocity (n, r) of a group."""
    return _of_each(group, lambda law, R, x, q: law.slip(q, u, t), *_no_frames(psi), psi)


def _slopes(system, group, R, x, psi, t):
    if group.law.is_nonholonomic:
        rest = jnp.zeros(system.topology.num_velocities, psi.dtype)

        def by_velocities(law, R, x, q):
            slopes = jax.jacrev(lambda u: law.slip(q, u, t))(rest)
            return jnp.zeros((len(slopes), 0, 6), psi.dtype), slopes

        return RowSlopes(*_of_each(group, by_velocities, *_no_frames(psi), psi))
    both = lambda law, R, x, q: law.value_and_slopes(R, x, q, t)
    values, (frames, columns) = _of_each(group, both, R, x, psi)
    if group.law.reads_all and not system.topology.is_simple:
        rest = jnp.zeros(system.topology.num_velocities, psi.dtype)
        by_velocity = jax.linear_transpose(lambda u: coordinate_rate(system.topology, psi, u), rest)
        columns = jax.vmap(jax.vmap(lambda slope: by_velocity(slope)[0]))(columns)
    return RowSlopes(frames, columns, values)


def _time_rates(system, group, R, x, psi, t):
    if group.law.is_nonholonomic:
        return _slips(group, psi, jnp.zeros(system.topology.num_velocities, psi.dtype), t)
    if not group.law.may_depend_on_time:
        return jnp.zeros(np.shape(group.places), psi.dtype)
    return jax.jvp(lambda t: _values(group, R, x, psi, t), (t,), (jnp.ones_like(t),))[1]


def _no_frames(psi):
    return jnp.zeros((0, 3, 3), psi.dtype), jnp.zeros((0, 3), psi.dtype)


def _of_each(group, function, R, x, psi):
    """Values of a function of (law, rotations (k, 3, 3), positions (k, 3), coordinates (m,)), of each element."""
    if group.law.reads_all:
        law = jax.tree.map(lambda value: value[0], group.law)
        frames = [y[0] for y in at_frames(group, R, x)] if group.frames[0] else _no_frames(psi)
        return jax.tree.map(lambda value: value[None], function(law, *frames, psi))
    return jax.vmap(function)(group.law, *at_frames(group, R, x), _gathered(psi, group.coordinates))


def is_rheonomic(system: System) -> bool:
    """True if some constraint row may depend on time."""
    return bool(system.paths) or depend_on_time(system)
