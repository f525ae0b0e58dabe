"""A problem under equations, inequalities and bounds as a pytree of functions, and its derivatives at a point."""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array


class BarrierProblem(eqx.Module):
    """Minimise `f(x)` subject to `e(x) = 0`, `c(x) <= 0` and `lower <= x <= upper`; infinite bounds are none.

    Attributes:
        functions: of x (n,) to (f, e (p,), c (m,)), a pytree.
        exact: second derivatives are exact, else of a BFGS matrix.
        reverse: mode of first derivatives.
        scaling: of functions by their gradients at the first point: "none"; "steepest" where they are large; "unit"
            of the objective alone, to one.
        is_warm: multipliers of the first iterate are those of a problem nearby.
        has_history: a search records its steps.
    """

    functions: Callable
    lower: Array
    upper: Array
    exact: bool = eqx.field(static=True)
    reverse: bool = eqx.field(static=True)
    scaling: str = eqx.field(static=True, default="none")
    is_warm: bool = eqx.field(static=True, default=False)
    has_history: bool = eqx.field(static=True, default=False)

    def times(self, factors: tuple) -> "BarrierProblem":
        """The problem with factors () of f, (p,) of e and (m,) of c."""
        return dataclasses.replace(self, functions=ScaledFunctions(self.functions, factors))

    def sizes(self, x: Array) -> tuple[int, int]:
        """Numbers p of equations and m of inequalities."""
        _, e, c = jax.eval_shape(self.functions, x)
        return e.size, c.size

    def slopes(self, x: Array) -> tuple[tuple, tuple]:
        """Values (f, e, c) at x, and their derivatives."""
        if self.reverse and not self._has_more_rows(x):
            found, pull = jax.vjp(self.functions, x)
            size = sum(part.size for part in found)
            seeds = jnp.eye(size)
            p = found[1].size
            rows = jax.vmap(lambda seed: pull((seed[0], seed[1 : p + 1], seed[p + 1 :]))[0])(seeds)
            return found, (rows[0], rows[1 : p + 1], rows[p + 1 :])
        slopes, found = jax.jacfwd(lambda x: (self.functions(x),) * 2, has_aux=True)(x)
        return found, slopes

    def _has_more_rows(self, x):
        """True if functions are more than variables, so that forward mode takes fewer passes, and have it."""
        if 1 + sum(self.sizes(x)) <= x.size:
            return False
        try:
            jax.eval_shape(lambda x: jax.jvp(self.functions, (x,), (x,)), x)
        except TypeError:  # a rule for reverse mode alone, as that of motions
            return False
        return True

    def lagrangian(self, x: Array, weights: tuple) -> Array:
        """`f + y e + z c`, of weights (of f, y, z)."""
        f, e, c = self.functions(x)
        return weights[0] * f + weights[1] @ e + weights[2] @ c

    def hessian(self, x: Array, weights: tuple) -> Array:
        """Second derivative (n, n) of the Lagrangian."""
        derive = jax.grad if self.reverse else jax.jacfwd
        return jax.jacfwd(derive(lambda x: self.lagrangian(x, weights)))(x)


class ScaledFunctions(eqx.Module):
    """Functions of x to (f, e, c) times factors."""

    functions: Callable
    factors: tuple

    def __call__(self, x: Array) -> tuple:
        """The products."""
        return tuple(part * factor for part, factor in zip(self.functions(x), self.factors, strict=True))


class Iterate(NamedTuple):
    """Unknowns of the barrier problem: variables, slacks s of inequalities, and multipliers.

    Attributes: x (n,); s (m,) > 0; y (p,) of equations; z (m,) > 0 of inequalities; low, high (n,) >= 0 of bounds.
    """

    x: Any
    s: Any
    y: Any
    z: Any
    low: Any
    high: Any


class BoundDistances(NamedTuple):
    """Distances (n,) of x to its bounds, one where there is none, and marks of those that there are."""

    below: Any
    above: Any
    has_lower: Any
    has_upper: Any
    free: Any


def bound_distances(problem: BarrierProblem, x: Array) -> BoundDistances:
    """Distances to the bounds; variables whose bounds are equal are not free and count as without bounds."""
    free = problem.lower < problem.upper
    has_lower, has_upper = jnp.isfinite(problem.lower) & free, jnp.isfinite(problem.upper) & free
    below = jnp.where(has_lower, x - jnp.where(has_lower, problem.lower, 0.0), 1.0)
    above = jnp.where(has_upper, jnp.where(has_upper, problem.upper, 0.0) - x, 1.0)
    return BoundDistances(below, above, has_lower, has_upper, free)
