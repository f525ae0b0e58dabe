"""Derivatives of a minimum by the numbers of its problem: the implicit function theorem on its KKT conditions."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from ._barrier_problem import BarrierProblem, Iterate, bound_distances
from ._barrier_step import ReducedSystem, reduced_system


def change_of_solution(problem: BarrierProblem, tangent: Any, factors: tuple, at: Iterate) -> tuple[Iterate, Array]:
    """Changes of the unknowns and of the scaled objective () for a change of the problem, of which the functions have
    factors.

    Source: Fiacco 1983, Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 3.2.
    """
    where = bound_distances(problem, at.x)
    scaled = problem.times(factors)
    _, slopes = scaled.slopes(at.x)
    W = scaled.hessian(at.x, (1.0, at.y, at.z))
    system = reduced_system(at, where, W, slopes[1], slopes[2], jnp.zeros(()))

    def parts(problem):
        scaled = problem.times(factors)
        value, e, c = scaled.functions(at.x)
        of_f, of_e, of_c = scaled.slopes(at.x)[1]
        return of_f + at.y @ of_e + at.z @ of_c, e, c, problem.lower, problem.upper, value

    change = eqx.filter_jvp(parts, (problem,), (tangent,))[1]
    if change is None:
        change = (None,) * 6
    like = (at.x, at.y, at.z, at.x, at.x, slopes[0][0])
    by_x, by_e, by_c, lower, upper, value = (
        jnp.zeros_like(b) if a is None else a for a, b in zip(change, like, strict=True)
    )
    fixed = jnp.where(where.free, 0.0, lower)  # variables between equal bounds go with them
    by_x, by_e, by_c = by_x + W @ fixed, by_e + slopes[1] @ fixed, by_c + slopes[2] @ fixed
    lower, upper = jnp.where(where.has_lower, lower, 0.0), jnp.where(where.has_upper, upper, 0.0)
    step = _solve_refined(system, W, where.free, (jnp.where(where.free, -by_x, 0.0), -by_e, -by_c, lower, upper))
    dx = step.x + fixed
    return step._replace(x=dx, s=-step.z / system.stiffness), value + slopes[0] @ dx


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
