"""Rows of an array: rows at constant places, sums over them, and a function of every row, a few at a time."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.custom_batching import custom_vmap

from . import _tuning as tuning
from ._progress import ON_TAPE
from ._remat import remat
from ._tricks import is_on


def map_chunked(function, rows):
    """`vmap` of a function over the leading axis of the pytree `rows`; on the CPU a few rows at a time.

    Along 101 saved states of 64 designs three times cheaper than all at once, and as cheap for one design.  The last
    chunk is filled up: `lax.map(batch_size=)` compiles the function a second time for the rest.
    """
    number = len(jax.tree.leaves(rows)[0])
    # A tape runs rows one by one as fast, and a program of one row is traced in half the time.
    if ON_TAPE.value and number > 1 and is_on("chunked_maps"):
        of_row = lambda row: function(row)  # which JAX can hash: converted closures cannot be
        return lax.map(remat(of_row) if number > tuning.ROWS_TOGETHER else of_row, rows)
    if number <= tuning.ROWS_TOGETHER or not is_on("chunked_maps") or jax.default_backend() != "cpu":
        return jax.vmap(function)(rows)
    count = math.ceil(number / tuning.ROWS_TOGETHER)

    def grouped(x):
        filled = jnp.concatenate([x, *[x[-1:]] * (count * tuning.ROWS_TOGETHER - number)])
        return filled.reshape(count, tuning.ROWS_TOGETHER, *x.shape[1:])

    # A gradient keeps the rows themselves and works out again what a row makes: some 50 kB each, dearer to fetch.
    found = lax.map(remat(jax.vmap(function)), jax.tree.map(grouped, rows))
    return jax.tree.map(lambda x: x.reshape(count * tuning.ROWS_TOGETHER, *x.shape[2:])[:number], found)


def chunked_vmap(function):
    """A function of pytrees whose `vmap` over the first one works on a few rows at a time, as `map_chunked`.

    Over the other arguments alone it works on all rows at once.  No derivative passes.
    """
    single = custom_vmap(function)

    @single.def_vmap
    def _(size, batched, *args):
        leaves, shape = jax.tree.flatten(args)
        moves = jax.tree.leaves(batched)
        fixed = [x for x, is_batched in zip(leaves, moves, strict=True) if not is_batched]

        def of_row(row, *fixed):
            row, fixed = iter(row), iter(fixed)
            return function(*jax.tree.unflatten(shape, [next(row if is_batched else fixed) for is_batched in moves]))

        # itself a `chunked_vmap`, for a batch of batches
        by_rows = map_chunked if any(jax.tree.leaves(batched[0])) else lambda one, rows: jax.vmap(one)(rows)
        together = chunked_vmap(lambda rows, *fixed: by_rows(lambda row: of_row(row, *fixed), rows))
        found = together([x for x, is_batched in zip(leaves, moves, strict=True) if is_batched], *fixed)
        return found, jax.tree.map(lambda _: True, found)

    return single


def gather_static(x, places):
    """Rows of x (n, ...) at static places, none of them negative.

    On the CPU the transpose of `x[places]` is a loop over the places, compiled and run, so few are taken otherwise.
    """
    places = np.asarray(places, np.int32)
    if not is_on("static_gathers"):
        return x.at[places].get(mode="promise_in_bounds", wrap_negative_indices=False)
    starts = np.flatnonzero(np.diff(places.reshape(-1), prepend=-2) != 1)
    if places.ndim == 1 and len(starts) > tuning.SLICED_RUNS and places.size * len(x) <= tuning.GATHER_PRODUCT:
        return constant_product((places[:, None] == np.arange(len(x))).astype(float), x)
    if places.ndim != 1 or not places.size or len(starts) > tuning.SLICED_RUNS:
        return x.at[places].get(mode="promise_in_bounds", wrap_negative_indices=False)
    lengths = np.diff(np.append(starts, places.size))
    runs = [lax.slice_in_dim(x, a, a + n) for a, n in zip(places[starts].tolist(), lengths.tolist(), strict=True)]
    return runs[0] if len(runs) == 1 else jnp.concatenate(runs)


def segment_sum_static(x, places, size):
    """(size, ...): the rows of x (n, ...) added up at static places; those at the place `size` are left out."""
    places = np.asarray(places)
    if np.array_equal(places, np.arange(size)):
        return x
    if places.size * size <= tuning.SUM_PRODUCT and is_on("static_gathers"):
        return constant_product((places[None] == np.arange(size)[:, None]).astype(float), x)
    return jnp.zeros((size + 1, *x.shape[1:]), x.dtype).at[places].add(x)[:-1]


def constant_product(matrix, x):
    """A static matrix (n, p) times the rows of x (p, ...)."""
    return jnp.tensordot(jnp.asarray(matrix, x.dtype), x, 1, precision=lax.Precision.HIGHEST)
