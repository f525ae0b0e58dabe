"""Sparsity pattern of a block matrix: a graph of named blocks, static and hashable."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import check_count, distinct_names, require_numbers
from ..typing import ArrayLike


class Pattern:
    """A graph whose nodes are the diagonal blocks and whose edges are the pairs of blocks that couple.

    All blocks have one `size`; smaller ones (`sizes`) are padded, and the factorisation puts ones on their padding.
    Equal patterns hash alike, so that they share compiled code and one symbolic analysis.

    Args:
        num_blocks: number of diagonal blocks.
        size: coordinates of a block.
        edges: pairs (i, j) of blocks that couple, in any order; repeated ones count once.
        names: of the blocks, for reports and `split`; default their numbers.
        sizes: of the blocks, where some are smaller.

    Raises: ValueError for an edge to a block that is not there or from a block to itself, or a wrong count.
    """

    def __init__(
        self,
        num_blocks: int,
        size: int,
        edges: np.ndarray | Iterable,
        names: Sequence[str] | None = None,
        sizes: ArrayLike | None = None,
    ) -> None:
        check_count("size", size)
        if not isinstance(edges, np.ndarray):
            edges = list(edges)
            require_numbers(edges=edges)
        pairs = np.sort(np.asarray(edges, np.int64), axis=-1)
        pairs = np.unique(pairs.reshape(-1, 2), axis=0)
        if pairs.size and (pairs.min() < 0 or pairs.max() >= num_blocks or np.any(pairs[:, 0] == pairs[:, 1])):
            raise ValueError(f"edges must join two different blocks of 0 ... {num_blocks - 1}")
        names = names if names is None else distinct_names("names", names)
        if names is not None and len(set(names)) != num_blocks:
            raise ValueError(f"{num_blocks} blocks need {num_blocks} different names, got {len(set(names))}")
        self.num_blocks, self.size, self.edges = int(num_blocks), int(size), pairs
        self.names = None if names is None else tuple(names)
        self.sizes = np.full(num_blocks, size) if sizes is None else np.asarray(sizes, np.int64)
        if self.sizes.shape != (num_blocks,) or np.any(self.sizes > size) or np.any(self.sizes < 0):
            raise ValueError(f"sizes must be {num_blocks} numbers of at most {size}")
        content = hashlib.sha256(pairs.tobytes() + self.sizes.tobytes() + repr(self.names).encode())
        self._key = (self.num_blocks, self.size, content.digest())
        self._hash = hash(self._key)

    @classmethod
    def from_graph(cls, blocks: Mapping[str, int], edges: Iterable) -> "Pattern":
        """Pattern of sizes by name and pairs of names: `Pattern.from_graph({"a": 6, "b": 3}, [("a", "b")])`."""
        index = {name: i for i, name in enumerate(blocks)}
        for pair in edges:
            for name in pair:
                if name not in index:
                    raise ValueError(f"edge {tuple(pair)!r}: no block is named {name!r}")
        sizes = list(blocks.values())
        return cls(len(index), max(sizes), [(index[a], index[b]) for a, b in edges], tuple(index), sizes)

    def __hash__(self):
        return self._hash

    def __eq__(self, other):
        return self is other or (isinstance(other, Pattern) and self._key == other._key)

    def __repr__(self):
        return f"Pattern({self.num_blocks} blocks of {self.size}, {len(self.edges)} edges)"

    @property
    def num_edges(self) -> int:
        return len(self.edges)

    @property
    def shape(self) -> tuple[int, int]:
        return self.num_blocks, self.size

    @cached_property
    def padding(self) -> np.ndarray:
        """Flags (blocks, size) of coordinates that pad a smaller block."""
        return np.arange(self.size)[None, :] >= self.sizes[:, None]

    @cached_property
    def neighbours(self) -> list[list[int]]:
        """Neighbours of every block, in ascending order."""
        lists = [[] for _ in range(self.num_blocks)]
        for i, j in self.edges.tolist():
            lists[i].append(j)
            lists[j].append(i)
        return lists

    @cached_property
    def edge_index(self) -> dict[tuple[int, int], int]:
        """Numbers of the edges (i, j), i < j."""
        return {(i, j): e for e, (i, j) in enumerate(self.edges.tolist())}

    def split(self, x: Array | np.ndarray) -> dict:
        """Split x (..., blocks, size) into vectors by block name, without padding."""
        names = self.names or [str(i) for i in range(self.num_blocks)]
        return {name: x[..., i, : int(self.sizes[i])] for i, name in enumerate(names)}

    def join(self, parts: Mapping) -> Array:
        """Join vectors by block name to x (..., blocks, size); other blocks are zero."""
        names = self.names or [str(i) for i in range(self.num_blocks)]
        shape = jnp.broadcast_shapes(*(jnp.shape(v)[:-1] for v in parts.values()))
        dtype = jnp.result_type(*parts.values())
        rows = []
        for name, size in zip(names, self.sizes, strict=True):
            v = (
                jnp.broadcast_to(parts[name], (*shape, int(size)))
                if name in parts
                else jnp.zeros((*shape, int(size)))
            )
            rows.append(jnp.pad(v.astype(dtype), [(0, 0)] * len(shape) + [(0, self.size - int(size))]))
        return jnp.stack(rows, axis=-2)
