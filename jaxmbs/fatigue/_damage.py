"""Damage of a history by Miner's sum over its rainflow cycles."""

import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, as_flag, not_positive
from ..runtime import as_dtype
from ..typing import ArrayLike, Scalar
from ._cycles import Cycles, rainflow
from ._sn import SN

MEANS = ("goodman", "gerber", "swt")


def damage(
    history: ArrayLike | Cycles,
    sn: SN,
    mean: str | None = None,
    ultimate: ArrayLike | None = None,
) -> Scalar:
    """Damage () of a stress history: the sum of counts over cycles to failure (Palmgren, Miner).

    Args:
        history: (samples,), or the `rainflow` cycles of one.
        sn: S-N curve at zero mean stress.
        mean: correction of amplitudes for mean stress S_m: None; "goodman", `S_a / (1 - S_m / S_u)`; "gerber",
            `S_a / (1 - (S_m / S_u)^2)` in tension; "swt" (Smith, Watson, Topper), `sqrt(S_max S_a)`, no damage where
            the maximum is compressive.
        ultimate: S_u > 0, for "goodman" and "gerber".  A mean at or above it is infinite damage.

    Life in histories is the reciprocal.

    Raises: ValueError for another `mean`, and an `ultimate` that is missing, not positive or not used.
    """
    _check_mean(mean, ultimate)
    cycles = history if isinstance(history, Cycles) else rainflow(history)
    amplitudes, broken = _corrected(cycles, mean, ultimate)
    total = jnp.sum(cycles.counts * sn.damage(amplitudes))
    breaks = jnp.any(broken & (cycles.counts > 0) & (cycles.ranges > 0))
    return jnp.where(breaks, jnp.inf, total)


def _check_mean(mean, ultimate):
    if mean is not None and mean not in MEANS:
        raise ValueError(f"mean = {mean!r} must be None or one of {', '.join(map(repr, MEANS))}")
    needs = mean in ("goodman", "gerber")
    if needs and (ultimate is None or _not_positive_number(ultimate)):
        raise ValueError(f"mean = {mean!r} needs a positive ultimate strength, got ultimate = {ultimate}")
    if not needs and ultimate is not None:
        raise ValueError(f"mean = {mean!r} does not use the ultimate strength: leave it out")


def _not_positive_number(value):
    return np.ndim(value) > 0 or any_concrete(lambda x: ~(np.isfinite(x) & (x > 0)), value)


def _corrected(cycles, mean, ultimate):
    """Amplitudes at zero mean that do the same damage, and whether the mean alone breaks the part."""
    amplitude, middle = cycles.amplitudes, cycles.means
    if mean is None:
        return amplitude, jnp.zeros(amplitude.shape, bool)
    if mean == "swt":
        product = (middle + amplitude) * amplitude
        pulls = product > 0
        return jnp.where(pulls, jnp.sqrt(jnp.where(pulls, product, 1.0)), 0.0), jnp.zeros(amplitude.shape, bool)
    share = middle / as_dtype(ultimate, middle.dtype)
    reserve = 1 - share if mean == "goodman" else 1 - jnp.maximum(share, 0.0) ** 2
    broken = reserve <= 0
    return amplitude / jnp.where(broken, 1.0, reserve), broken


def equivalent_load(
    history: ArrayLike | Cycles,
    slope: ArrayLike,
    cycles: ArrayLike = 1.0,
    *,
    ranges: bool = False,
) -> Scalar:
    """Damage-equivalent load (): the amplitude whose `cycles` cycles damage as much as the history does.

    Args:
        history: (samples,), or the `rainflow` cycles of one.
        slope: > 0, of an S-N curve without knee; cycles: > 0, number of cycles.
        ranges: true for the range in place of the amplitude, as wind turbines have it.

    Raises: ValueError, if concrete, for numbers that are not positive.
    """
    if not_positive(slope) or _not_positive_number(cycles):
        raise ValueError(f"slope = {slope} and cycles = {cycles} must be positive numbers")
    total = damage(history, SN(1.0, slope))
    total = total / as_dtype(cycles, total.dtype)
    moves = total > 0
    amplitude = jnp.where(moves, jnp.where(moves, total, 1.0) ** (1 / as_dtype(slope, total.dtype)), total)
    return 2 * amplitude if as_flag("ranges", ranges) else amplitude
