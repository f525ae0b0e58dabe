"""The line search of the interior-point method: trials along a Newton step, corrections, and steps towards limits.

The functions are evaluated at one place of the program, whatever a trial is for: they are most of what is compiled.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..math._spd import spd_inverse
from ._barrier_problem import BarrierProblem, BoundDistances, Iterate, bound_distances
from ._barrier_step import ReducedSystem, longest_steps, newton_step

_TRIES = 13  # trials along Newton's step, before the violation alone is lowered
_CORRECTIONS = 4  # second-order corrections of its first trial at most, as IPOPT has them


class Trial(NamedTuple):
    """A step that was tried last.

    Attributes:
        x, s: where it leads.
        share: of the step that it is.
        halved: part of Newton's step that was tried last.
        found: functions (f, e, c) there.
        left: residuals (of e, c + s) that a correction solves for.
        violation: sum of those at the trial.
        good: it was taken; restores: it is one towards the limits; corrects: the last one was a correction, or the
            first trial.
        halvings, count: of trials along Newton's step, and of all.
    """

    x: Any
    s: Any
    share: Any
    halved: Any
    found: Any
    left: Any
    violation: Any
    good: Any
    restores: Any
    corrects: Any
    halvings: Any
    count: Any


class Merit(NamedTuple):
    """The merit of a point, and what a step along the Newton direction changes of it.

    Attributes: value, to first order falls (), with the weight of the violation; violation: of the point.
    """

    value: Any
    falls: Any
    weight: Any
    violation: Any


def merit_along(
    at: Iterate, where: BoundDistances, found: tuple, slopes: tuple, step: Iterate, system: ReducedSystem, W: Array,
    mu: Array, weight: Array, is_new: Array,
) -> Merit:  # fmt: skip
    """The merit at a point and along a Newton step, with a weight of the violation that makes it fall, and that is
    above the multipliers.

    weight: the last one, which is kept where it suffices; is_new: not so, the barrier parameter has changed. One that
    is far above the multipliers lets a search only creep along curved limits.

    Source: Nocedal and Wright, Numerical Optimization (2006), (18.32), (18.36).
    """
    _, e, c = found
    violation = jnp.sum(jnp.abs(e)) + jnp.sum(jnp.abs(c + at.s))
    slope = slopes[0] @ step.x - mu * jnp.sum(step.s / at.s)
    slope = slope - mu * jnp.sum(jnp.where(where.has_lower, step.x / where.below, 0.0))
    slope = slope + mu * jnp.sum(jnp.where(where.has_upper, step.x / where.above, 0.0))
    bent = 0.5 * jnp.maximum(step.x @ (W @ step.x) + jnp.sum(system.stiffness * step.s**2), 0.0)
    needed = jnp.where(violation > 0.0, (slope + bent) / (0.9 * jnp.where(violation > 0.0, violation, 1.0)), 0.0)
    multipliers = jnp.concatenate([jnp.abs(step.y), jnp.abs(at.z + step.z)])
    needed = jnp.maximum(jnp.maximum(needed, jnp.max(multipliers, initial=0.0)), 1e-8)
    weight = jnp.where((needed > weight) | is_new, 1.2 * needed, weight)
    return Merit(_merit(at.s, where, found, mu, weight), slope - weight * violation, weight, violation)


def line_search(
    problem: BarrierProblem, at: Iterate, where: BoundDistances, found: tuple, slopes: tuple, step: Iterate,
    system: ReducedSystem, merit: Merit, mu: Array, stalled: Array, wanted: Array,
) -> tuple[Trial, Array]:  # fmt: skip
    """The first trial that lowers the merit, and the part of the step that its multipliers may go.

    After a first refusal the constraints are solved again at the trial, as long as that lowers their violation: a
    full step along curved ones is refused.  Then steps are halved; the last trial lowers the violation alone.
    wanted: False tries nothing.

    Source: Waechter and Biegler 2006, 2.4.
    """
    _, e, c = found
    gap = c + at.s
    longest, dual = longest_steps(at, step, where, mu)
    rounding = 1e-13 * (jnp.abs(merit.value) + 1.0)

    def refused(trial):
        return wanted & ~trial.good & ~trial.restores

    def attempt(trial):
        is_first, restores = trial.count == 0, trial.halvings >= _TRIES
        corrects = trial.corrects & ~is_first & jnp.isfinite(trial.violation) & (merit.violation > 0.0)
        again = newton_step(system, at, where, slopes[0], *trial.left, mu)
        room = longest_steps(at, again, where, mu)[0]
        halved = jnp.where(is_first, longest, jnp.where(corrects, trial.halved, 0.5 * trial.halved))
        share = jnp.where(corrects, room, halved)
        towards, part = _towards_limits(at, where, found, slopes, stalled, mu, restores & ~corrects)
        restores = restores & ~corrects
        dx = jnp.where(restores, part * towards, share * jnp.where(corrects, again.x, step.x))
        ds = jnp.where(restores, 0.0, share * jnp.where(corrects, again.s, step.s))
        x, s = jnp.where(where.free, at.x + dx, at.x), at.s + ds
        new = problem.functions(x)
        left = (share * trial.left[0] + new[1], share * trial.left[1] + new[2] + s)
        violation = jnp.sum(jnp.abs(new[1])) + jnp.sum(jnp.abs(new[2] + s))
        # with slacks that are those of the trial where it keeps an inequality: of hundreds of curved ones the gaps
        # to their tangents would refuse every step
        kept = jnp.where(-new[2] >= jnp.minimum(0.01, mu) * s, -new[2], s)
        s = jnp.where(restores, jnp.maximum(at.s, -new[2]), kept)
        value = _merit(s, bound_distances(problem, x), new, mu, merit.weight)
        lowers = value <= merit.value + 1e-4 * share * jnp.minimum(merit.falls, 0.0) + rounding
        good = jnp.where(restores, _violation(new) < _violation(found), lowers)
        goes_on = is_first | (corrects & (violation < 0.99 * trial.violation) & (trial.count < _CORRECTIONS))
        return Trial(
            x, s, share, halved, new, left, violation, good, restores, goes_on,
            trial.halvings + jnp.where(corrects, 0, 1), trial.count + 1,
        )  # fmt: skip

    no, none = jnp.asarray(False), jnp.zeros((), jnp.int32)
    first = Trial(at.x, at.s, longest, longest, found, (e, gap), merit.violation, no, no, no, none, none)
    return lax.while_loop(refused, attempt, first), dual


def _merit(s, where, found, mu, weight):
    """Objective with barriers, and the violation times its weight."""
    logs = jnp.sum(jnp.log(s)) + jnp.sum(jnp.log(where.below)) + jnp.sum(jnp.log(where.above))
    violation = jnp.sum(jnp.abs(found[1])) + jnp.sum(jnp.abs(found[2] + s))
    return found[0] - mu * logs + weight * violation


def _violation(found):
    """Sum of the squared violations."""
    over = jnp.maximum(found[2], 0.0)
    return found[1] @ found[1] + over @ over


def _towards_limits(at, where, found, slopes, stalled, mu, wanted):
    """Step (n,) of Levenberg and Marquardt that lowers the violation, and the part of it that bounds leave.

    A loop of one pass for a condition: side by side it is run where any search wants it, no more.
    """
    _, e, c = found

    def solve(state):
        E, C = (jnp.where(where.free[None], rows, 0.0) for rows in slopes[1:])
        over = jnp.maximum(c, 0.0)
        J = jnp.concatenate([E, jnp.where((c > 0.0)[:, None], C, 0.0)])
        largest = jnp.maximum(jnp.max(jnp.abs(J), initial=0.0) ** 2, 1e-8)
        damping = 1e-4 * 8.0 ** stalled.astype(e.dtype) * largest
        return -spd_inverse(J.T @ J + damping * jnp.eye(len(at.x))) @ (e @ E + over @ C), jnp.asarray(False)

    dx, _ = lax.while_loop(lambda state: state[1], solve, (jnp.zeros_like(at.x), wanted))
    none = jax.tree.map(jnp.zeros_like, at)
    return dx, longest_steps(at, none._replace(x=dx), where, mu)[0]
