"""Times to save of a motion."""

from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import is_concrete
from ..runtime import as_dtype, as_host_array
from ..typing import AnyArray, ArrayLike

EARLY = 1e-12  # a time to save that is at most so long before the start [s] is the start: rounding of `linspace`
_DEFAULT_NUMBER = 101  # of saved times: a picture's worth, and an even part of the motion between two


def save_times(t0: ArrayLike, t1: ArrayLike | None, ts: ArrayLike | None, dtype: Any = float) -> AnyArray:
    """The times to save (T,), by default 101 equal steps to t1.

    Raises: ValueError, if concrete, for times that cannot be saved.
    """
    if ts is None:
        if t1 is None:
            raise ValueError("give t1= (end time) or ts= (times to save)")
        _check_end(t0, t1)
        if not is_concrete(t0, t1):
            return jnp.linspace(jnp.asarray(t0), as_dtype(t1, jnp.result_type(dtype)), _DEFAULT_NUMBER)
        equal = np.linspace(np.asarray(t0), np.asarray(t1, float), _DEFAULT_NUMBER)
        return as_host_array(equal, dtype)
    ts = as_host_array(ts, dtype)
    if is_concrete(t0, ts) and not np.all(np.isfinite(ts)):
        raise ValueError(f"ts must be finite times, got {np.asarray(ts)[~np.isfinite(ts)][:3]}")
    if ts.ndim != 1 or ts.shape[0] == 0:
        raise ValueError(f"ts must be a list of times, got shape {ts.shape}")
    if is_concrete(t0, ts) and (np.any(np.diff(ts) < 0) or np.asarray(ts)[0] < np.asarray(t0) - EARLY):
        raise ValueError(f"ts must increase and start at or after the start of the motion at {np.asarray(t0)}")
    if t1 is not None:
        _check_end(t0, t1)
    if t1 is not None and is_concrete(t0, ts, t1) and np.asarray(ts)[-1] > np.asarray(t1):
        raise ValueError(f"ts must end at or before t1={t1}, got {float(ts[-1])}")
    return ts


def _check_end(t0, t1):
    """Raises: ValueError for an end time that is concrete, and not finite or before the start."""
    if is_concrete(t0, t1) and not (np.isfinite(t1) and np.asarray(t1) >= np.asarray(t0)):
        raise ValueError(f"t1={t1} must be a finite time, not before the start of the motion at {float(t0)}")


def valid_times(ts: Array, t0: Array, t1: Array) -> tuple[Array, Array]:
    """The times, NaN if they do not increase from the start to the end; and True if all are finite (traceable)."""
    rising = jnp.all(ts[1:] >= ts[:-1]) & (ts[0] >= t0 - EARLY) & (ts[-1] <= t1)
    ts = jnp.where(rising, ts, jnp.nan)
    return ts, jnp.all(jnp.isfinite(ts)) & jnp.isfinite(t1)
