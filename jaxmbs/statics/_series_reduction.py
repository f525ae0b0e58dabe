"""Series reduction of a network: dangling parts cut off, chains of bodies with two bonds each made one bond."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from ..runtime import tuning
from ._network import BodyNetwork


@dataclass(frozen=True, eq=False)
class SeriesReduction:
    """Nodes (bodies with three bonds or more) joined by chains of bonds.

    `chain` (q,): the chain of each bond, m for bonds of dangling parts; `sign` (q,): +1 where the bond points along
    its chain, -1 against it, 0 in dangling parts.  `ends` (m, 2): first and last node of every chain, `num_nodes` for
    the ground and the reference bodies of floating parts.  `edges`: pairs i < j of joined nodes, each once; `edge`
    (m,): the pair of each chain, `len(edges)` where it has none (to the ground, or from a node to itself).
    """

    chain: np.ndarray
    sign: np.ndarray
    ends: np.ndarray
    num_nodes: int
    edges: tuple[tuple[int, int], ...]
    edge: np.ndarray

    @property
    def num_chains(self) -> int:
        return len(self.ends)

    @property
    def is_small(self) -> bool:
        """True if sums along the chains are products with a dense matrix."""
        return self.num_chains * len(self.chain) <= tuning.SUM_PRODUCT

    @cached_property
    def chain_matrix(self) -> np.ndarray:
        """Signs (m, q) of the bonds of every chain."""
        rows = np.zeros((self.num_chains + 1, len(self.chain)))
        rows[self.chain, np.arange(len(self.chain))] = self.sign
        return rows[:-1]


def _prune(around, fixed):
    """Remove bodies with one bond until none is left; edits the lists of bonds around the bodies."""
    leaves = [k for k, bonds in enumerate(around) if len(bonds) == 1 and k not in fixed]
    while leaves:
        k = leaves.pop()
        if len(around[k]) != 1:
            continue
        ((bond, other, _),) = around[k]
        around[k] = []
        around[other] = [entry for entry in around[other] if entry[0] != bond]
        if len(around[other]) == 1 and other not in fixed:
            leaves.append(other)


@lru_cache(maxsize=64)
def series_reduction(network: BodyNetwork) -> SeriesReduction:
    """The reduction of a network, linear in its size."""
    p, q, around = len(network.bodies), len(network.bonds), network.adjacency()
    fixed = {p, *network.tree.references.tolist()}
    _prune(around, fixed)
    nodes = [k for k in range(p) if k not in fixed and len(around[k]) > 2]
    number = {**dict.fromkeys(fixed, len(nodes)), **{k: i for i, k in enumerate(nodes)}}
    chain, sign, ends = np.full(q, -1), np.zeros(q), []
    for start in number:
        for first in around[start]:
            if chain[first[0]] >= 0:
                continue
            bond, k, direction = first
            chain[bond], sign[bond] = len(ends), direction
            while k not in number:
                bond, k, direction = next(entry for entry in around[k] if entry[0] != bond)
                chain[bond], sign[bond] = len(ends), direction
            ends.append((number[start], number[k]))
    ends = np.array(ends, int).reshape(-1, 2)
    chain[chain < 0] = len(ends)
    joins = [(min(pair), max(pair)) for pair in ends.tolist()]
    edges = tuple(sorted({(i, j) for i, j in joins if i != j and j < len(nodes)}))
    place = {pair: i for i, pair in enumerate(edges)}
    return SeriesReduction(
        chain, sign, ends, len(nodes), edges, np.array([place.get(p, len(edges)) for p in joins], int)
    )
