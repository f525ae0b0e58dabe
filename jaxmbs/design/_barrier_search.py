"""The loop of the primal-dual interior-point method: barrier parameter, line search, curvature, verdict.

Source: Waechter and Biegler 2006, On the implementation of an interior-point filter line-search algorithm for
large-scale nonlinear programming; Nocedal and Wright, Numerical Optimization (2006), 18.3 and 19.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..math import _square as square
from ..math._spd import spd_inverse
from ._barrier_problem import BarrierProblem, BoundDistances, Iterate, bound_distances
from ._barrier_step import ReducedSystem, longest_steps, newton_step, reduced_system

#: Why a search ended, by the number in `BarrierSolution.reason`.
REASONS = (
    "converged",
    "step limit",
    "no further step",
    "no design near satisfies all limits: their violation is least here",
    "unbounded: the objective falls without end",
    "non-finite",
)
CONVERGED, STEP_LIMIT, STALLED, INFEASIBLE, UNBOUNDED, NOT_FINITE = range(6)
_FIRST_MU = 0.1
_NARROW = 1e-2  # distance of a start to its bounds, over the size of the bound or the width between both
_FAR = 1e12  # variable, and the square root of the objective, from which a problem has no minimum
_TRIES = 12  # halvings of a step, before the violation alone is lowered
_GIVEN_UP = 8  # steps in turn that do not lead on


class BarrierSolution(NamedTuple):
    """End of a search: unknowns, and the residual of the KKT conditions, scaled as for the tolerance."""

    at: Iterate
    residual: Any
    violation: Any
    steps: Any
    evaluations: Any
    reason: Any
    history: Any  # (steps + 1, 3) objective, residual and evaluations where the problem asks for them


class _Carry(NamedTuple):
    at: Any
    found: Any  # (f, e, c) at x
    slopes: Any  # their derivatives
    W: Any
    mu: Any
    weight: Any  # of the violation in the merit
    shift: Any
    stalled: Any
    steps: Any
    evaluations: Any
    residual: Any
    reason: Any


def first_iterate(problem: BarrierProblem, start: Array, warm: Iterate | None) -> Iterate:
    """The start, moved between its bounds, with slacks and multipliers."""
    lower, upper = problem.lower, problem.upper
    narrow = _NARROW if warm is None else 1e-6
    width = jnp.where(jnp.isfinite(upper - lower), upper - lower, jnp.inf)

    def off(bound):
        return jnp.minimum(narrow * jnp.maximum(jnp.abs(bound), 1.0), narrow * width)

    low = jnp.where(jnp.isfinite(lower), lower + off(jnp.where(jnp.isfinite(lower), lower, 0.0)), -jnp.inf)
    high = jnp.where(jnp.isfinite(upper), upper - off(jnp.where(jnp.isfinite(upper), upper, 0.0)), jnp.inf)
    x = jnp.where(lower < upper, jnp.clip(start, low, high), lower)
    if warm is not None:
        _, _, c = problem.functions(x)
        return warm._replace(x=x, s=jnp.maximum(-c, 1e-6), z=jnp.maximum(warm.z, 1e-8))
    _, e, c = problem.functions(x)
    where, one = bound_distances(problem, x), jnp.ones_like(x)
    low, high = (jnp.where(mark, one, 0.0) for mark in (where.has_lower, where.has_upper))
    slacks = jnp.maximum(-c, 1e-2)
    return Iterate(x, slacks, jnp.zeros_like(e), jnp.minimum(_FIRST_MU / slacks, 1.0), low, high)


@eqx.filter_custom_jvp
def barrier_search(
    problem: BarrierProblem, first: Iterate, mu: Array, tolerance: float, steps: int
) -> BarrierSolution:
    """Search from a first iterate; its derivatives by the problem are by the implicit function theorem."""

    def unfinished(carry):
        return (carry.reason == STEP_LIMIT) & (carry.steps < steps)

    def attempt(carry):
        where = bound_distances(problem, carry.at.x)
        system = reduced_system(carry.at, where, carry.W, *carry.slopes[1:], carry.shift)
        mu = _next_mu(problem, carry, where, tolerance)
        return _stepped(problem, carry._replace(mu=mu), where, system, tolerance)

    def recorded(carry, history):
        if not problem.has_history:
            return history
        row = jnp.stack([carry.found[0], carry.residual, carry.evaluations.astype(history.dtype)])
        return history.at[carry.steps].set(row)

    def attempt_and_record(state):
        carry = attempt(state[0])
        return carry, recorded(carry, state[1])

    begin = _begin(problem, first, mu, tolerance)
    history = recorded(begin, jnp.full((steps + 1 if problem.has_history else 0, 3), jnp.nan, first.x.dtype))
    done, history = lax.while_loop(lambda state: unfinished(state[0]), attempt_and_record, (begin, history))
    _, e, c = done.found
    violation = jnp.maximum(jnp.max(jnp.abs(e), initial=0.0), jnp.max(c, initial=0.0))
    return BarrierSolution(done.at, done.residual, violation, done.steps, done.evaluations, done.reason, history)


def _begin(problem, first, mu, tolerance):
    found, slopes = problem.slopes(first.x)
    n, zero = len(first.x), jnp.zeros((), first.x.dtype)
    at = first._replace(y=jnp.where(jnp.all(first.y == 0.0), _first_multipliers(first, slopes), first.y))
    W = problem.hessian(at.x, (1.0, at.y, at.z)) if problem.exact else jnp.eye(n)
    is_finite = jnp.isfinite(found[0]) & jnp.all(jnp.isfinite(found[1])) & jnp.all(jnp.isfinite(found[2]))
    is_finite = is_finite & jnp.all(jnp.isfinite(slopes[0]))
    count = jnp.zeros((), jnp.int32)
    reason = jnp.where(is_finite, STEP_LIMIT, NOT_FINITE).astype(jnp.int32)
    residual = _residual(at, bound_distances(problem, at.x), found, slopes, zero)
    reason = jnp.where(residual <= tolerance, CONVERGED, reason).astype(jnp.int32)
    return _Carry(at, found, slopes, W, mu, zero + 1.0, zero, count, count, count + 1, residual, reason)


def _first_multipliers(at: Iterate, slopes):
    """Multipliers (p,) of the equations by least squares; zero where they would be large."""
    f, E, C = slopes
    squares = E @ E.T
    p = squares.shape[0]
    floor = 1e-8 * jnp.max(jnp.abs(squares), initial=1e-8)
    y = -square.solve(squares + floor * jnp.eye(p), E @ (f + at.z @ C - at.low + at.high)) if p else at.y
    return jnp.where(jnp.max(jnp.abs(y), initial=0.0) < 1e3, y, 0.0)


def _residual(at: Iterate, where: BoundDistances, found, slopes, mu):
    """Largest violation of the KKT conditions of the barrier problem, over the sizes of its multipliers."""
    f, e, c = slopes
    dual = jnp.where(where.free, f + at.y @ e + at.z @ c - at.low + at.high, 0.0)
    products = (at.s * at.z, where.below * at.low, where.above * at.high)
    sizes = jnp.concatenate([jnp.abs(part) for part in (at.y, at.z, at.low, at.high)])
    scale = jnp.maximum(jnp.mean(sizes), 100.0) / 100.0
    marks = (jnp.ones_like(at.s, bool), where.has_lower, where.has_upper)
    slack = [jnp.max(jnp.abs(jnp.where(k, x - mu, 0.0)), initial=0.0) for k, x in zip(marks, products, strict=True)]
    primal = jnp.maximum(jnp.max(jnp.abs(found[1]), initial=0.0), jnp.max(jnp.abs(found[2] + at.s), initial=0.0))
    return jnp.maximum(jnp.maximum(jnp.max(jnp.abs(dual)), sum(slack[1:], slack[0])) / scale, primal)


def _next_mu(problem, carry, where, tolerance):
    """The barrier parameter, lowered as long as its problem is solved at this point."""

    def solved(mu):
        return (_residual(carry.at, where, carry.found, carry.slopes, mu) <= 10.0 * mu) & (mu > tolerance / 10.0)

    lower = lambda mu: jnp.maximum(tolerance / 10.0, jnp.minimum(0.2 * mu, mu**1.5))
    return lax.while_loop(solved, lower, carry.mu)


def _merit(at, where, found, mu, weight):
    """Objective with barriers, and the violation times its weight."""
    logs = jnp.sum(jnp.log(at.s)) + jnp.sum(jnp.log(where.below)) + jnp.sum(jnp.log(where.above))
    violation = jnp.sum(jnp.abs(found[1])) + jnp.sum(jnp.abs(found[2] + at.s))
    return found[0] - mu * logs + weight * violation, violation


def _stepped(problem, carry, where, system: ReducedSystem, tolerance):
    """The search after a step along the Newton direction, with a second-order correction if it is refused."""
    at, (_, e, c), slopes, mu = carry.at, carry.found, carry.slopes, carry.mu
    gap = c + at.s
    step = newton_step(system, at, where, slopes[0], e, gap, mu)
    longest, dual = longest_steps(at, step, where, mu)
    violation = jnp.sum(jnp.abs(e)) + jnp.sum(jnp.abs(gap))
    slope = slopes[0] @ step.x - mu * jnp.sum(step.s / at.s)
    slope = slope - mu * jnp.sum(jnp.where(where.has_lower, step.x / where.below, 0.0))
    slope = slope + mu * jnp.sum(jnp.where(where.has_upper, step.x / where.above, 0.0))
    bent = 0.5 * jnp.maximum(step.x @ (carry.W @ step.x) + jnp.sum(system.stiffness * step.s**2), 0.0)
    needed = jnp.where(violation > 0.0, (slope + bent) / (0.9 * jnp.where(violation > 0.0, violation, 1.0)), 0.0)
    weight = jnp.maximum(jnp.where(needed > carry.weight, 1.2 * needed, carry.weight), 1e-8)
    before, _ = _merit(at, where, carry.found, mu, weight)
    falls = slope - weight * violation
    rounding = 1e-13 * (jnp.abs(before) + 1.0)

    def moved(share, step):
        x, s = at.x + share * step.x, at.s + share * step.s
        return at._replace(x=jnp.where(where.free, x, at.x), s=s)

    def kept(trial, c):
        """With slacks that are those of the trial where it keeps an inequality: of hundreds of curved ones the gaps
        to their tangents would refuse every step."""
        return trial._replace(s=jnp.where(-c >= jnp.minimum(0.01, mu) * at.s, -c, trial.s))

    def judged(share, step):
        trial = moved(share, step)
        found = problem.functions(trial.x)
        merit, _ = _merit(kept(trial, found[2]), bound_distances(problem, trial.x), found, mu, weight)
        return found, merit <= before + 1e-4 * share * jnp.minimum(falls, 0.0) + rounding

    def refused(state):
        return ~state[2] & (state[3] < _TRIES)

    def shorter(state):
        share, found, _, tries, _, _ = state
        # after the first refusal the constraints are solved again at the trial: a step along curved ones is refused
        fixed = newton_step(
            system,
            at,
            where,
            slopes[0],
            longest * e + found[1],
            longest * gap + found[2] + at.s + longest * step.s,
            mu,
        )
        room_left, _ = longest_steps(at, fixed, where, mu)
        corrected = (tries == 0) & jnp.all(jnp.isfinite(found[2])) & jnp.all(jnp.isfinite(found[1]))
        corrected = corrected & (violation > 0.0)
        first = tries <= 1
        share = jnp.where(corrected, room_left, jnp.where(first, 0.5 * longest, 0.5 * share))
        chosen = jax.tree.map(lambda a, b: jnp.where(corrected, a, b), fixed, step)
        found, good = judged(share, chosen)
        return share, found, good, tries + 1, chosen.x, chosen.s

    found, good = judged(longest, step)
    state = (longest, found, good, jnp.zeros((), jnp.int32), step.x, step.s)
    share, found, good, tries, dx, ds = lax.while_loop(refused, shorter, state)
    trial = kept(moved(share, step._replace(x=dx, s=ds)), found[2])
    carry = carry._replace(weight=weight)
    trial, good, is_restored = _restored_if_refused(problem, carry, where, trial, good)
    return _accepted_step(problem, carry, system, step, trial, good, is_restored, (share, dual, tries), tolerance)


def _restored_if_refused(problem, carry, where, trial, good):
    """The trial, or where it was refused a step towards the limits: (iterate, True if one was taken, True for that).

    A loop of one pass for a condition: side by side it is run where any search asks for it, no more.
    """

    def restore(state):
        new, taken, _ = _towards_limits(problem, carry, where)
        return new, taken, taken, jnp.asarray(True)

    state = (trial, good, jnp.asarray(False), good)
    return lax.while_loop(lambda state: ~state[3], restore, state)[:3]


def _towards_limits(problem, carry, where):
    """(iterate, True if it was taken, the same) after a step of Levenberg and Marquardt that lowers the violation."""
    at, (_, e, c) = carry.at, carry.found
    E, C = (jnp.where(where.free[None], rows, 0.0) for rows in carry.slopes[1:])
    over = jnp.maximum(c, 0.0)
    J = jnp.concatenate([E, jnp.where((c > 0.0)[:, None], C, 0.0)])
    descent = e @ E + over @ C
    n = len(at.x)
    damping = 1e-4 * 8.0 ** carry.stalled.astype(e.dtype) * jnp.maximum(jnp.max(jnp.abs(J), initial=0.0) ** 2, 1e-8)
    dx = -spd_inverse(J.T @ J + damping * jnp.eye(n)) @ descent
    none = jax.tree.map(jnp.zeros_like, at)
    share, _ = longest_steps(at, none._replace(x=dx), where, carry.mu)
    x = at.x + share * dx
    _, e_new, c_new = problem.functions(x)
    before, after = (a @ a + jnp.maximum(b, 0.0) @ jnp.maximum(b, 0.0) for a, b in ((e, c), (e_new, c_new)))
    good = (after < before) & jnp.isfinite(after)
    new = at._replace(x=jnp.where(good, x, at.x), s=jnp.where(good, jnp.maximum(at.s, -c_new), at.s))
    return new, good, good


def _accepted_step(problem, carry, system, step, trial, good, is_restored, outcome, tolerance):
    """The search at a trial that was taken, or at its point with more curvature."""
    at, mu = carry.at, carry.mu
    share, dual, tries = outcome
    moves = good & ~is_restored  # multipliers go with Newton's step alone
    new = Iterate(
        trial.x, trial.s, at.y + share * (step.y - at.y), at.z + dual * step.z, at.low + dual * step.low,
        at.high + dual * step.high,
    )  # fmt: skip
    new = jax.tree.map(lambda a, b: jnp.where(moves, a, b), new, trial)
    new = new._replace(y=jnp.where(is_restored, 0.0, new.y))
    beyond = bound_distances(problem, new.x)
    near = lambda z, d: jnp.clip(z, mu / (1e10 * d), 1e10 * mu / d)
    new = new._replace(
        z=near(new.z, new.s),
        low=jnp.where(beyond.has_lower, near(new.low, beyond.below), 0.0),
        high=jnp.where(beyond.has_upper, near(new.high, beyond.above), 0.0),
    )
    found, slopes = problem.slopes(new.x)
    W = problem.hessian(new.x, (1.0, new.y, new.z)) if problem.exact else _bfgs(carry, new, slopes, beyond, good)
    residual = _residual(new, beyond, found, slopes, jnp.zeros_like(mu))
    stalled = jnp.where(moves & (share > 1e-6), 0, carry.stalled + jnp.where(good, 0, 1))
    raised = jnp.maximum(8.0 * system.shift, 1e-4)
    W = jnp.where(good, W, carry.W + raised * jnp.eye(len(new.x)))
    shift = jnp.where(system.shift > 0.0, system.shift, carry.shift)
    reason = _verdict(new, found, slopes, residual, stalled, tolerance, beyond)
    return _Carry(
        new, found, slopes, W, mu, carry.weight, shift, stalled, carry.steps + 1,
        carry.evaluations + tries + jnp.where(moves, 1, 2), residual, reason,
    )  # fmt: skip


def _verdict(at, found, slopes, residual, stalled, tolerance, where):
    """Number of the reason to end, or that of the step limit."""
    f, e, c = found
    over = jnp.maximum(c, 0.0)
    size = jnp.sqrt(e @ e + over @ over)
    descent = e @ slopes[1] + over @ slopes[2]  # of half the squared violation
    inward = jnp.where(where.has_lower & (descent > 0.0), jnp.minimum(where.below, 1.0), 1.0)
    inward = inward * jnp.where(where.has_upper & (descent < 0.0), jnp.minimum(where.above, 1.0), 1.0)
    descent = jnp.where(where.free, descent * inward, 0.0)
    is_least = (size > 100.0 * tolerance) & (jnp.max(jnp.abs(descent)) <= 1e-6 * size)
    is_far = (jnp.max(jnp.abs(at.x)) > _FAR) | (f < -(_FAR**2))
    reason = jnp.where(stalled >= _GIVEN_UP, STALLED, STEP_LIMIT)
    reason = jnp.where(is_least, INFEASIBLE, reason)
    reason = jnp.where(is_far, UNBOUNDED, reason)
    reason = jnp.where(jnp.isfinite(residual), reason, NOT_FINITE)
    return jnp.where(residual <= tolerance, CONVERGED, reason).astype(jnp.int32)


def _bfgs(carry, new, slopes, where, good):
    """Damped BFGS matrix of the Lagrangian after a step (Powell 1978)."""
    W, step = carry.W, new.x - carry.at.x
    weights = lambda slopes: slopes[0] + new.y @ slopes[1] + new.z @ slopes[2]
    change = jnp.where(where.free, weights(slopes) - weights(carry.slopes), 0.0)
    bent = W @ step
    least, product = step @ bent, step @ change
    # the first matrix has the size of the curvature along the first step
    is_first = (carry.steps == 0) & (product > 0.0)
    unit = (change @ change) / jnp.where(product > 0.0, product, 1.0)
    W = jnp.where(is_first, unit * jnp.eye(len(step)), W)
    bent, least = jnp.where(is_first, unit * step, bent), jnp.where(is_first, unit * (step @ step), least)
    damp = jnp.where(product < 0.2 * least, 0.8 * least / jnp.where(least > product, least - product, 1.0), 1.0)
    change = damp * change + (1.0 - damp) * bent
    product = step @ change
    is_good = good & (product > 1e-14 * jnp.sqrt((step @ step) * (change @ change))) & (least > 0.0)
    rise = jnp.outer(change, change) / jnp.where(is_good, product, 1.0)
    fall = jnp.outer(bent, bent) / jnp.where(is_good, least, 1.0)
    return jnp.where(is_good, W + rise - fall, W)


@barrier_search.def_jvp
def _barrier_search_jvp(primals, tangents):
    problem = primals[0]
    found = barrier_search(*primals)
    at = found.at
    where = bound_distances(problem, at.x)
    _, slopes = problem.slopes(at.x)
    W = problem.hessian(at.x, (1.0, at.y, at.z))
    system = reduced_system(at, where, W, slopes[1], slopes[2], jnp.zeros(()))

    def gradient(problem):
        f, e, c = problem.slopes(at.x)[1]
        return f + at.y @ e + at.z @ c

    def parts(problem):
        _, e, c = problem.functions(at.x)
        return gradient(problem), e, c, problem.lower, problem.upper

    change = eqx.filter_jvp(parts, (problem,), (tangents[0],))[1]
    if change is None:
        change = (None,) * 5
    like = (at.x, at.y, at.z, at.x, at.x)
    by_x, by_e, by_c, lower, upper = (
        jnp.zeros_like(b) if a is None else a for a, b in zip(change, like, strict=True)
    )
    lower, upper = jnp.where(where.has_lower, lower, 0.0), jnp.where(where.has_upper, upper, 0.0)
    step = _solve_refined(system, W, where.free, (jnp.where(where.free, -by_x, 0.0), -by_e, -by_c, lower, upper))
    return found, BarrierSolution(step._replace(s=-step.z / system.stiffness), None, None, None, None, None, None)


def _solve_refined(system: ReducedSystem, W, free, rights) -> Iterate:
    """Changes of the unknowns for changes of the KKT conditions, refined in the conditions before they were reduced:
    of a limit that is active the reduced ones know the multiplier to half of the digits."""
    E, C = system.equations, system.inequalities

    def once(by_x, by_e, by_c, lower, upper):
        right = by_x + C.T @ (system.stiffness * by_c) + system.low * lower + system.high * upper
        dx, dy = system.solve(right, by_e)
        dz = system.stiffness * (C @ dx - by_c)
        return Iterate(dx, None, dy, dz, -system.low * (dx - lower), system.high * (dx - upper))

    def over(multiplier, stiffness):
        return jnp.where(stiffness > 0.0, multiplier / jnp.where(stiffness > 0.0, stiffness, 1.0), 0.0)

    step = once(*rights)
    for _ in range(2):
        by_x, by_e, by_c, lower, upper = rights
        left = (
            by_x - (W @ step.x + E.T @ step.y + C.T @ step.z - step.low + step.high),
            by_e - E @ step.x,
            by_c - C @ step.x + over(step.z, system.stiffness),
            jnp.where(system.low > 0.0, lower - step.x - over(step.low, system.low), 0.0),
            jnp.where(system.high > 0.0, upper - step.x + over(step.high, system.high), 0.0),
        )
        more = once(jnp.where(free, left[0], 0.0), *left[1:])
        step = Iterate(*(None if a is None else a + b for a, b in zip(step, more, strict=True)))
    return step
