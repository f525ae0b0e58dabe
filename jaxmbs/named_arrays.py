"""Results by name that are few arrays: a program returns thousands of small ones slowly, and each costs equations."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .checks import is_concrete


class NamedRows(eqx.Module, Mapping):  # type: ignore[misc]
    """Things of equal structure by name, those of a group stacked.

    Attributes:
        groups: trees of arrays (..., n, *shape).
        names: of the n things of each group; ranks: number of axes of `shape` of each array.
    """

    groups: tuple[Any, ...]
    names: tuple[tuple[str, ...], ...] = eqx.field(static=True)
    ranks: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    @classmethod
    def of(cls, groups: Iterable[tuple[Iterable[str], Any]], leading: int = 0) -> "NamedRows":
        """From pairs of names and trees.  Args: leading: number of axes before that of the things."""
        names, trees = zip(*groups, strict=True) if (groups := list(groups)) else ((), ())
        ranks = (tuple(jnp.ndim(x) - leading - 1 for x in jax.tree.leaves(tree)) for tree in trees)
        return cls(tuple(trees), tuple(map(tuple, names)), tuple(ranks))

    def __getitem__(self, name: str) -> Any:
        for group, names, ranks in zip(self.groups, self.names, self.ranks, strict=True):
            if name in names:
                leaves, structure = jax.tree.flatten(group)
                k = names.index(name)
                places = (np.s_[..., k, *[slice(None)] * rank] for rank in ranks)
                return jax.tree.unflatten(structure, map(part_of, leaves, places))
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return (name for names in self.names for name in names)

    def __len__(self) -> int:
        return sum(map(len, self.names))


class NamedSlices(eqx.Module, Mapping):  # type: ignore[misc]
    """Parts of a vector by name.

    Attributes:
        vectors: tree of arrays (..., m).
        places: name, first place and end of each part.
    """

    vectors: Any
    places: tuple[tuple[str, int, int], ...] = eqx.field(static=True)

    def __getitem__(self, name: str) -> Any:
        found = {found: np.s_[..., first:end] for found, first, end in self.places}[name]
        return jax.tree.map(lambda x: part_of(x, found), self.vectors)

    def __iter__(self) -> Iterator[str]:
        return (name for name, *_ in self.places)

    def __len__(self) -> int:
        return len(self.places)


def element_of(stacked: Any, k: Any) -> Any:
    """Element k, or elements (n,), of a tree of stacked arrays."""
    return jax.tree.map(lambda x: x[k], stacked)


def elements_of(names: Iterable[str], stacked: Any) -> list[tuple[str, Any]]:
    """Names with the element of each, of a tree of stacked arrays (n, ...)."""
    return [(name, element_of(stacked, k)) for k, name in enumerate(names)]


def part_of(x: Any, place: Any) -> Any:
    """Part of an array, or of its shape.  By NumPy outside of traces: JAX compiles a program for every place."""
    if isinstance(x, jax.ShapeDtypeStruct):
        return jax.eval_shape(lambda x: x[place], x)
    return jnp.asarray(np.asarray(x)[place]) if is_concrete(x) else x[place]
