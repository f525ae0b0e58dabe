"""Cycles of a history, counted by the rainflow method."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import as_dtype, jit
from ..tables import format_number
from ..typing import ArrayLike
from ._arrays import float_array
from ._pairing import pair_samples


class Cycles(Reported, eqx.Module):
    """Cycles of a history; an entry whose count is zero is none.

    Attributes:
        ranges: (entries,) peak less valley, not negative; in the unit of the history, as are means.
        means: (entries,) half the sum of peak and valley.
        counts: (entries,) 1 for a cycle, 0.5 for half a cycle, 0 for none.
    """

    ranges: Float[Array, " entries"]
    means: Float[Array, " entries"]
    counts: Float[Array, " entries"]

    def report(self) -> Report:
        entry, unit = (Axis("entry", np.arange(len(self.ranges))),), "unit of the history"
        counts = np.asarray(self.counts)
        found = [Quantity("range", self.ranges, unit, entry), Quantity("mean", self.means, unit, entry)]
        return Report([*found, Quantity("count", counts, "", entry)], f"{format_number(counts.sum())} cycles")

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


def rainflow(signal: ArrayLike) -> Cycles:
    """Rainflow cycles of a history, as ASTM E1049-85 counts them; the residue counts as half cycles.

    The pairing of peaks and valleys is held in derivatives: ranges and means are differences and sums of samples.

    Args:
        signal: (samples,), at least two; the first and the last sample count as turning points.

    Raises: ValueError for a signal that is not a row of two samples or more and, if concrete, not finite.
    """
    return _count(_checked(signal))


def _checked(signal):
    signal = float_array(signal)
    if signal.ndim != 1 or len(signal) < 2:
        raise ValueError(f"the signal has shape {signal.shape}: one row of at least two samples is needed")
    if any_concrete(lambda x: ~np.isfinite(x), signal):
        raise ValueError("the signal has samples that are not finite")
    return signal


@jit
def _count(signal):
    pairs = pair_samples(signal)
    x, y = signal[pairs.first], signal[pairs.second]
    return Cycles(jnp.abs(x - y), 0.5 * (x + y), pairs.counts)
