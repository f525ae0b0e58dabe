"""Loops of a batch, each lane of which stops by its own condition, as loops that run while any lane goes on."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax


def is_batched(params: dict) -> bool:
    """True if a loop's condition is one for each lane, of the first axes of all that it carries."""
    return bool(params["cond_jaxpr"].out_avals[0].shape)


def batched_loop(goes_on: Callable, move: Callable) -> tuple[Callable, Callable]:
    """Condition and body of the loop over all lanes: those that have stopped keep what they carry."""

    def move_some(carried: Any) -> Any:
        going = goes_on(carried)
        wide = lambda x: lax.broadcast_in_dim(going, x.shape, range(going.ndim))
        return jax.tree.map(lambda new, old: lax.select(wide(new), new, old), move(carried), carried)

    return lambda carried: jnp.any(goes_on(carried)), move_some
