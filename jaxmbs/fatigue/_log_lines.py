"""Straight lines between points on log-log paper, with a step where a frequency stands twice."""

import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, is_concrete
from ..typing import AnyArray


def log_lines(at: AnyArray, frequencies: AnyArray, levels: AnyArray, side: str = "right") -> AnyArray:
    """Levels (...,) at positive frequencies, those of the ends outside; a level of zero leaves none on its lines.

    Args: side: of a step, "right" or "left", on which a value exactly at it is taken.
    """
    f, silent = frequencies, levels == 0
    x, y = jnp.log(f), jnp.log(jnp.where(silent, 1.0, levels))
    i = jnp.clip(jnp.searchsorted(f, at, side=side) - 1, 0, len(f) - 2)
    width = x[i + 1] - x[i]
    share = jnp.clip((jnp.log(at) - x[i]) / jnp.where(width > 0, width, 1.0), 0.0, 1.0)
    return jnp.where(silent[i] | silent[i + 1], 0.0, jnp.exp(y[i] + share * (y[i + 1] - y[i])))


def frequency_faults(frequencies: AnyArray) -> list[str]:
    """Sentences if the frequencies of a table (points,) are not positive and rising, a pair of equal ones excepted:
    there the level steps."""
    if any_concrete(lambda f: ~np.isfinite(f), frequencies):
        return ["frequencies must be finite"]
    if any_concrete(lambda f: f <= 0, frequencies):
        return ["frequencies must be positive: leave out points at 0 Hz and below"]
    if not is_concrete(frequencies):
        return []
    f = np.asarray(frequencies)
    falls = np.flatnonzero(np.diff(f) < 0)
    if len(falls):
        return [f"frequencies must rise: {f[falls[0] + 1]:g} stands after {f[falls[0]]:g}"]
    thrice = f[2:][f[2:] == f[:-2]]
    if len(thrice):
        return [f"the frequency {thrice[0]:g} stands more than twice: a step has a level before and one after it"]
    if f[0] == f[1] or f[-1] == f[-2]:
        return ["a step at an end of the table has a level on one side only: leave out the point outside"]
    return []
