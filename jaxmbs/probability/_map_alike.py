"""A function of each of many distributions, in one pass for those of one family."""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import PyTree


def map_alike(function: Callable[..., PyTree], *rows: Sequence[PyTree]) -> list[Any]:
    """Results of a function of an item of each row, `[function(*items) for items in zip(*rows)]`.

    Items of one structure and of equal shapes are stacked and mapped, so that a program has the function once for
    each family and not once for each of a hundred variables.
    """
    items, kinds = list(zip(*rows, strict=True)), {}
    for k, item in enumerate(items):
        leaves, structure = jax.tree.flatten(item)
        kinds.setdefault((structure, tuple(jnp.shape(leaf) for leaf in leaves)), []).append(k)
    found: list[Any] = [None] * len(items)
    for places in kinds.values():
        if len(places) == 1:
            found[places[0]] = function(*items[places[0]])
            continue
        stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(items[k] for k in places))
        values = jax.vmap(function)(*stacked)
        for j, k in enumerate(places):
            found[k] = jax.tree.map(lambda x, j=j: x[j], values)
    return found
