"""Double precision switched on, or off, in the middle of a process."""

import gc
from collections.abc import MutableMapping

import jax
import jax.numpy as jnp
import numpy as np

from ._tracing import not_tracing

_seen: set[bool] = set()  # the setting at the last call, once there was one
_caches: list[MutableMapping] = []


def is_double() -> bool:
    """True if floats are double precision (`jax_enable_x64`)."""
    return jnp.result_type(float) == np.float64


def forget_with_programs(cache: MutableMapping) -> None:
    """Empty the cache, which holds what JAX has traced, where all programs are forgotten."""
    _caches.append(cache)


def follow_precision() -> None:
    """Forget all compiled programs if `jax_enable_x64` was switched since the last call.

    For as long as a program that JAX traced holds a NumPy array, JAX takes the copy that it made of it for later
    programs too, in the precision of the first one: index arrays then meet integers of another type, and numbers
    have lost half of their digits.  This concerns the constants of every library, so only the programs can go.
    Nothing happens inside of a trace.
    """
    double = is_double()
    if double in _seen or not not_tracing():
        return
    if _seen:
        jax.clear_caches()
        for cache in _caches:
            cache.clear()
        gc.collect()  # programs that refer to themselves hold their arrays as well
        _seen.clear()
    _seen.add(double)
