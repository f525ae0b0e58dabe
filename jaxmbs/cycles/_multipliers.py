"""Floquet multipliers of a cycle: eigenvalues of the product of the slopes of its parts.

Their reverse derivative is that of the slopes along weights that the eigenvalues have at them: a derivative, along
the begins of the parts, of reverse derivatives of the motions.
"""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..math import _square as square
from ..math._nan import nan_where
from ..math._product_eigen import product_eigenvalues
from ..model._system import System
from ..motion._motion import Motion
from ..ode._loop import stop_gradients
from ..ode._named_solver import is_implicit
from ._chart import Chart, quickest
from ._shooting import Shooting, begin_slope, end_slope

#: Longest explicit step times the rate of small deviations: of twice that Dopri8's is wrong by its own size.
_LONGEST = 3.0


def multipliers_of(
    shooting: Shooting, system: System, motion: Motion, period: Array, parts: int, gradient: str
) -> Array:
    """Floquet multipliers (n,) from the slopes of so many parts of a cycle, whose begins are among its states.

    No step is longer than the intervals between the states: tolerances see the motion, not small deviations from it,
    which may be quick where the motion itself is at rest.  NaN where they are too quick for explicit steps.
    """
    every = (len(motion) - 1) // parts
    begins = jax.tree.map(lambda x: x[: every * parts : every], motion.states)
    charts = jax.vmap(lambda state: Chart.at(system, state, 2.0 * jnp.pi / period))(begins)
    moving = shooting, system, begins, motion.ts[::every]
    values = _multipliers if gradient == "reverse" else _values
    found, charts = values(moving, stop_gradients(charts), every), stop_gradients(charts)
    if is_implicit(shooting.flow.solver):
        return found
    step = period / jnp.maximum(len(motion) - 1, motion.diagnostics.num_steps).astype(period.dtype)
    return nan_where(stop_gradients(quickest(system, charts) * step) > _LONGEST, found)


def _values(moving, charts, every):
    return product_eigenvalues(_factors(moving, charts, every)[2])


def _factors(moving, charts, every):
    """Slopes (p, n, n) of the begins by themselves, of the ends by the begins, and the latter over the former."""
    shooting, system, begins, times = moving
    charts = dataclasses.replace(charts, state=begins)  # of which the slopes depend: here they have derivatives
    none, still = jnp.zeros_like(shooting.gain), jnp.zeros_like(shooting.winds)

    def factor(one):
        chart, following, t0, t1 = one
        slope = end_slope(shooting.flow, system, (chart, following), (t0, t1), none, still, least=every)[1]
        own = begin_slope(system, following, following.state.t, False)[1]
        return own, slope, square.solve(own, slope)

    return lax.map(factor, (charts, _after(charts), times[:-1], times[1:]))


def _after(tree):
    return jax.tree.map(lambda x: jnp.roll(x, -1, axis=0), tree)


@eqx.filter_custom_vjp
def _multipliers(moving, charts, every):
    """`_values` with a reverse derivative of its own."""
    return _values(moving, charts, every)


@_multipliers.def_fwd
def _forward(perturbed, moving, charts, every):
    del perturbed
    own, slopes, factors = _factors(moving, charts, every)
    return product_eigenvalues(factors), (own, slopes, factors)


@_multipliers.def_bwd
def _backward(kept, bar, perturbed, moving, charts, every):
    own, _, factors = kept
    weights = jax.vjp(product_eigenvalues, factors)[1](bar)[0]
    weights = jax.vmap(lambda A, B: square.solve(A.T, B))(own, weights)
    less = -jnp.einsum("kij,klj->kil", weights, factors)
    is_asked = jax.tree.map(lambda x, p: p and eqx.is_inexact_array(x), moving, perturbed)
    numbers, fixed = eqx.partition(moving, is_asked)
    number = factors.shape[-1]

    def along(numbers, weights, less, k, xi):
        """Weighted numbers of the end of part k, and of the begin after it, at a begin xi (n,) of its chart."""
        shooting, system, begins, times = eqx.combine(numbers, fixed)
        all_of = dataclasses.replace(charts, state=begins)
        chart, following = (jax.tree.map(lambda x: x[k], tree) for tree in (all_of, _after(all_of)))
        none, still = jnp.zeros_like(shooting.gain), jnp.zeros_like(shooting.winds)
        end = shooting.flow.end(system, chart.state_at(system, xi, times[k]), times[k + 1], "reverse", every)
        begin = following.state_at(system, xi, following.state.t)
        seen = [following.numbers_of(system, state, none, still) for state in (end, begin)]
        return weights @ seen[0] + less @ seen[1]

    def of_part(sums, one):
        weights, less, k = one

        def column(weights, less, direction):
            slopes = lambda xi: jax.grad(along)(numbers, weights, less, k, xi)
            return jax.jvp(slopes, (jnp.zeros(number, direction.dtype),), (direction,))[1]

        found = jax.vmap(column)(weights.T, less.T, jnp.eye(number, dtype=weights.dtype))
        return jax.tree.map(lambda a, b: a + jnp.sum(b, axis=0), sums, found), None

    none = jax.tree.map(jnp.zeros_like, numbers)
    return lax.scan(of_part, none, (weights, less, jnp.arange(factors.shape[0])))[0]
