"""The static shape of a kinematic tree, in depth-first order."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Tree:
    """Parents of a depth-first numbered tree; -1 is the root (the ground).

    Depth first means that the subtree of k is the range `k : end[k]`.  Hashable by content, so that two builds of
    one topology share compiled code.  Source: S2 (1), the connection map T(k).
    """

    parent: tuple[int, ...]

    @property
    def size(self) -> int:
        return len(self.parent)

    @cached_property
    def is_chain(self) -> bool:
        return all(p == k - 1 for k, p in enumerate(self.parent))

    @cached_property
    def depth(self) -> np.ndarray:
        depth = np.zeros(self.size, np.int32)
        for k, p in enumerate(self.parent):
            depth[k] = 0 if p < 0 else depth[p] + 1
        return depth

    @cached_property
    def end(self) -> np.ndarray:
        end = np.arange(self.size) + 1
        for k in reversed(range(self.size)):
            if self.parent[k] >= 0:
                end[self.parent[k]] = max(end[self.parent[k]], end[k])
        return end

    @cached_property
    def path(self) -> np.ndarray:
        """(size, size) bool: `path[k, j]` says that j is k or lies on the way from the root to k."""
        j = np.arange(self.size)
        return (j[None, :] <= j[:, None]) & (j[:, None] < self.end[None, :])

    @cached_property
    def continues_chain(self) -> np.ndarray:
        """Boolean mask (size,) of the nodes whose next node is their child, so that both belong to one chain."""
        return np.array([k + 1 < self.size and self.parent[k + 1] == k for k in range(self.size)])

    @cached_property
    def starts(self) -> np.ndarray:
        """First nodes of the chains that branch off from a node whose own chain continues."""
        return np.array([k for k in range(1, self.size) if self.parent[k] != k - 1], int)

    @cached_property
    def hanging(self) -> np.ndarray:
        """Boolean matrix (size, starts): True where the chain of that start is outward of the node."""
        return self.path[self.starts].T & (self.starts[None, :] != np.arange(self.size)[:, None])

    @cached_property
    def parent_or_size(self) -> np.ndarray:
        """Parents with the ground as index `size`: for gathers from arrays with one padding row."""
        return np.asarray([self.size if p < 0 else p for p in self.parent], np.int32)


def depth_first(parent: dict) -> list:
    """Depth-first order of the keys of `parent` (key -> parent key, or None for the root), in insertion order."""
    children = {}
    for key, p in parent.items():
        children.setdefault(p, []).append(key)
    order, stack = [], list(reversed(children.get(None, [])))
    while stack:
        key = stack.pop()
        order.append(key)
        stack.extend(reversed(children.get(key, [])))
    return order
