"""Cycles beside a fold: how much their slope changes within what is known of their place.

At a fold the slope is singular; beside one, at a distance that is not far above the errors of the motions, neither
the place nor the slope is known, and derivatives are numbers without meaning.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from ._shooting import SINGULAR

#: Least singular value below which the cycle may be beside a fold.
_DOUBTFUL = {8: 3e-3, 4: 3e-2}
_STEP = {8: 1e-5, 4: 1e-2}  # of the unknowns, at whose end the slope is compared
_LARGEST_CHANGE = 1e-2  # of the least singular value within what is known of the place


class FoldProbe(NamedTuple):
    """Slopes on both sides of a cycle, along the direction in which the rows change least.

    Attributes:
        sides: () number of sides that were looked at.
        displacement: (n,) of the unknowns to the next side.
        bend: () largest change of the least singular value over the step.
    """

    sides: Array
    displacement: Array
    bend: Array

    @classmethod
    def none(cls, unknowns: Array) -> "FoldProbe":
        """That before any, of unknowns (n,)."""
        return cls(jnp.zeros((), jnp.int32), unknowns, jnp.zeros((), unknowns.dtype))

    def is_wanted(self, least: Array) -> Array:
        """True () where a side is to be looked at, by the least singular value ()."""
        bytes_ = least.dtype.itemsize
        return (self.sides < 2) & (least < _DOUBTFUL[bytes_]) & (least >= SINGULAR[bytes_])

    def after(self, is_side: Array, least: Array, found: Array, direction: Array) -> "FoldProbe":
        """The probe after a slope, whose least singular value is `found` () and whose direction (n,) changes rows
        least.

        Args: is_side: () true if it is that of a side, false if that of the search; least: () that of the cycle.
        """
        step = _STEP[found.dtype.itemsize]
        bend = jnp.where(is_side, jnp.maximum(self.bend, jnp.abs(found - least) / step), self.bend)
        displacement = jnp.where(is_side, -self.displacement, step * direction)
        return FoldProbe(self.sides + is_side.astype(jnp.int32), displacement, bend)

    def is_at_fold(self, least: Array, error: Array) -> Array:
        """True () where the least singular value () is none, or not known for an error () of the place."""
        known = (least >= _DOUBTFUL[least.dtype.itemsize]) | (self.bend * error <= _LARGEST_CHANGE * least)
        return (least < SINGULAR[least.dtype.itemsize]) | ~known
