"""Both sides of the jumps of y: what the actions of events start from and what they leave, kept in their order."""

import functools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float, PyTree


class Jumps(eqx.Module):
    """The jumps of a motion by their numbers.

    Attributes:
        times: (n,) of the loop, zero for those to come.
        before, after: y (n, ...) on both sides.
    Inside the loop they have a row more, scratch space for discarded writes.
    """

    times: Float[Array, "..."]
    before: PyTree
    after: PyTree

    @classmethod
    def empty(cls, y: PyTree, t: Array, size: int) -> "Jumps":
        """Rows for so many jumps."""
        rows = lambda: jax.tree.map(lambda x: jnp.zeros((size + 1, *x.shape), x.dtype), y)
        return cls(jnp.zeros(size + 1, t.dtype), rows(), rows())

    def with_jump(self, number: Array, happens: Array, t: Array, before: PyTree, after: PyTree) -> "Jumps":
        """With the jump of this number, where it happens."""
        put = functools.partial(lax.dynamic_update_index_in_dim, axis=0, allow_negative_indices=False)
        place = jnp.where(happens, number, len(self.times) - 1)
        return jax.tree.map(lambda rows, x: put(rows, x, place), self, Jumps(t, before, after))

    def finished(self) -> "Jumps":
        """Without the scratch row."""
        return jax.tree.map(lambda rows: rows[:-1], self)


def jump_cotangents(jumps_bar: Jumps, number: Array, happens: Array) -> tuple[Any, Any]:
    """Cotangents of (y before, y after) the jump of this number; zero where none happens."""
    row = lambda rows: jnp.where(happens, rows[jnp.minimum(number, len(rows) - 1)], 0.0)
    return jax.tree.map(row, jumps_bar.before), jax.tree.map(row, jumps_bar.after)
