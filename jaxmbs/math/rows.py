"""The same function of many rows, a few at a time."""

import math

import jax
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
