"""Cycles of a history, counted by the rainflow method."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..checks import any_concrete, is_concrete
from ..runtime import as_dtype, jit
from ..typing import ArrayLike
from ._arrays import float_array
from ._pairing import pair_samples

#: Ranges that are open at once in most histories: they shrink from one to the next.
DEPTH = 64


class Cycles(eqx.Module):
    """Cycles of a history; an entry whose count is zero is none.

    Attributes:
        ranges: (entries,) peak less valley, not negative; in the unit of the history, as are means.
        means: (entries,) half the sum of peak and valley.
        counts: (entries,) 1 for a cycle, 0.5 for half a cycle, 0 for none.
        overflow: () true if the stack was too small, so that cycles are lost.
    """

    ranges: Float[Array, " entries"]
    means: Float[Array, " entries"]
    counts: Float[Array, " entries"]
    overflow: Bool[Array, ""]

    @property
    def amplitudes(self) -> Float[Array, " entries"]:
        """Half the ranges."""
        return 0.5 * self.ranges

    def matrix(self, ranges: ArrayLike, means: ArrayLike) -> Float[Array, "r m"]:
        """Rainflow matrix: number of cycles between the edges (r + 1,) of ranges and (m + 1,) of means."""
        inside = [_in_bins(x, edges) for x, edges in ((self.ranges, ranges), (self.means, means))]
        return jnp.einsum("kr,km,k->rm", *inside, self.counts)


def _in_bins(values, edges):
    edges = as_dtype(edges, values.dtype)
    return ((values[:, None] >= edges[None, :-1]) & (values[:, None] < edges[None, 1:])).astype(values.dtype)


def rainflow(signal: ArrayLike, depth: int = DEPTH) -> Cycles:
    """Rainflow cycles of a history, as ASTM E1049-85 counts them; the residue counts as half cycles.

    The pairing of peaks and valleys is held in derivatives: ranges and means are differences and sums of samples.

    Args:
        signal: (samples,), at least two; the first and the last sample count as turning points.
        depth: ranges that may be open at once.  A decaying oscillation of n cycles has 2 n of them.

    Raises: ValueError for a signal that is not a row of two samples or more and, if concrete, not finite or too deep.
    Where it is traced, `overflow` reports that the stack was too small, and `damage` is NaN.
    """
    signal = _checked(signal)
    if isinstance(depth, bool) or not isinstance(depth, int | np.integer) or depth < 1:
        raise ValueError(f"depth = {depth!r} must be a whole number above zero")
    cycles = _count(signal, int(min(depth, len(signal))))
    if is_concrete(cycles.overflow) and bool(cycles.overflow):
        raise ValueError(f"more than {depth + 3} turning points wait for their partners at once: give a larger depth")
    return cycles


def _checked(signal):
    signal = float_array(signal)
    if signal.ndim != 1 or len(signal) < 2:
        raise ValueError(f"the signal has shape {signal.shape}: one row of at least two samples is needed")
    if any_concrete(lambda x: ~np.isfinite(x), signal):
        raise ValueError("the signal has samples that are not finite")
    return signal


@jit
def _count(signal, depth):
    pairs = pair_samples(signal, depth)
    x, y = signal[pairs.first], signal[pairs.second]
    return Cycles(jnp.abs(x - y), 0.5 * (x + y), pairs.counts, pairs.overflow)
