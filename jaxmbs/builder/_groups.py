"""Groups of declared things of one structure, their parameters stacked."""

from collections.abc import Iterable, Iterator

import jax
import jax.numpy as jnp

from ._arrays import stack


def group_by_structure(items: Iterable[tuple]) -> Iterator[tuple]:
    """Items (name, law, first, second, extra) of equal structure, their arrays stacked: (extra, names, law, first,
    second, members) of each group."""
    groups: dict = {}
    for item in items:
        leaves, treedef = jax.tree.flatten(item[1])
        key = (item[4], treedef, tuple(jnp.shape(leaf) for leaf in leaves))
        groups.setdefault(key, []).append(item)
    for (port, *_), members in groups.items():
        names, laws, first, second, _ = zip(*members, strict=True)
        yield port, names, jax.tree.map(lambda *x: stack(x), *laws), first, second, members
