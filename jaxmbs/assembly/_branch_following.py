"""Branch following: from closed loops to other values of the given coordinates and of time, on the same branch.

A predictor-corrector method with controlled step length (Allgower and Georg, Numerical Continuation Methods, 1990):
a secant predictor, damped Newton corrections, and a step repeated at a quarter of its length where the corrections do
not contract or the sign of the branch changes.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..constraints._constraints import row_scale
from ..constraints._linear_rows import FrontalRows
from ..constraints._linear_solver import linear_solver
from ..kinematics._poses import simple_columns, step_coordinates
from ..math._determinant import determinant_signs
from ..math._rotation import quaternion_log, quaternion_product
from ..math._spd import spd_inverse
from ..model._system import System
from ._assembly import linearise_for_search
from ._branches import branch_signs, coupled_blocks, loop_blocks, row_dependence

_LONGEST_STEP = 0.2  # the longest step, in rad or characteristic lengths: a curve of that radius leaves it by a tenth
_LARGEST_CORRECTION = 0.1  # the largest correction of a prediction
_WANTED_CORRECTION = 0.03  # the correction that steps are made for; it grows with the square of the step
_CONTRACTION = 0.8  # of a correction to the one before: one half at a singular pose, next to nothing elsewhere
_PATH_TOLERANCE = 1e-4  # the last correction of a step on the way; the next step mends what it leaves
_END_TOLERANCE = {8: 1e-10, 4: 1e-5}  # that of the last step
_ROUNDING_RESIDUAL = {8: 1e-13, 4: 1e-6}  # residuals at rounding
_DAMPING = {8: 1e-13, 4: 1e-6}  # of motions that neither rows nor held values determine
_SIGN_DAMPING = 1e-6  # of such motions in the determinant that compares two poses
_CROSSING_LENGTH = (
    1e-4  # a step so short that changes the sign passes a crossing of branches, as a flat parallelogram's
)
_SHORTEST_SHARE = 1e-8  # share of the way; shorter steps say that the branch has ended
_MAX_PASSES = 3000  # evaluations of the rows; a whole turn takes some two hundred


class BranchPoint(NamedTuple):
    """Coordinates psi (nq,) that close the loops at a time t (); with the last motion `along` (nv + 1,) of the held
    columns and time the free ones moved by `slope` (nv,)."""

    psi: Array
    t: Array
    slope: Array
    along: Array


class _Path(NamedTuple):
    """The way from a place to held coordinates and a time: `motion` (nv,) and `duration` ().

    `free` (nv,) is one for columns that are found, zero for the static `held`; `unit` (position rows,) and `size`
    (nv,) bring rows and columns to one unit.
    """

    system: System
    P: Array
    place: BranchPoint
    motion: Array
    duration: Array
    free: Array
    unit: Array
    size: Array
    held: tuple[int, ...]


class _PathStep(NamedTuple):
    """A step from `psi`, with the `mark` of its branch, to `trial`; the free columns move by `gone` up to there.

    `share` () of the way lies behind it, `length` () is its own; `slope` (nv,) is how the free columns move along the
    way.  `first`, `last` () are corrections of the trial, `opening` (rows,) the residual where the way begins.
    """

    passes: Array
    share: Array
    length: Array
    psi: Array
    mark: Array
    slope: Array
    trial: Array
    gone: Array
    first: Array
    last: Array
    opening: Array


def first_branch_point(psi, t, num_velocities: int) -> BranchPoint:
    """A place with no step before it."""
    return BranchPoint(psi, t, jnp.zeros(num_velocities, psi.dtype), jnp.zeros(num_velocities + 1, psi.dtype))


def follow_branch(system: System, P, place: BranchPoint, psi, t, held: tuple[int, ...]) -> tuple[BranchPoint, Array]:
    """The place on the same branch with the held columns at their values in psi (nq,) and the time t (), and the
    share () of the way that could be gone; less than one, and coordinates NaN, where the branch ends before.

    Where the rows are open at the beginning (the place is of another design), they are closed along the way.
    """
    top = system.topology
    free = np.ones(top.num_velocities, psi.dtype)
    free[list(held)] = 0.0
    motion = (1.0 - free) * _coordinate_difference(top, place.psi, psi)
    held = _with_deformations(top, held)
    free[list(held)] = 0.0
    size = jnp.where(np.asarray(top.spins) > 0, 1.0, system.length).astype(psi.dtype)
    unit = row_scale(system).unit[top.position_rows].astype(psi.dtype)
    way = _Path(system, P, place, motion, t - place.t, jnp.asarray(free, psi.dtype), unit, size, held)

    def goes_on(step):
        return (
            (step.share < 1.0) & (step.passes < _MAX_PASSES) & ((step.passes == 0) | (step.length > _SHORTEST_SHARE))
        )

    step = lax.while_loop(goes_on, lambda step: _correct_step(way, step), _first_step(way))
    arrived = jnp.where(step.share >= 1.0, 1.0, jnp.nan).astype(psi.dtype)
    return BranchPoint(step.psi * arrived, t, step.slope, jnp.append(motion, way.duration)), step.share


def _with_deformations(top, held):
    """The held columns and independent deformations, which stay, where the other motions can close the loops."""
    both = tuple(dict.fromkeys((*held, *top.independent_deformations)))
    return both if top.analysis is None or len(both) <= top.num_velocities - top.analysis.rank else held


def _first_step(way):
    """A step of no length, which finds the rows where the way begins."""
    place, along = way.place, jnp.append(way.motion, way.duration)
    before = jnp.dot(place.along, place.along)
    slope = jnp.dot(place.along, along) / jnp.where(before > 0.0, before, 1.0) * place.slope
    number = lambda x: jnp.full((), x, along.dtype)
    mark = jnp.zeros(_mark_shape(way), along.dtype)
    still, closed = jnp.zeros_like(way.motion), jnp.zeros_like(way.unit)
    return _PathStep(
        0, number(0), number(0), place.psi, mark, slope, place.psi, still, number(0), number(jnp.inf), closed
    )


def _mark_shape(way):
    if linear_solver(way.system) == "frontal":
        return (len(loop_blocks(way.system, way.held)),)
    return len(way.unit), len(way.size)


def _correction(way, rows, gap):
    """The Newton step (nv,), in units of the columns' `size`, against a gap (position rows,); and the mark of the
    branch: the scaled rows, or without a matrix the signs of its blocks."""
    damping = _DAMPING[gap.dtype.itemsize]
    if isinstance(rows, FrontalRows):
        return -rows.damped_step(gap, damping) / way.size, branch_signs(way.system, rows, way.held)
    A, eye = way.unit[:, None] * rows.A * way.size[None], np.eye(len(way.size), dtype=gap.dtype)
    return -(spd_inverse(A.T @ A + damping * eye) @ (A.T @ (way.unit * gap))), A


def _correct_step(way, step):
    """One correction of the trial, and the next step where it was the last one."""
    precision, end = way.motion.dtype.itemsize, step.share + step.length
    is_last = end > 1.0 - _SHORTEST_SHARE
    f, rows = linearise_for_search(way.system, way.P, step.trial, way.place.t + end * way.duration, way.free)
    opening = jnp.where(step.passes == 0, f, step.opening)
    gap = f - (1.0 - end) * opening
    turn, mark = _correction(way, rows, gap)
    gap = way.unit * gap
    change, is_first = jnp.max(jnp.abs(turn)), jnp.isinf(step.last)
    shrinks = jnp.where(is_first, change <= _LARGEST_CORRECTION, change <= _CONTRACTION * step.last)
    enough = jnp.where(is_last, _END_TOLERANCE[precision], _PATH_TOLERANCE)
    closed = (shrinks & (change <= enough)) | (jnp.max(jnp.abs(gap), initial=0.0) <= _ROUNDING_RESIDUAL[precision])
    delta = way.size * turn
    step = step._replace(
        passes=step.passes + 1,
        trial=step_coordinates(way.system.topology, step.trial, delta),
        gone=step.gone + delta,
        first=jnp.where(is_first, change, step.first),
        last=change,
        opening=opening,
    )
    ends = closed & _is_on_branch(way, step, mark)
    forward, back = _next_step(way, step, jnp.where(is_last, 1.0, end), mark), _shorter_step(way, step)
    goes_on = ~closed & shrinks
    return _select_step(ends, forward, _select_step(goes_on, step, back))


def _select_step(condition, one, other):
    return _PathStep(*(jnp.where(condition, x, y) for x, y in zip(one, other, strict=True)))


def _is_on_branch(way, step, mark):
    """True if the trial is on the branch of the start: the rows' determinant has the same sign in each block.

    Or the step is so short that branches cross there, and went as predicted.
    """
    if mark.ndim == 1:
        same = jnp.all(step.mark * mark >= 0.0)  # zero at a singular pose, which is on either branch
    else:
        columns = ~np.isin(np.arange(len(way.size)), way.held)
        block = coupled_blocks(row_dependence(way.system) & columns)[1]
        pairs = step.mark.T @ mark + _SIGN_DAMPING * np.eye(len(way.size), dtype=mark.dtype)
        same = jnp.all(determinant_signs(pairs, block, 0.0) > 0)
    length = jnp.max(jnp.abs(step.gone / way.size))
    return same | ((length <= _CROSSING_LENGTH) & (step.first <= _LARGEST_CORRECTION * length))


def _next_step(way, step, share, mark):
    """The step after this one, longer or shorter as its correction was."""
    is_start = step.length == 0.0
    slope = jnp.where(is_start, step.slope, step.gone / jnp.where(is_start, 1.0, step.length))
    grows = jnp.clip(jnp.sqrt(_WANTED_CORRECTION / jnp.maximum(step.first, 1e-30)), 0.5, 2.0)
    longest = _LONGEST_STEP / jnp.maximum(jnp.max(jnp.abs((way.motion + slope) / way.size)), _LONGEST_STEP)
    length = jnp.minimum(jnp.where(is_start, longest, jnp.minimum(grows * step.length, longest)), 1.0 - share)
    return _predict_step(way, step._replace(share=share, psi=step.trial, mark=mark, slope=slope), length)


def _shorter_step(way, step):
    """The step repeated, a quarter as long."""
    return _predict_step(way, step, 0.25 * step.length)


def _predict_step(way, step, length):
    trial = step_coordinates(way.system.topology, step.psi, length * (way.motion + step.slope))
    return step._replace(length=length, trial=trial, gone=length * step.slope, last=jnp.full_like(step.last, jnp.inf))


def _coordinate_difference(topology, start, end):
    """The motion (nv,) that leads from coordinates to others: differences, of balls the least turn."""
    columns, coordinates = simple_columns(topology)
    motion = jnp.zeros(topology.num_velocities, end.dtype).at[columns].set((end - start)[coordinates])
    for first in topology.balls:
        at = topology.node_coordinate[first]
        p, q = start[at : at + 4] * np.array([1.0, -1.0, -1.0, -1.0], end.dtype), end[at : at + 4]
        motion = motion.at[first : first + 3].set(quaternion_log(quaternion_product(p, q)))
    return motion
