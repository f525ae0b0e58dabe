"""Rows of an array: the same function of many, a few at a time; those at static places, and sums over them."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

#: Rows worked on side by side on the CPU: what they make together with the designs of a batch stays in the cache.
TOGETHER = 8


def over_rows(function, rows):
    """`vmap` of a function over the leading axis of the pytree `rows`; on the CPU `TOGETHER` rows at a time.

    Along 101 saved states of 64 designs three times cheaper than all at once, and as cheap for one design.
    """
    number = len(jax.tree.leaves(rows)[0])
    if number <= TOGETHER or jax.default_backend() != "cpu":
        return jax.vmap(function)(rows)
    count = math.ceil(number / TOGETHER)
    index = np.minimum(np.arange(count * TOGETHER), number - 1).reshape(count, TOGETHER)
    # A gradient keeps the rows themselves and works out again what a row makes: some 50 kB each, dearer to fetch.
    found = lax.map(jax.checkpoint(jax.vmap(function), prevent_cse=False), jax.tree.map(lambda x: x[index], rows))
    return jax.tree.map(lambda x: x.reshape(count * TOGETHER, *x.shape[2:])[:number], found)


def take(x, places):
    """Rows of x (n, ...) at static places, none of them negative: without the tests that `x[places]` compiles."""
    return x.at[np.asarray(places, np.int32)].get(mode="promise_in_bounds", wrap_negative_indices=False)


#: Sums over rows are products with a dense matrix up to so many of its entries.
SMALL = 4096


def summed(x, places, size):
    """(size, ...): the rows of x (n, ...) added up at static places; those at the place `size` are left out."""
    places = np.asarray(places)
    if places.size * size <= SMALL:
        return product((places[None] == np.arange(size)[:, None]).astype(float), x)
    return jnp.zeros((size + 1, *x.shape[1:]), x.dtype).at[places].add(x)[:-1]


def product(matrix, x):
    """A static matrix (n, p) times the rows of x (p, ...)."""
    return jnp.tensordot(jnp.asarray(matrix, x.dtype), x, 1)
