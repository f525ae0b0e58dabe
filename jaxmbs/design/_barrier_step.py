"""One step of the primal-dual interior-point method: the reduced system, its inertia, and the solution."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jax import Array, lax

from ..math import _square as square
from ..math._spd import spd_inverse
from ._barrier_problem import BoundDistances, Iterate


class ReducedSystem(NamedTuple):
    """The system of steps in x and of multipliers y of equations, slacks and other multipliers eliminated.

    Attributes:
        curvature: (n, n) with barriers and the shift.
        inverse: (n, n) of the curvature with the squares of the equations.
        schur: (p, p) inverse of `E inverse E^T`.
        equations, inequalities: Jacobians (p, n), (m, n).
        stiffness: (m,) z / s; low, high (n,): of bounds.
        weight: of the squares of the equations that were added to the curvature.
        shift: added to the curvature's diagonal.
    """

    curvature: Array
    inverse: Array
    schur: Array
    equations: Array
    inequalities: Array
    stiffness: Array
    low: Array
    high: Array
    weight: Array
    shift: Array

    def solve(self, right: Array, gap: Array) -> tuple[Array, Array]:
        """(dx (n,), dy (p,)) of `H dx + E^T dy = right`, `E dx = gap`, refined: barriers make H stiff near limits."""
        dx, dy = self._solve_once(right, gap)
        for _ in range(2):
            left = right - self.curvature @ dx - self.equations.T @ dy
            more = self._solve_once(left, gap - self.equations @ dx)
            dx, dy = dx + more[0], dy + more[1]
        return dx, dy

    def _solve_once(self, right: Array, gap: Array) -> tuple[Array, Array]:
        right = right + self.weight * self.equations.T @ gap
        dy = self.schur @ (self.equations @ (self.inverse @ right) - gap)
        return self.inverse @ (right - self.equations.T @ dy), dy


def reduced_system(at: Iterate, where: BoundDistances, W: Array, E: Array, C: Array, last: Array) -> ReducedSystem:
    """The reduced system, with a shift that gives it the inertia of a minimum: a third of the last one times eights.

    Source: Waechter and Biegler 2006, On the implementation of an interior-point filter line-search algorithm, 3.1.
    """
    n = W.shape[0]
    H, E, squares, weight, stiffness, low, high = _with_barriers(at, where, W, E, C)
    least = jnp.where(last > 0.0, jnp.maximum(last / 3.0, 1e-20), 1e-4)

    def inverted(shift):
        return spd_inverse(H + weight * squares + shift * jnp.eye(n))

    def unfinished(carry):
        return ~jnp.all(jnp.isfinite(carry[1])) & (carry[0] < 1e20)

    def raised(carry):
        shift = jnp.where(carry[0] == 0.0, least, 8.0 * carry[0])
        return shift, inverted(shift)

    zero = jnp.zeros((), W.dtype)
    shift, inverse = lax.while_loop(unfinished, raised, (zero, inverted(zero)))
    inner = E @ inverse @ E.T
    p = inner.shape[0]
    floor = 1e-12 * jnp.maximum(jnp.max(jnp.abs(inner), initial=0.0), 1e-300)
    schur = square.solve(inner + floor * jnp.eye(p), jnp.eye(p)) if p else inner
    curvature = H + shift * jnp.eye(n)
    return ReducedSystem(
        curvature, inverse, schur, E, jnp.where(where.free[None], C, 0.0), stiffness, low, high, weight, shift
    )


def has_negative_curvature(at: Iterate, where: BoundDistances, W: Array, E: Array, C: Array) -> Array:
    """True where the Lagrangian falls to second order along a direction that equations and active limits leave."""
    H, _, squares, weight, *_ = _with_barriers(at, where, W, E, C)
    small = 1e-6 * jnp.max(jnp.abs(W), initial=0.0) + 1e-14 * jnp.max(jnp.abs(H), initial=1e-300)
    inverse = spd_inverse(H + weight * squares + small * jnp.eye(len(W)))
    return ~jnp.all(jnp.isfinite(inverse)) & jnp.all(jnp.isfinite(H))


def _with_barriers(at, where, W, E, C):
    """Curvature with barriers, equations without variables that are fixed, their squares and their weight, and the
    stiffness of limits and bounds."""
    stiffness = at.z / at.s
    low, high = (jnp.where(mark, m / d, 0.0) for mark, m, d in (
        (where.has_lower, at.low, where.below), (where.has_upper, at.high, where.above)))  # fmt: skip
    H = W + (C.T * stiffness[None]) @ C + jnp.diag(low + high)
    E = E * where.free.astype(E.dtype)[None]
    both = where.free[:, None] & where.free[None]
    H = jnp.where(both, H, 0.0) + jnp.diag(jnp.where(where.free, 0.0, 1.0))
    size = jnp.maximum(jnp.max(jnp.abs(jnp.diagonal(W)), initial=0.0), 1.0)
    squares = E.T @ E
    weight = 10.0 * size / jnp.maximum(jnp.max(jnp.abs(squares), initial=0.0), 1e-8)
    return H, E, squares, weight, stiffness, low, high


def newton_step(
    system: ReducedSystem, at: Iterate, where: BoundDistances, gradient: Array, e: Array, gap: Array, mu: Array
) -> Iterate:
    """Step to the minimum of the barrier problem; y of the result is the new multiplier, not its change.

    Args: e (p,) residual of the equations; gap (m,) of the inequalities, `c + s`.
    """
    C = system.inequalities
    push = mu / at.s + system.stiffness * gap
    barrier = jnp.where(where.has_upper, mu / where.above, 0.0) - jnp.where(where.has_lower, mu / where.below, 0.0)
    right = -(gradient + C.T @ push + barrier)
    dx, y = system.solve(jnp.where(where.free, right, 0.0), -e)
    ds = -gap - C @ dx
    dz = mu / at.s - at.z - system.stiffness * ds
    dlow = jnp.where(where.has_lower, mu / where.below - at.low - system.low * dx, 0.0)
    dhigh = jnp.where(where.has_upper, mu / where.above - at.high + system.high * dx, 0.0)
    return Iterate(dx, ds, y, dz, dlow, dhigh)


def longest_steps(at: Iterate, step: Iterate, where: BoundDistances, mu: Array) -> tuple[Any, Any]:
    """Largest parts of a step that keep slacks and multipliers positive, by the fraction to the boundary."""
    fraction = jnp.maximum(0.99, 1.0 - mu)

    def part(values, changes, mark=True):
        shrinks = (changes < 0.0) & mark
        return jnp.min(jnp.where(shrinks, -fraction * values / jnp.where(shrinks, changes, -1.0), 1.0), initial=1.0)

    primal = jnp.minimum(part(at.s, step.s), part(where.below, step.x, where.has_lower))
    primal = jnp.minimum(primal, part(where.above, -step.x, where.has_upper))
    dual = jnp.minimum(part(at.low, step.low, where.has_lower), part(at.high, step.high, where.has_upper))
    return primal, jnp.minimum(dual, part(at.z, step.z))
