"""Control flow under `vmap`: conditions of all lanes of a batch, and work for those lanes alone that need it."""

from collections.abc import Callable

import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jax import lax
from jax.custom_batching import custom_vmap
from jaxtyping import Array


def any_in_batch(condition: Array) -> Array:
    """True if the condition () holds in any lane of the batches around it.

    As the condition of a `while_loop` it is not batched: were it each lane's own, every pass would copy all that the
    loop carries, to keep what lanes that have ended hold.
    """
    return eqxi.unvmap_any(condition)


def lazy_where(good: Array, value: Array, compute: Callable, *args) -> Array:
    """The value where `good` (), else `compute(*args)`, of a shape; no derivative in reverse mode.

    In a batch it runs for those lanes alone that are not good, one after the other: a `cond` under `vmap` does both.
    `compute` closes over no traced array.
    """

    @custom_vmap
    def select(good, value, *args):
        return lax.cond(good, lambda: value, lambda: compute(*args))

    @select.def_vmap
    def _(size, batched, *args):
        leaves, tree = jax.tree.flatten(args)
        moves = jax.tree.leaves(batched)
        moving = [x for x, is_moving in zip(leaves, moves, strict=True) if is_moving]

        def call(moved):
            moved = iter(moved)
            pairs = zip(leaves, moves, strict=True)
            return select(*tree.unflatten([next(moved) if is_moving else x for x, is_moving in pairs]))

        good, value = args[:2]
        value = value if batched[1] else jnp.broadcast_to(value, (size, *value.shape))
        return lax.cond(jnp.all(good), lambda: value, lambda: lax.map(call, moving)), True

    return select(good, value, *args)
