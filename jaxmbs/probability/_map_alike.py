"""A function of each of many distributions, in one pass for those of one family."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float, PyTree


def map_alike(function: Callable[..., PyTree], *rows: Sequence[PyTree]) -> list[Any]:
    """Results of a function of an item of each row, `[function(*items) for items in zip(*rows)]`.

    Items of one structure and of equal shapes are stacked and mapped, so that a program has the function once for
    each family and not once for each of a hundred variables.
    """
    items = list(zip(*rows, strict=True))
    kinds = _kinds(items)
    found: list[Any] = [None] * len(items)
    for places in kinds.values():
        if len(places) == 1:
            found[places[0]] = function(*items[places[0]])
            continue
        stacked = _stacked(items, places)
        values = jax.vmap(function)(*stacked)
        for j, k in enumerate(places):
            found[k] = jax.tree.map(lambda x, j=j: x[j], values)
    return found


def row_alike(
    function: Callable[..., Array], items: Sequence[PyTree], numbers: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Row of a function of an item and a number of a row each, as `map_alike`; the row is not taken apart, which a
    program of derivatives of second order had some hundred equations for, for each number."""
    kinds = list(_kinds(items).values())
    parts = [_of_kind(function, items, places, numbers) for places in kinds]
    order = np.argsort(np.concatenate(kinds))
    row = jnp.concatenate(parts) if len(parts) > 1 else parts[0]
    return row if np.array_equal(order, np.arange(order.size)) else row[order]


def _of_kind(function, items, places, numbers):
    """A function of the items at some places and of their numbers (n,)."""
    if len(places) == 1:  # as it is: mapped over one item it has more equations
        return function(items[places[0]], numbers[places[0]])[None]
    one_by_one = len(places) < len(items)
    return jax.vmap(function)(_stacked(items, places), numbers[np.array(places)] if one_by_one else numbers)


def _kinds(items):
    """Places of the items of one structure and of equal shapes, by both."""
    kinds: dict = {}
    for k, item in enumerate(items):
        leaves, structure = jax.tree.flatten(item)
        kinds.setdefault((structure, tuple(jnp.shape(leaf) for leaf in leaves)), []).append(k)
    return kinds


def _stacked(items, places):
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *(items[k] for k in places))
