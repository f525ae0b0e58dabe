"""Rows of an array: the same function of many, a few at a time; those at static places, and sums over them."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ._remat import remat

#: Rows worked on side by side on the CPU: what they make together with the designs of a batch stays in the cache.
TOGETHER = 8


def map_chunked(function, rows):
    """`vmap` of a function over the leading axis of the pytree `rows`; on the CPU `TOGETHER` rows at a time.

    Along 101 saved states of 64 designs three times cheaper than all at once, and as cheap for one design.
    """
    number = len(jax.tree.leaves(rows)[0])
    if number <= TOGETHER or jax.default_backend() != "cpu":
        return jax.vmap(function)(rows)
    count = math.ceil(number / TOGETHER)

    def grouped(x):
        filled = jnp.concatenate([x, *[x[-1:]] * (count * TOGETHER - number)])
        return filled.reshape(count, TOGETHER, *x.shape[1:])

    # A gradient keeps the rows themselves and works out again what a row makes: some 50 kB each, dearer to fetch.
    found = lax.map(remat(jax.vmap(function)), jax.tree.map(grouped, rows))
    return jax.tree.map(lambda x: x.reshape(count * TOGETHER, *x.shape[2:])[:number], found)


#: Places that lie in so many runs are taken by slices, a few others by a product with so many entries.
RUNS, FEW = 6, 64


def gather_static(x, places):
    """Rows of x (n, ...) at static places, none of them negative.

    On the CPU the transpose of `x[places]` is a loop over the places, compiled and run, so few are taken otherwise.
    """
    places = np.asarray(places, np.int32)
    starts = np.flatnonzero(np.diff(places.reshape(-1), prepend=-2) != 1)
    if places.ndim == 1 and len(starts) > RUNS and places.size * len(x) <= FEW:
        return product((places[:, None] == np.arange(len(x))).astype(float), x)
    if places.ndim != 1 or not places.size or len(starts) > RUNS:
        return x.at[places].get(mode="promise_in_bounds", wrap_negative_indices=False)
    lengths = np.diff(np.append(starts, places.size))
    runs = [lax.slice_in_dim(x, a, a + n) for a, n in zip(places[starts].tolist(), lengths.tolist(), strict=True)]
    return runs[0] if len(runs) == 1 else jnp.concatenate(runs)


#: Sums over rows are products with a dense matrix up to so many of its entries.
SMALL = 4096


def segment_sum_static(x, places, size):
    """(size, ...): the rows of x (n, ...) added up at static places; those at the place `size` are left out."""
    places = np.asarray(places)
    if places.size * size <= SMALL:
        return product((places[None] == np.arange(size)[:, None]).astype(float), x)
    return jnp.zeros((size + 1, *x.shape[1:]), x.dtype).at[places].add(x)[:-1]


def product(matrix, x):
    """A static matrix (n, p) times the rows of x (p, ...)."""
    return jnp.tensordot(jnp.asarray(matrix, x.dtype), x, 1, precision=lax.Precision.HIGHEST)
