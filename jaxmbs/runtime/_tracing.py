"""Numbers known on the host made arrays of JAX without a program: `jnp.asarray` compiles one for every shape."""

import contextlib
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.extend.core import get_opaque_trace_state
from jax.typing import DTypeLike

from ..checks import is_concrete, require_reals
from ..typing import ArrayLike

#: The state of JAX without a trace, and those that evaluate as it does.
OUTSIDE = get_opaque_trace_state()
_OUTSIDE = [OUTSIDE]
_NOTHING = contextlib.nullcontext()


def current_trace_state() -> Any:
    """The state of the trace under way, to be compared."""
    return get_opaque_trace_state()


def add_outside(state: Any) -> None:
    """Count a state of JAX as one without a trace."""
    _OUTSIDE.append(state)


def evaluated_plainly() -> contextlib.AbstractContextManager:
    """A context in which operations are JAX's own again, where `not_tracing`."""
    return _NOTHING if get_opaque_trace_state() == OUTSIDE else jax.core.eval_context()


def not_tracing() -> bool:
    """True if no trace is under way: neither a jit, nor a grad, nor a vmap of the user's."""
    return get_opaque_trace_state() in _OUTSIDE


def closes_over_traced(function: Any) -> bool:
    """True for a function that closes over numbers that are traced, itself or by functions that it closes over."""
    seen, open_ones = set(), [function]
    while open_ones:
        one = open_ones.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        parts = [getattr(one, name, None) for name in ("__wrapped__", "__self__", "func", "args", "keywords")]
        for cell in getattr(one, "__closure__", None) or ():
            with contextlib.suppress(ValueError):  # of a name that has no value yet
                parts.append(cell.cell_contents)
        found = jax.tree.leaves(parts)
        if not is_concrete(found):
            return True
        open_ones += [part for part in found if callable(part)]
    return False


def as_array(x: ArrayLike, dtype: DTypeLike | None = float) -> Array:
    """x as an array of a type, or of its own (None); traced where it is, or where a trace is under way.

    Raises: TypeError for complex numbers where they are to be real.
    """
    if x is None:
        raise TypeError("real numbers are needed, got None")
    if dtype is float:
        require_reals(x)
    if isinstance(x, Array) or not is_concrete(x) or not not_tracing():
        return jnp.asarray(x, dtype)
    return jax.device_put(np.asarray(x, dtype))


def as_host_array(x: ArrayLike, dtype: DTypeLike | None = float) -> Any:
    """x for a compiled program: as `as_array`, but what is known on the host stays there until the call, which moves
    all arguments at once; on their own they take 50 microseconds each, as long as a step of a small mechanism."""
    if isinstance(x, Array) or not is_concrete(x) or not not_tracing():
        return as_array(x, dtype)
    if dtype is float:
        require_reals(x)
    return np.asarray(x, dtype)


def as_dtype(x: ArrayLike, dtype: DTypeLike) -> Array:
    """x as an array of a type, that of what it is used with.

    Raises: TypeError for complex numbers that would lose a part in silence.
    """
    if not np.issubdtype(dtype, np.complexfloating):
        require_reals(x)
    return jnp.asarray(x, dtype)
