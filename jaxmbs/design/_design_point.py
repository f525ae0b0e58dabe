"""Design points in normal space: the nearest point of failure, and the worst point at a distance.

Both are a minimum under one equation, found by sequential quadratic programming with a damped BFGS matrix, of which
the first step is Hasofer and Lind's.  Of several tries in a step each is one gradient.

Source: Rackwitz and Fiessler 1978, Structural reliability under combined random load sequences; Liu and
Der Kiureghian 1991, Optimization algorithms for structural reliability; Tu, Choi and Park 1999, A new study on
reliability-based design optimization (the worst point at a distance).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ..math import _square as square

#: Why a search for a design point ended, by the number in `DesignPoint.reason`.
REASONS = (
    "converged",
    "step limit: it may have a kink where the nearest failure is; give more starts, or sample",
    "no further step: the limit state has a kink there, or its values are rough",
    "the limit state has no finite value or gradient at the start",
    "the limit state has no slope: no direction leads to failure",
    "the limit state is not finite at points tried near the start, though it is there: what it calls fails at them "
    "(a loop that does not close, a motion that ends): start it anew from the variables",
)
CONVERGED, STEP_LIMIT, STALLED, NOT_FINITE, FLAT, LOST = range(6)
_SHORTEST = 1e-8  # part of a step that is tried last
_DISTANCE = 3.0  # of first points from the medians, in deviations
MORE_STARTS = 8  # where no search from the medians ends


class DesignPoint(NamedTuple):
    """A design point in the space of independent standard normal numbers.

    Attributes:
        answer: reliability index of the nearest point of failure; value of the limit state at the worst point.
        u: (n,) the point.
        multiplier: of the equation.
        value, gradient: of the limit state there, (n,).
        evaluations: gradients that were evaluated.
        reason: number of the entry of `REASONS`.
    """

    answer: Any
    u: Any
    multiplier: Any
    value: Any
    gradient: Any
    evaluations: Any
    reason: Any


class NearestFailure(eqx.Module):
    """The point of failure g(u) = 0 with the least distance: minimise `u^2 / 2` subject to `g = 0`."""

    limit: Callable
    #: Points that have nothing before them to be compared with.
    unjudged = 1

    def on_equation(self, u):
        """The point itself: the equation is not known."""
        return u

    def parts(self, u, g, slope):
        """(objective, its gradient, equation, its gradient)."""
        return 0.5 * u @ u, u, g, slope

    def first_step(self, u, g, slope):
        """None: that of the search."""

    def first_scale(self, slope):
        """Inverse of the curvature that the search begins with."""
        return jnp.ones(())

    def rank(self, answer):
        """The nearer the better."""
        return jnp.abs(answer)

    def answer(self, u, g, slope):
        """Signed distance to the tangent of the limit state: negative where the origin fails."""
        return (g - slope @ u) / _length(slope)

    def answer_change(self, found, changed):
        """Change of the answer for a change of the limit state: the envelope theorem."""
        return changed(lambda problem: problem.limit(found.u)) / _length(found.gradient)


class WorstAtDistance(eqx.Module):
    """The point with the least g(u) at a distance from the origin: minimise g subject to `u^2 = distance^2`."""

    limit: Callable
    distance: Array
    #: Points that have nothing before them to be compared with: the origin, and the first on the sphere.
    unjudged = 2

    def on_equation(self, u):
        """The point moved to the sphere."""
        length = _length(u)
        return jnp.where(length > 0.0, self.distance / jnp.where(length > 0.0, length, 1.0), 1.0) * u

    def parts(self, u, g, slope):
        """(objective, its gradient, equation, its gradient)."""
        return g, slope, 0.5 * (u @ u - self.distance**2), u

    def first_step(self, u, g, slope):
        """Step to the sphere, down the slope."""
        return -self.distance * slope / _length(slope) - u

    def first_scale(self, slope):
        """Inverse of the curvature that the search begins with: that of the sphere."""
        return self.distance / _length(slope)

    def rank(self, answer):
        """The worse the better found."""
        return answer

    def answer(self, u, g, slope):
        """The limit state at the point."""
        return g

    def answer_change(self, found, changed):
        """Change of the answer for a change of the limit state or the distance."""
        lagrangian = lambda problem: problem.limit(found.u) - 0.5 * found.multiplier * problem.distance**2
        return changed(lagrangian)


@eqx.filter_custom_jvp
def find_design_point(
    problem: NearestFailure | WorstAtDistance, start: Array, tolerance: float, steps: int, reverse: bool, every: bool
) -> DesignPoint:  # fmt: skip
    """Find a design point from a start; its derivatives by the problem are by the implicit function theorem.

    Args:
        problem: whose `limit` is a pytree: `equinox.filter_closure_convert` makes one.
        start: (n,), or (k, n): of these one after another, until a search ends at a point.
        every: search from all of them; the best of their ends is the answer.
        tolerance: of the point, relative to its distance or to one.
        steps: gradients at most.
        reverse: mode of the gradient of the limit state.
    """
    if start.ndim == 1:
        return _search(problem, start, tolerance, steps, reverse)

    def unfinished(state):
        count, best = state
        return (count < len(start)) & (every | (best.reason != CONVERGED))

    def attempt(state):
        count, best = state
        found = _search(problem, start[count], tolerance, steps, reverse)
        better = (best.reason != CONVERGED) | (problem.rank(found.answer) < problem.rank(best.answer))
        better = (count == 0) | (better & (found.reason == CONVERGED))
        chosen = jax.tree.map(lambda a, b: jnp.where(better, a, b), found, best)
        return count + 1, chosen._replace(evaluations=best.evaluations + found.evaluations)

    none = _start(start[0])
    first = DesignPoint(none.g, none.u, none.multiplier, none.g, none.gradient, none.count, none.reason)
    return lax.while_loop(unfinished, attempt, (jnp.zeros((), jnp.int32), first))[1]


def _search(problem, start, tolerance, steps, reverse):
    """The end of a search from one start (n,)."""
    gradient = _slopes(problem.limit, reverse)

    def unfinished(carry):
        return (carry.reason == STEP_LIMIT) & (carry.count < steps)

    def attempt(carry):
        u = problem.on_equation(carry.u + carry.share * carry.step)
        g, slope = gradient(u)
        found = _accepted(problem, carry, u, g, slope, tolerance)
        shorter = carry._replace(share=0.25 * carry.share)
        is_finite = jnp.isfinite(g) & jnp.all(jnp.isfinite(slope))
        stalled = jnp.where(carry.count == 0, NOT_FINITE, jnp.where(shorter.share < _SHORTEST, STALLED, STEP_LIMIT))
        shorter = shorter._replace(reason=stalled.astype(jnp.int32), is_lost=carry.is_lost | ~is_finite)
        better = found.tried <= carry.merit + 1e-4 * carry.share * carry.slope_of_merit
        better = better | (carry.count < problem.unjudged)
        chosen = jax.tree.map(lambda a, b: jnp.where(is_finite & better, a, b), found, shorter)
        return chosen._replace(count=carry.count + 1)

    done = lax.while_loop(unfinished, attempt, _start(start))
    answer = problem.answer(done.u, done.g, done.gradient)
    is_lost = done.is_lost & ((done.reason == STEP_LIMIT) | (done.reason == STALLED))
    reason = jnp.where(is_lost, LOST, done.reason)
    return DesignPoint(answer, done.u, done.multiplier, done.g, done.gradient, done.count, reason)


@find_design_point.def_jvp
def _find_design_point_jvp(primals, tangents):
    problem, *_, reverse, _ = primals
    found = find_design_point(*primals)
    slopes = _slopes(problem.limit, reverse)

    def changed(function):
        change = eqx.filter_jvp(function, (problem,), (tangents[0],))[1]
        return jnp.zeros(()) if change is None else change

    def residual(problem, point):
        g, slope = _slopes(problem.limit, reverse)(point[0])
        _, gradient, equation, normal = problem.parts(point[0], g, slope)
        return jnp.concatenate([gradient + point[1] * normal, equation[None]])

    point = (found.u, found.multiplier)
    flat = jnp.concatenate([found.u, found.multiplier[None]])
    matrix = jax.jacfwd(lambda z: residual(problem, (z[:-1], z[-1])))(flat)
    by_problem = eqx.filter_jvp(lambda problem: residual(problem, point), (problem,), (tangents[0],))[1]
    moved = -square.solve(matrix, by_problem) if by_problem is not None else jnp.zeros_like(flat)
    g, slope = jax.jvp(slopes, (found.u,), (moved[:-1],))[1]
    g = g + changed(lambda problem: problem.limit(found.u))
    by_limit = eqx.filter_jvp(lambda problem: _slopes(problem.limit, reverse)(found.u)[1], (problem,), (tangents[0],))
    slope = slope if by_limit[1] is None else slope + by_limit[1]
    answer = problem.answer_change(found, changed)
    return found, DesignPoint(answer, moved[:-1], moved[-1], g, slope, None, None)


def first_points(n: int, number: int, seed: int) -> np.ndarray:
    """First points (number, n) of searches: the origin, and directions at the distance of rare events."""
    directions = np.random.default_rng(seed).normal(size=(number, n))
    directions[0] = 0.0
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    return _DISTANCE * directions / np.where(lengths > 0.0, lengths, 1.0)


class _State(NamedTuple):
    """A search: the point accepted last, the step from it and what is tried of it."""

    u: Any
    g: Any
    gradient: Any
    inverse: Any  # (n, n) of the curvature of the Lagrangian
    step: Any
    share: Any
    multiplier: Any
    merit: Any
    slope_of_merit: Any
    weight: Any
    tried: Any
    count: Any
    reason: Any
    is_lost: Any  # a point that was tried had no finite value


def _start(start):
    zero, n = jnp.zeros((), start.dtype), start.shape[0]
    none = jnp.zeros(n, start.dtype)
    count, reason = jnp.zeros((), jnp.int32), jnp.asarray(STEP_LIMIT, jnp.int32)
    return _State(
        start, zero, none, jnp.eye(n), none, zero + 1.0, zero, zero + jnp.inf, zero, zero, zero, count, reason,
        jnp.zeros((), bool),
    )  # fmt: skip


def _accepted(problem, carry, u, g, slope, tolerance):
    """The search at a point that it goes to: curvature, multiplier and next step."""
    f, gradient, equation, normal = problem.parts(u, g, slope)
    before = problem.parts(carry.u, carry.g, carry.gradient)
    tried = f + carry.weight * jnp.abs(equation)
    is_first = carry.count == 0
    step, multiplier = u - carry.u, carry.multiplier
    bent = gradient - before[1] + multiplier * (normal - before[3])
    expected = -carry.share * (before[1] + multiplier * before[3])  # the matrix times the step
    inverse = jnp.where(
        carry.count < problem.unjudged,
        problem.first_scale(slope) * jnp.eye(len(u)),
        _bfgs(carry.inverse, step, bent, expected),
    )
    across = normal @ inverse @ normal
    is_flat = ~(across > 0.0)
    multiplier = (equation - normal @ inverse @ gradient) / jnp.where(is_flat, 1.0, across)
    step = -inverse @ (gradient + multiplier * normal)
    first = problem.first_step(u, g, slope)
    if first is not None:
        step, is_flat = jnp.where(is_first, first, step), (is_flat & ~is_first) | ~(_length(slope) > 0.0)
    weight = jnp.where(
        is_first, 2.0 * jnp.abs(multiplier), jnp.maximum(1.5 * jnp.abs(multiplier), 0.5 * carry.weight)
    )
    found = _State(
        u, g, slope, inverse, step, jnp.ones_like(g), multiplier, f + weight * jnp.abs(equation),
        gradient @ step - weight * jnp.abs(equation), weight, tried, carry.count, carry.reason, carry.is_lost,
    )  # fmt: skip
    is_done = _is_optimal(u, gradient, equation, normal, tolerance)
    if first is not None:
        is_done = is_done & ~is_first
    reason = jnp.where(is_flat, FLAT, jnp.where(is_done, CONVERGED, STEP_LIMIT)).astype(jnp.int32)
    return found._replace(reason=reason)


def _is_optimal(u, gradient, equation, normal, tolerance):
    """True where the point is optimal: by the angle between both gradients and the distance to the equation."""
    size, length = jnp.maximum(_length(u), 1.0), _length(normal)
    unit = normal / jnp.where(length > 0.0, length, 1.0)
    across = gradient - (gradient @ unit) * unit
    largest = jnp.maximum(_length(gradient), 1e-300)
    is_steep = _length(across) > tolerance * jnp.where(length > 0.0, size * largest / _length_or_one(u), largest)
    return ~is_steep & (jnp.abs(equation) <= tolerance * size * length)


def _bfgs(inverse, step, bent, expected):
    """The inverse of a curvature after a step, damped so that it stays positive (Powell 1978)."""
    product, least = step @ bent, step @ expected
    damp = jnp.where(product < 0.2 * least, 0.8 * least / jnp.where(least > product, least - product, 1.0), 1.0)
    bent = damp * bent + (1.0 - damp) * expected
    product = step @ bent
    is_good = product > 1e-12 * _length(step) * _length(bent)
    ratio = 1.0 / jnp.where(is_good, product, 1.0)
    left = jnp.eye(len(step)) - ratio * jnp.outer(step, bent)
    return jnp.where(is_good, left @ inverse @ left.T + ratio * jnp.outer(step, step), inverse)


def _slopes(limit, reverse):
    """Function of u to (value, gradient)."""
    if reverse:
        return jax.value_and_grad(limit)
    return lambda u: jax.jacfwd(lambda u: (limit(u),) * 2, has_aux=True)(u)[::-1]


def _length(x):
    """Length of a vector, without the infinite slope of a root at zero."""
    square_sum = x @ x
    is_zero = square_sum == 0.0
    return jnp.where(is_zero, 0.0, jnp.sqrt(jnp.where(is_zero, 1.0, square_sum)))


def _length_or_one(x):
    length = _length(x)
    return jnp.where(length > 0.0, length, 1.0)
