"""Gauss collocation for diffrax, at fixed steps: implicit midpoint (order 2) and the two-stage method (order 4)."""

from typing import Any, ClassVar

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import PyTree

from ..math import _square as square
from ..typing import ScalarLike

_ROOT_3 = np.sqrt(3.0)
_MOST_ITERATIONS = 50


class _Gauss(diffrax.AbstractSolver):
    """Collocation at the Gauss points of a step: symmetric and A-stable, but without an error estimate."""

    term_structure: ClassVar = diffrax.AbstractTerm
    interpolation_cls: ClassVar = diffrax.ThirdOrderHermitePolynomialInterpolation
    A: ClassVar[np.ndarray]
    b: ClassVar[np.ndarray]
    c: ClassVar[np.ndarray]
    end: ClassVar[np.ndarray]
    newton: bool = eqx.field(static=True, default=False)

    def init(self, terms: PyTree, t0: ScalarLike, t1: ScalarLike, y0: PyTree, args: PyTree) -> None:
        return None

    def func(self, terms: PyTree, t0: ScalarLike, y0: PyTree, args: PyTree) -> PyTree:
        return terms.vf(t0, y0, args)

    def step(
        self,
        terms: PyTree,
        t0: ScalarLike,
        t1: ScalarLike,
        y0: PyTree,
        args: PyTree,
        solver_state: None,
        made_jump: Any,
    ) -> tuple:
        """The stages couple coordinates and momenta; the work account is a quadrature over them."""
        del solver_state, made_jump
        psi, p, work = y0
        n, h, x0 = psi.size, terms.contr(t0, t1), jnp.concatenate([psi, p])
        A, b, c, end = (jnp.asarray(a, x0.dtype) for a in (self.A, self.b, self.c, self.end))

        def increments(t, x):
            psi_dot, p_dot, power = terms.vf(t, (x[:n], x[n:], work), args)
            return h * jnp.concatenate([psi_dot, p_dot]), h * power

        increments = eqx.filter_closure_convert(increments, t0, x0)  # traced once

        def at_nodes(c, X):
            return lax.map(lambda node: increments(t0 + node[0] * h, x0 + node[1]), (c, X))

        rest = jnp.zeros((c.size, x0.size), x0.dtype)
        Z, converged = solve_stages(lambda Z: Z - at_nodes(c, A @ Z)[0], rest, 1.0 + jnp.abs(x0), self.newton)
        rates = at_nodes(jnp.concatenate([0.0 * c[:1], c]), jnp.concatenate([0.0 * rest[:1], A @ Z]))
        x1, work1 = x0 + b @ Z, work + b @ rates[1][1:]
        y1 = x1[:n], x1[n:], work1
        k0, k1 = ((x[:n], x[n:], w) for x, w in ((r[0] for r in rates), (end @ r for r in rates)))
        result = diffrax.RESULTS.where(converged, diffrax.RESULTS.successful, diffrax.RESULTS.nonlinear_divergence)
        return y1, None, {"y0": y0, "y1": y1, "k0": k0, "k1": k1}, None, result


class ImplicitMidpoint(_Gauss):
    """Implicit midpoint rule, second order; otherwise as `Gauss4`."""

    A: ClassVar = np.array([[0.5]])
    b: ClassVar = np.array([1.0])
    c: ClassVar = np.array([0.5])
    end: ClassVar = np.array([-1.0, 2.0])  # rate at the end from those at the start and the stages

    def order(self, terms: PyTree) -> int:
        return 2


class Gauss4(_Gauss):
    """Two-stage Gauss method, fourth order, for long motions without energy drift.  Needs `dt=`.

    On trees of one-freedom joints the step is symplectic in (coordinates, momenta) and reversible: the energy error
    stays in a band.  Not so with closed loops, which are projected after every step, or quaternion joints.
    Dopri8 at the same cost drifts, but errs less over 10 000 periods of a smooth motion (benchmarks/long_run_energy).

    Args:
        newton: solve the stages by Newton's method, many times dearer a step but good for stiff systems; the default,
            fixed-point iteration, is for steps well below the shortest period.  Stages that cannot be solved end the
            motion as failed.
    """

    A: ClassVar = np.array([[0.25, 0.25 - _ROOT_3 / 6.0], [0.25 + _ROOT_3 / 6.0, 0.25]])
    b: ClassVar = np.array([0.5, 0.5])
    c: ClassVar = np.array([0.5 - _ROOT_3 / 6.0, 0.5 + _ROOT_3 / 6.0])
    end: ClassVar = np.array([1.0, -_ROOT_3, _ROOT_3])

    def order(self, terms: PyTree) -> int:
        return 4


def solve_stages(residual, guess, scale, newton):
    """Root Z (stages, n) of `residual` and whether it was found to rounding; derivatives by the implicit function
    theorem.  Iterates until the changes, relative to scale (n,), vanish or no longer halve."""
    residual = eqx.filter_closure_convert(residual, guess)
    return _root(residual, *lax.stop_gradient((guess, scale)), newton)


@eqx.filter_custom_jvp
def _root(residual, Z, scale, newton):
    rounding = jnp.finfo(Z.dtype).eps
    # Of what counts as rounding in the field: changes that no longer halve below the first, and below the second
    # those that no longer shrink, as beside stiff springs.
    limit, widest = rounding**0.75, rounding**0.6

    def iterate(carry):
        Z, size, _, count = carry
        change = _linear_solve(*jax.linearize(residual, Z)) if newton else residual(Z)
        return Z - change, jnp.max(jnp.abs(change) / scale[None]), size, count + 1

    def unfinished(carry):
        _, size, before, count = carry
        stalled = (size > 0.5 * before) & (size < limit) | (size >= before) & (size < widest)
        return (size > rounding) & ~stalled & (count < _MOST_ITERATIONS)

    far = jnp.asarray(jnp.inf, Z.dtype)
    Z, size, _, _ = lax.while_loop(unfinished, iterate, (Z, far, far, 0))
    converged = size < widest
    return jnp.where(converged, Z, 0.0), converged


@_root.def_jvp
def _root_jvp(primals, tangents):
    residual, _, _, _ = primals
    Z, converged = _root(*primals)
    moved = eqx.filter_jvp(lambda residual: residual(Z), (residual,), (tangents[0],))[1]
    return (Z, converged), (-_linear_solve(moved, jax.linearize(residual, Z)[1]), None)


def _linear_solve(right, apply):
    """Solution Z (stages, n) of `apply(Z) = right` for a linear function."""
    unit = jnp.eye(right.size, dtype=right.dtype).reshape(right.size, *right.shape)
    matrix = jax.vmap(apply)(unit).reshape(right.size, right.size).T
    return square.solve(matrix, right.reshape(-1)).reshape(right.shape)
