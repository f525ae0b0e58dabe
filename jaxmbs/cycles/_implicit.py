"""The cycle as a function of the machine: corrections with one slope, and their derivatives.

Source: Griewank and Walther (2008), chapter 15 (implicit functions and their adjoints).
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..model._system import System
from ..ode._loop import stop_gradients
from ._chart import Chart
from ._newton import FINE, search, with_tolerance
from ._shooting import Shooting
from ._slope import slope_at

_MOST_ROUNDS = 8
_LAST_ROUND = {8: 3e-8, 4: 1e-3}  # of the adjoint, over the whole
_NO_END = {8: 1e-4, 4: 0.1}  # what is left of it where the rounds do not end: the derivative is then NaN


class Solution(NamedTuple):
    """States (m,) at the begins of the segments, the period, and True where the search ended at a cycle, and where
    its slope is singular."""

    states: State
    period: Array
    found: Array
    is_singular: Array


class _Place(NamedTuple):
    """A root of the equations: its charts (m,), the inverse of the slope there, and the tolerance () of motions whose
    derivatives are right to a billionth of the whole; without derivatives."""

    charts: Chart
    inverse: Array
    tolerance: Array


def solution(shooting: Shooting, system: System, start: tuple[State, Array], gradient: str, least: int) -> Solution:
    """The cycle near states (m,) and a period, with derivatives by all that the equations depend on.

    Args: start: where the search begins, without derivative but for the period of a cycle that has a given one;
        least: see `Flow.end`.
    """
    found = stop_gradients(search(shooting, system, *start, least))
    still = stop_gradients((shooting, system))
    charts = stop_gradients(shooting.charts(system, found.states, found.period))
    slope = stop_gradients(slope_at(*still, charts, found.states, found.period, least))
    finest = FINE[found.period.dtype.itemsize]
    place = _Place(charts, slope.inverse, finest * jnp.minimum(slope.least, 1.0))
    moving = shooting, system, found.period if shooting.is_free else start[1]
    z = jnp.zeros(slope.inverse.shape[0], found.period.dtype)
    z = _corrected_twice(moving, place, z, least) if gradient == "forward" else _implicit(moving, place, z, least)
    xi, period = shooting.parts(z, moving[2])
    return Solution(shooting.states(system, charts, xi, period), period, found.is_last, slope.is_singular)


def _rows(moving, place, z, gradient, least):
    return moving[0].rows(moving[1], place.charts, *moving[0].parts(z, moving[2]), gradient, least)


def _corrected_twice(moving, place, z, least):
    """z after two steps with one slope: each leaves a small part of the error, so that they carry first and second
    derivatives in forward mode."""
    return lax.scan(lambda z, _: (z - place.inverse @ _rows(moving, place, z, "forward", least), None), z, None, 2)[0]


@eqx.filter_custom_vjp
def _implicit(moving: Any, place: _Place, z: Array, least: int) -> Array:
    """z, which is a root, with a reverse derivative of its own."""
    del moving, place, least
    return z


@_implicit.def_fwd
def _forward(perturbed, moving, place, z, least):
    numbers, fixed = _parted(moving, perturbed)
    return z, (z, jax.vjp(_rows_of(fixed, place, least), numbers, z)[1])


@_implicit.def_bwd
def _backward(kept, bar, perturbed, moving, place, start, least):
    (z, back), (numbers, fixed) = kept, _parted(moving, perturbed)
    del start
    return _adjoint(numbers, z, bar, back, fixed, place, least)


def _parted(moving, perturbed):
    """The numbers by which derivatives are asked for, and all else."""
    is_asked = jax.tree.map(lambda x, p: p and eqx.is_inexact_array(x), moving, perturbed)
    return eqx.partition(moving, is_asked)


def _rows_of(fixed, place, least):
    """Function of the numbers and z: the rows of coarser motions, which serve for derivatives alone."""

    def rows(numbers, z):
        shooting, *others = eqx.combine(numbers, fixed)
        coarser = with_tolerance(shooting, place.tolerance)
        return _rows((coarser, *others), place, z, "reverse", least)

    return rows


@eqx.filter_custom_jvp
def _adjoint(numbers, z, bar, back, fixed, place, least):
    """Cotangents of the numbers that the equations depend on, of a cotangent of z.

    Args: back: the pull-back of the rows next to z, whose own derivatives do not count.
    """
    del numbers, z, fixed, least
    tolerance = _LAST_ROUND[bar.dtype.itemsize]

    def goes_on(size, whole, rounds):
        return (rounds == 0) | ((size > tolerance * whole) & (rounds < _MOST_ROUNDS))

    return _adjoint_sum(back, bar, place.inverse, goes_on)


@_adjoint.def_jvp
def _adjoint_jvp(primals, tangents):
    """Of two rounds at z, as the second carries what the first one misses."""
    numbers, z, bar, _, fixed, place, least = primals

    def two(numbers, z, bar):
        back = jax.vjp(_rows_of(fixed, place, least), numbers, z)[1]
        return _adjoint_sum(back, bar, place.inverse, lambda size, whole, rounds: rounds < 2)

    return eqx.filter_jvp(two, (numbers, z, bar), tangents[:3])


def _adjoint_sum(back, bar, inverse, goes_on):
    """Sum of rounds of the adjoint, each with one slope for what the ones before it left."""

    def once(s):
        left, whole, rounds, sums, seen = s
        parts, more = back(left)
        whole, seen, sums = whole + left, seen + more, jax.tree.map(jnp.add, sums, parts)
        return -inverse.T @ (bar + seen), whole, rounds + 1, sums, seen

    left = -inverse.T @ bar
    none = jax.tree.map(jnp.zeros_like, jax.eval_shape(back, left)[0])
    first = left, jnp.zeros_like(left), jnp.zeros((), jnp.int32), none, jnp.zeros_like(bar)
    largest = lambda x: jnp.max(jnp.abs(x), initial=0.0)
    left, whole, _, sums, _ = lax.while_loop(lambda s: goes_on(largest(s[0]), largest(s[1]), s[2]), once, first)
    ends = largest(left) <= _NO_END[bar.dtype.itemsize] * largest(whole)
    return jax.tree.map(lambda x: jnp.where(ends, x, jnp.nan), sums)
