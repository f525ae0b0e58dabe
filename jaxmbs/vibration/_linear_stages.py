"""Implicit stages of a linear system: one matrix of the size of its rows with mass, inverted once for equal steps."""

from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax import Array, lax

from ..math import _square as square
from ..ode._gauss import solve_stages
from ..runtime import any_in_batch

if TYPE_CHECKING:
    from ._linear_equations import LinearEquations

#: Relative difference of two steps that have the same inverse; what it is off by is squared by one refinement.
_SAME_STEP = 1e-9


class StepInverse(NamedTuple):
    """Inverse (heavy, heavy) of `implicit_matrix` for a step s ()."""

    step: Array
    inverse: Array


def implicit_matrix(equations: "LinearEquations", s: Array) -> Array:
    """`1 + s M^-1 C + s^2 M^-1 K`: what a change of the accelerations, lasting for s, changes them by."""
    one = jnp.eye(len(equations.by_displacement), dtype=equations.by_displacement.dtype)
    return one + s * equations.by_velocity + s**2 * equations.by_displacement


def invert_implicit_matrix(equations: "LinearEquations", s: Array) -> StepInverse:
    """The inverse for a step, without derivative."""
    s = lax.stop_gradient(s)
    return StepInverse(s, square.inverse(lax.stop_gradient(implicit_matrix(equations, s))))


class LinearStages(eqx.Module):
    """The stages of a step: rates r of (x, x', nothing) with `r = f(t, y + s r)`.

    With `r = (x' + s a, a)` the accelerations a are those at `x + s x'` and x', divided by `implicit_matrix`; laws
    add theirs, found by Newton's method from the velocities between their coordinates.
    """

    equations: "LinearEquations"
    step: Array
    matrix: Array
    inverse: Array
    by_effort: Array

    @classmethod
    def of(cls, equations: "LinearEquations", s: Array) -> "LinearStages":
        """The stages for s; the inverse that the equations have is taken where it is that of an equal step."""
        near, anew = equations.near, lambda: invert_implicit_matrix(equations, s).inverse
        if near is None:
            inverse = anew()
        else:
            other = jnp.abs(s - near.step) > _SAME_STEP * jnp.abs(near.step)
            inverse = lax.cond(any_in_batch(other), anew, lambda: near.inverse)
        stages = cls(equations, s, implicit_matrix(equations, s), inverse, equations.by_effort)
        return eqx.tree_at(lambda found: found.by_effort, stages, stages.solve(equations.by_effort))

    def solve(self, b: Array) -> Array:
        """`matrix^-1 b`, refined once."""
        P, matrix = lax.stop_gradient((self.inverse, self.matrix))

        def refined(A, P, b):
            x = P @ b
            return x + P @ (b - A @ x)

        return lax.custom_linear_solve(
            lambda x: self.matrix @ x,
            b,
            lambda _, b: refined(matrix, P, b),
            lambda _, b: refined(matrix.T, P.T, b),
        )

    def rate(self, t: Array, y: tuple) -> tuple[tuple, Array]:
        """The rate, and True if the laws' efforts were found."""
        (x, v, quadratures), s, equations = y, self.step, self.equations
        a, found = self.solve(equations.linear_acceleration(t, x + s * v, v)), jnp.asarray(True)
        if equations.laws:
            rows = equations.rows
            position, velocity = rows @ (x + s * v + s**2 * a), rows @ (v + s * a)
            gain = s * rows @ self.by_effort

            def efforts(u):
                return equations.efforts_of(t, position + s * (u - velocity), u)

            guess = (rows @ v)[None]
            u, found = solve_stages(
                lambda u: u - (velocity + gain @ efforts(u[0]))[None], guess, 1.0 + jnp.abs(guess[0]), True
            )
            a = a + self.by_effort @ efforts(u[0])
        return (v + s * a, a, quadratures), found
