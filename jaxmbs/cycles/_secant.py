"""Broyden's steps with one slope: each corrects the inverse by what the rows have changed along it.

Source: Broyden, A class of methods for solving nonlinear simultaneous equations (1965); the error that a step leaves
is told from the two last ones, Hairer and Wanner, Solving ordinary differential equations II (1996), IV.8.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ._shooting import Linear

#: States of steps and searches: further ones, a new slope at the point, a cycle, no way on.
GOES_ON, NEW_SLOPE, LAST, LOST = range(4)
_LEAST_LENGTH = 1e-4  # of a step that is tried
_SUFFICIENT_DECREASE = 0.1  # share of the decrease that the slope predicts, at which a trial is taken (Armijo)
_NOISE, _OF_NOISE = 100.0, 10.0  # of tolerances: rows, and steps, that are smaller need not decrease
_CONTRACTION = 0.5  # of steps, above which a new slope is taken
_OF_STEP = 1e-5  # tolerance of a motion, of the step that leads to it
_LAST_STEP = {8: 1e-7, 4: 1e-2}  # the last one in any case, where a new slope does not make it smaller
#: Rows, and a step by a fine slope, that leads nowhere: what is left is noise.
_NO_ROWS, _NO_STEP = {8: 1e-6, 4: 1e-2}, {8: 1e-4, 4: 3e-2}
_NO_SECANT = 0.1  # change that the slope foretells over that of the rows, below which they tell nothing


class SecantSteps(NamedTuple):
    """A point z (n,) with its rows and the step from it.

    `length` () is the share of the step that is tried next, `tolerance` () that of its motion, `exact` () the one
    asked for, `error` () that of the rows at z, `descent` () the slope of half their square along the step. A slope
    that is not `is_fine` is taken anew where a trial is refused.
    """

    z: Array
    rows: Array
    step: Array
    length: Array
    inverse: Array
    descent: Array
    tolerance: Array
    exact: Array
    error: Array
    is_fine: Array
    is_refused: Array
    motions: Array
    state: Array

    @classmethod
    def begin(cls, linear: Linear, tolerance: Array, exact: Array, is_fine: Array, motions: Array) -> "SecantSteps":
        """Those from the point of a slope, which was taken with a tolerance ().

        A step that is not above the errors of its rows is none: they are looked at again, at the same point.
        """
        inverse = linear.decomposition.inverse
        step = -inverse @ linear.rows
        step = jnp.where(jnp.max(jnp.abs(step), initial=0.0) <= _OF_NOISE * tolerance, 0.0 * step, step)
        descent = linear.rows @ (linear.matrix @ step)
        state = jnp.where(jnp.all(jnp.isfinite(step)), GOES_ON, LOST).astype(jnp.int32)
        none, no = jnp.zeros_like(step), jnp.asarray(False)
        first = cls(
            *(none, linear.rows, step, jnp.ones_like(exact), inverse, descent, tolerance, exact, tolerance),
            *(is_fine, no, motions, state),
        )
        return first._replace(tolerance=first._next_tolerance(first.size))

    @property
    def size(self) -> Array:
        """Largest number () of the step."""
        return jnp.max(jnp.abs(self.step), initial=0.0)

    def next(self, rows: Callable[[Array, Array], Array], enough: Array, longest: Array) -> "SecantSteps":
        """After one trial.

        Args: rows: function of a point and the tolerance of its motion; enough: () error of a point that is the last;
            longest: (n,) of a step.
        """
        share = jnp.min(longest / jnp.maximum(jnp.abs(self.step), 1e-30), initial=1.0)
        moved = jnp.minimum(self.length, share) * self.step
        found = rows(self.z + moved, self.tolerance)
        loss, before = 0.5 * jnp.sum(found**2), 0.5 * jnp.sum(self.rows**2)
        noise = (_NOISE * jnp.maximum(self.error, self.tolerance)) ** 2
        nearer = (loss <= before + _SUFFICIENT_DECREASE * self.length * self.descent) | (loss <= noise)
        inverse = _secant(self.inverse, moved, found - self.rows, _OF_NOISE * self.error)
        step = -inverse @ found
        after = self._replace(
            z=self.z + moved,
            rows=found,
            step=step,
            length=jnp.ones_like(self.length),
            inverse=inverse,
            descent=jnp.zeros_like(self.descent),
            error=self.tolerance,
            motions=self.motions + 1,
        )
        after = after._replace(tolerance=self._next_tolerance(after.size))
        return _chosen(nearer & jnp.all(jnp.isfinite(step)), after._judged(self, enough), self._refused())

    def _next_tolerance(self, size):
        return jnp.clip(_OF_STEP * size, self.exact, jnp.maximum(self.tolerance, self.exact))

    def _judged(self, before, enough):
        """The same with its state, by the step before."""
        size, last = self.size, before.size
        ratio = jnp.where(last > 0.0, size / jnp.where(last > 0.0, last, 1.0), _CONTRACTION)
        ratio = jnp.minimum(ratio, _CONTRACTION)
        shrinks = (size <= _CONTRACTION * last) | (size <= _OF_NOISE * before.error)
        is_asked = self.error <= self.exact
        is_last = is_asked & (ratio / (1.0 - ratio) * size <= enough)
        is_last |= is_asked & ~shrinks & self.is_fine & (size <= _LAST_STEP[size.dtype.itemsize])
        state = jnp.where(is_last, LAST, jnp.where(shrinks, GOES_ON, NEW_SLOPE)).astype(jnp.int32)
        return self._replace(z=jnp.where(is_last, self.z + self.step, self.z), state=state)

    def _refused(self):
        """A shorter trial, or a new slope where that is coarse, or one of secants.

        Where rows are small and a step by a fine slope leads nowhere, the search ends: forces with corners are noise.
        Whether the motion comes back is judged after it.
        """
        shorter = 0.5 * self.length
        is_first = self.is_fine & (self.descent != 0.0)
        bytes_, gap = self.size.dtype.itemsize, jnp.max(jnp.abs(self.rows), initial=0.0)
        is_last = (gap <= _NO_ROWS[bytes_]) & (self.size <= _NO_STEP[bytes_])
        shrunk = jnp.where(shorter < _LEAST_LENGTH, LOST, GOES_ON)
        state = jnp.where(is_first, jnp.where(is_last, LAST, shrunk), NEW_SLOPE)
        refused = self._replace(length=shorter, is_refused=jnp.asarray(True), motions=self.motions + 1)
        return refused._replace(state=state.astype(jnp.int32))


def _chosen(condition, a, b):
    return SecantSteps(*(jnp.where(condition, x, y) for x, y in zip(a, b, strict=True)))


def _secant(inverse, moved, change, noise):
    """The inverse (n, rows) that gives a move (n,) for a change (rows,) of the rows, which is not noise."""
    foretold = inverse @ change
    along, square = moved @ foretold, moved @ moved
    used = (jnp.abs(along) > _NO_SECANT * square) & (square > noise**2)
    new = inverse + jnp.outer(moved - foretold, moved @ inverse) / jnp.where(used, along, 1.0)
    return jnp.where(used & jnp.all(jnp.isfinite(new)), new, inverse)
