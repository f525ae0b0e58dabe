"""The loop of the primal-dual interior-point method: barrier parameter, curvature, verdict.

Source: Waechter and Biegler 2006, On the implementation of an interior-point filter line-search algorithm for
large-scale nonlinear programming; Nocedal and Wright, Numerical Optimization (2006), 18.3 and 19.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..math import _square as square
from ..runtime import with_library_calls
from ._barrier_derivatives import change_of_solution
from ._barrier_line_search import line_search, merit_along
from ._barrier_problem import BarrierProblem, BoundDistances, Iterate, bound_distances
from ._barrier_step import has_negative_curvature, newton_step, reduced_system

#: Why a search ended, by the number in `BarrierSolution.reason`.
REASONS = (
    "converged",
    "step limit",
    "no further step",
    "no design near satisfies all limits: their violation is least here",
    "unbounded: the objective falls without end",
    "non-finite",
    "a saddle or a maximum: the objective falls on both sides of the design found; begin beside it",
)
CONVERGED, STEP_LIMIT, STALLED, INFEASIBLE, UNBOUNDED, NOT_FINITE, SADDLE = range(7)
_STEEPEST = 100.0  # gradients above this at the start are scaled to it, as IPOPT does
_FLATTEST = 1e-2  # functions of which value and gradient are below this are scaled to one: they have small units
_NARROW = 1e-2  # distance of a start to its bounds, over the size of the bound or the width between both
_FAR = 1e12  # variable, and the square root of the objective, from which a problem has no minimum
_GIVEN_UP = 8  # steps in turn that do not lead on


class BarrierSolution(NamedTuple):
    """End of a search.

    Attributes:
        at: unknowns; value: f there.  Multipliers, residual and violation are of the scaled problem.
        residual: of the KKT conditions; violation: the largest one.
        factors: of f, e, c.
        search: with which it goes on, a step further; its curvature is that of the scaled problem.
        history: (steps + 1, 3) value of f, residual and evaluations where the problem asks for them.
    """

    at: Iterate
    value: Any
    residual: Any
    violation: Any
    steps: Any
    evaluations: Any
    reason: Any
    factors: Any
    search: Any
    history: Any


class SearchState(NamedTuple):
    """A search after any number of steps.

    Attributes:
        at: unknowns of the next point; before: of the last one, with functions (f, e, c) and their slopes.
        factors: of f, e, c; W: curvature; is_sized: it has the size of the problem's.
        weight: of the violation in the merit; raised: added to W after a step that was refused.
    """

    at: Any
    before: Any
    slopes: Any
    found: Any
    factors: Any
    W: Any
    is_sized: Any
    mu: Any
    weight: Any
    shift: Any
    raised: Any
    moved: Any
    stalled: Any
    steps: Any
    evaluations: Any
    residual: Any
    reason: Any


def first_iterate(problem: BarrierProblem, start: Array, warm: Iterate | None) -> Iterate:
    """The start, moved between its bounds, with least slacks, and multipliers, largest ones without a warm start."""
    lower, upper = problem.lower, problem.upper
    narrow = _NARROW if warm is None else 1e-6
    width = jnp.where(jnp.isfinite(upper - lower), upper - lower, jnp.inf)

    def off(bound):
        return jnp.minimum(narrow * jnp.maximum(jnp.abs(bound), 1.0), narrow * width)

    low = jnp.where(jnp.isfinite(lower), lower + off(jnp.where(jnp.isfinite(lower), lower, 0.0)), -jnp.inf)
    high = jnp.where(jnp.isfinite(upper), upper - off(jnp.where(jnp.isfinite(upper), upper, 0.0)), jnp.inf)
    x = jnp.where(lower < upper, jnp.clip(start, low, high), lower)
    p, m = problem.sizes(x)
    if warm is not None:
        return warm._replace(x=x, s=jnp.full_like(warm.s, 1e-6), z=jnp.maximum(warm.z, 1e-8))
    where, one = bound_distances(problem, x), jnp.ones_like(x)
    low, high = (jnp.where(mark, one, 0.0) for mark in (where.has_lower, where.has_upper))
    return Iterate(x, jnp.full(m, 1e-2, x.dtype), jnp.zeros(p, x.dtype), jnp.ones(m, x.dtype), low, high)


@eqx.filter_custom_jvp
def barrier_search(problem: BarrierProblem, first: SearchState, tolerance: float, steps: int) -> BarrierSolution:
    """Search on, some steps at most; derivatives of its end by the problem are by the implicit function theorem.

    Each pass of the loop evaluates the point that the last one stepped to, and steps on: derivatives are evaluated at
    one place of the program, values of trials at another.  The last step at the limit of steps is for a search that
    goes on: no point is evaluated twice.
    """
    dtype, is_fresh = first.at.x.dtype, first.steps == 0
    done = jnp.where(is_fresh, 0, first.steps - 1), jnp.where(is_fresh, 0, first.evaluations)
    known = jnp.stack([first.found[0] / first.factors[0], first.residual, jnp.zeros((), dtype)])
    history = jnp.full((steps + 1 if problem.has_history else 0, 3), jnp.nan, dtype).at[:1].set(known[None])

    def attempt(carry):
        search, history, _ = carry
        if len(search.at.x) > 1:  # a kernel of whole machines takes minutes to compile, and runs no faster
            search = search._replace(at=search.at._replace(x=with_library_calls(search.at.x)))
        search = _evaluated(problem, search, tolerance)
        made = search.steps - done[0]
        if problem.has_history:
            evaluations = search.evaluations - done[1]
            row = jnp.stack([search.found[0] / search.factors[0], search.residual, evaluations.astype(dtype)])
            history = history.at[made].set(row)
        goes_on = search.reason == STEP_LIMIT
        stepped = _stepped(problem, search, tolerance, goes_on)
        chosen = jax.tree.map(lambda a, b: jnp.where(goes_on, a, b), stepped, search)
        return chosen, history, ~goes_on | (made >= steps)

    search, history, _ = lax.while_loop(lambda carry: ~carry[2], attempt, (first, history, jnp.asarray(False)))
    _, e, c = search.found
    violation = jnp.maximum(jnp.max(jnp.abs(e), initial=0.0), jnp.max(c, initial=0.0))
    made = search.steps - done[0] - jnp.where(search.reason == STEP_LIMIT, 1, 0)
    reason = search.reason
    if problem.exact:
        where = bound_distances(problem, search.before.x)
        falls = has_negative_curvature(search.before, where, search.W, *search.slopes[1:])
        reason = jnp.where((reason == CONVERGED) & falls, SADDLE, reason)
    return BarrierSolution(
        search.before, search.found[0] / search.factors[0], search.residual, violation, made,
        search.evaluations - done[1], reason, search.factors, search, history,
    )  # fmt: skip


def first_state(problem: BarrierProblem, first: Iterate, curvature: Array | None, mu: Array | float) -> SearchState:
    """The state before the first step.

    curvature: (n, n) the first BFGS matrix, of a problem nearby; None: that of the first step.
    """
    n, (p, m), dtype = len(first.x), problem.sizes(first.x), first.x.dtype
    zero, count, no = jnp.zeros((), dtype), jnp.zeros((), jnp.int32), jnp.asarray(False)
    found = (zero, jnp.zeros(p, dtype), jnp.zeros(m, dtype))
    slopes = tuple(jnp.zeros((*part.shape, n), dtype) for part in found)
    W = jnp.eye(n, dtype=dtype) if curvature is None else curvature
    return SearchState(
        first, first, slopes, found, tuple(part + 1.0 for part in found), W, no | (curvature is not None),
        jnp.asarray(mu, dtype), zero, zero, zero, no, count, count, count + 1, zero, count + STEP_LIMIT,
    )  # fmt: skip


def _evaluated(problem, carry, tolerance):
    """The search with derivatives, curvature and verdict at its point."""
    is_first = carry.steps == 0
    raw, slopes = problem.slopes(carry.at.x)
    factors = carry.factors
    if problem.scaling != "none":
        first = _factors(raw, slopes, problem.scaling)
        factors = jax.tree.map(lambda a, b: jnp.where(is_first, a, b), first, factors)
    found = tuple(factor * part for factor, part in zip(factors, raw, strict=True))
    slopes = tuple(factor[..., None] * rows for factor, rows in zip(factors, slopes, strict=True))
    begun = _begun(carry.at, found, slopes, carry.mu, problem.is_warm)
    at = jax.tree.map(lambda a, b: jnp.where(is_first, a, b), begun, carry.at)
    where = bound_distances(problem, at.x)
    if problem.exact:
        W = problem.times(factors).hessian(at.x, (1.0, at.y, at.z))
        W = jnp.where(is_first | (carry.raised == 0.0), W, carry.W)
    else:
        W = jnp.where(is_first, factors[0] * carry.W, _bfgs(carry, at, slopes, where))
    W = W + carry.raised * jnp.eye(len(at.x))
    residual = _residual(at, where, found, slopes, jnp.zeros_like(carry.mu))
    residual = jnp.where(jnp.isfinite(found[0]), residual, jnp.nan)
    reason = _verdict(at, found, slopes, residual, carry.stalled, tolerance, where, is_first)
    return carry._replace(
        at=at, before=at, slopes=slopes, found=found, factors=factors, W=W, residual=residual, reason=reason
    )


def _factors(found, slopes, scaling):
    """Factors of the functions: to gradients of at most the steepest, all of a kind that are small to one, or the
    objective alone to one."""
    sizes = [jnp.max(jnp.abs(rows), axis=-1, initial=0.0) for rows in slopes]
    if scaling == "unit":
        usable = (sizes[0] > 0.0) & jnp.isfinite(sizes[0])
        return jnp.where(usable, 1.0 / jnp.where(usable, sizes[0], 1.0), 1.0), *map(jnp.ones_like, sizes[1:])
    finite = [jnp.where(jnp.isfinite(size), size, 1.0) for size in sizes]
    largest = [
        jnp.maximum(jnp.max(size, initial=0.0), jnp.max(jnp.where(jnp.isfinite(x), jnp.abs(x), 1.0), initial=0.0))
        for size, x in zip(finite, found, strict=True)
    ]
    return tuple(
        jnp.where(
            (one > 1e-30) & (one < _FLATTEST), 1.0 / jnp.maximum(one, 1e-30), jnp.minimum(1.0, _STEEPEST / size)
        )
        for size, one in zip([jnp.maximum(size, 1e-300) for size in finite], largest, strict=True)
    )


def _begun(first: Iterate, found, slopes, mu, is_warm) -> Iterate:
    """The first iterate, its slacks and multipliers by the functions there."""
    s = jnp.maximum(-found[2], first.s)
    at = first._replace(s=s, z=first.z if is_warm else jnp.minimum(mu / s, first.z))
    if not at.y.size:
        return at
    return at._replace(y=jnp.where(jnp.all(at.y == 0.0), _first_multipliers(at, slopes), at.y))


def _first_multipliers(at: Iterate, slopes):
    """Multipliers (p,) of the equations by least squares; zero where they would be large."""
    f, E, C = slopes
    squares = E @ E.T
    floor = 1e-8 * jnp.max(jnp.abs(squares), initial=1e-8)
    y = -square.solve(squares + floor * jnp.eye(len(squares)), E @ (f + at.z @ C - at.low + at.high))
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


def _next_mu(carry, where, tolerance):
    """The barrier parameter, lowered as long as its problem is solved at this point."""

    def solved(mu):
        return (_residual(carry.at, where, carry.found, carry.slopes, mu) <= 10.0 * mu) & (mu > tolerance / 10.0)

    lower = lambda mu: jnp.maximum(tolerance / 10.0, jnp.minimum(0.2 * mu, mu**1.5))
    return lax.while_loop(solved, lower, carry.mu)


def _stepped(problem, carry, tolerance, goes_on):
    """The search after a step, or at its point with more curvature where all of its trials were refused."""
    at, found, slopes = carry.at, carry.found, carry.slopes
    where = bound_distances(problem, at.x)
    system = reduced_system(at, where, carry.W, *slopes[1:], carry.shift)
    mu = _next_mu(carry, where, tolerance)
    step = newton_step(system, at, where, slopes[0], found[1], found[2] + at.s, mu)
    merit = merit_along(at, where, found, slopes, step, system, carry.W, mu, carry.weight, mu < carry.mu)
    trial, dual = line_search(
        problem.times(carry.factors), at, where, found, slopes, step, system, merit, mu, carry.stalled, goes_on
    )
    moves = trial.good & ~trial.restores  # multipliers go with Newton's step alone
    new = Iterate(
        trial.x, trial.s, at.y + trial.share * (step.y - at.y), at.z + dual * step.z, at.low + dual * step.low,
        at.high + dual * step.high,
    )  # fmt: skip
    restored = at._replace(x=trial.x, s=trial.s, y=jnp.zeros_like(at.y))
    new = jax.tree.map(lambda a, b, c: jnp.where(moves, a, jnp.where(trial.good, b, c)), new, restored, at)
    return carry._replace(
        at=_near_central_path(problem, new, mu),
        mu=mu,
        weight=merit.weight,
        shift=jnp.where(system.shift > 0.0, system.shift, carry.shift),
        raised=jnp.where(trial.good, 0.0, jnp.maximum(8.0 * system.shift, 1e-4)),
        moved=trial.good,
        stalled=jnp.where(moves & (trial.share > 1e-6), 0, carry.stalled + jnp.where(trial.good, 0, 1)),
        steps=carry.steps + 1,
        evaluations=carry.evaluations + trial.count,
    )


def _near_central_path(problem, at: Iterate, mu) -> Iterate:
    """The iterate with multipliers whose products with their distances are of the size of mu (IPOPT, (16))."""
    where = bound_distances(problem, at.x)
    near = lambda z, d: jnp.clip(z, mu / (1e10 * d), 1e10 * mu / d)
    return at._replace(
        z=near(at.z, at.s),
        low=jnp.where(where.has_lower, near(at.low, where.below), 0.0),
        high=jnp.where(where.has_upper, near(at.high, where.above), 0.0),
    )


def _verdict(at, found, slopes, residual, stalled, tolerance, where, is_first):
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
    reason = jnp.where(is_least & ~is_first, INFEASIBLE, reason)
    reason = jnp.where(is_far, UNBOUNDED, reason)
    reason = jnp.where(jnp.isfinite(residual), reason, NOT_FINITE)
    return jnp.where(residual <= tolerance, CONVERGED, reason).astype(jnp.int32)


def _bfgs(carry, new, slopes, where):
    """Damped BFGS matrix of the Lagrangian after a step (Powell 1978)."""
    W, step = carry.W, new.x - carry.before.x
    weights = lambda slopes: slopes[0] + new.y @ slopes[1] + new.z @ slopes[2]
    change = jnp.where(where.free, weights(slopes) - weights(carry.slopes), 0.0)
    bent = W @ step
    least, product = step @ bent, step @ change
    # the first matrix has the size of the curvature along the first step
    is_first = (carry.steps == 1) & (product > 0.0) & ~carry.is_sized
    unit = (change @ change) / jnp.where(product > 0.0, product, 1.0)
    W = jnp.where(is_first, unit * jnp.eye(len(step)), W)
    bent, least = jnp.where(is_first, unit * step, bent), jnp.where(is_first, unit * (step @ step), least)
    damp = jnp.where(product < 0.2 * least, 0.8 * least / jnp.where(least > product, least - product, 1.0), 1.0)
    change = damp * change + (1.0 - damp) * bent
    product = step @ change
    is_good = carry.moved & (product > 1e-14 * jnp.sqrt((step @ step) * (change @ change))) & (least > 0.0)
    rise = jnp.outer(change, change) / jnp.where(is_good, product, 1.0)
    fall = jnp.outer(bent, bent) / jnp.where(is_good, least, 1.0)
    return jnp.where(is_good, W + rise - fall, W)


@barrier_search.def_jvp
def _barrier_search_jvp(primals, tangents):
    found = barrier_search(*primals)
    change, value = change_of_solution(primals[0], tangents[0], found.factors, found.at)
    none = jax.tree.map(lambda x: None, found)
    return found, none._replace(at=change, value=value / found.factors[0])
