"""The slope of the equations at a cycle, on which its derivatives rest, and what is known of it beside a fold.

A program that asks for no derivative does not compute it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

from ..assembly._state import State
from ..model._system import System
from ._chart import Chart
from ._folds import FoldProbe
from ._newton import FINE, with_tolerance
from ._shooting import Shooting


class CycleSlope(NamedTuple):
    """The inverse (n, rows) of the slope at a cycle, its least singular value (), the error () of the place."""

    inverse: Array
    least: Array
    error: Array
    probe: FoldProbe
    motions: Array

    @property
    def is_singular(self) -> Array:
        """True () where the cycle is one of many, or so near a fold that its slopes are not known."""
        return self.probe.is_at_fold(self.least, self.error + FINE[self.error.dtype.itemsize] / self.least)


def slope_at(
    shooting: Shooting, system: System, charts: Chart, states: State, period: Array, least: int
) -> CycleSlope:
    """The slope at the states (m,) of charts.  Args: least: see `Flow.end`."""
    fine = with_tolerance(shooting, jnp.asarray(FINE[period.dtype.itemsize], period.dtype))
    n, h = shooting.segments * charts.num_numbers, shooting.held.number
    free, zero = int(shooting.is_free), jnp.zeros_like(period)
    none, inverse = jnp.zeros(n + free, period.dtype), jnp.zeros((n + free, n + h), period.dtype)

    def once(s):
        is_first = s.motions == 0
        beside, longer = shooting.displaced_states(system, charts, period, s.probe.displacement)
        at = jax.tree.map(lambda a, b: jnp.where(is_first, a, b), (states, period), (beside, longer))
        linear = fine.linearised(system, fine.charts(system, *at), at[1], least)
        parts = linear.decomposition
        size = jnp.max(jnp.abs(parts.inverse @ linear.rows), initial=0.0)
        kept = (parts.inverse, parts.least, size), (s.inverse, s.least, s.error)
        chosen = jax.tree.map(lambda a, b: jnp.where(is_first, a, b), *kept)
        probe = s.probe.after(~is_first, s.least, parts.least, parts.direction)
        return CycleSlope(*chosen, probe, s.motions + 1)

    first = CycleSlope(inverse, zero, zero, FoldProbe.none(none), jnp.zeros((), jnp.int32))
    return lax.while_loop(lambda s: (s.motions == 0) | s.probe.is_wanted(s.least), once, first)
