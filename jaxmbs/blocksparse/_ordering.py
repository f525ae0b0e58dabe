"""Elimination orders: nested dissection of the graph (A. George, SIAM J. Numer. Anal. 10 (1973) 345), or the user's.

Separators are centroids of trees, planes where positions are known, else level sets.  A dissection is a list of
supernodes `(blocks, parent)`, parents first; blocks below different children of a supernode are not coupled.  On a
chain it is block cyclic reduction: depth log2(n), work O(n).
"""

import numpy as np

from ._pattern import Pattern


def nested_dissection(pattern: Pattern, leaf: int | None = None, positions=None, last=()):
    """Supernodes of a nested dissection by recursive separators.

    Args:
        leaf: parts of at most this many blocks are not divided further; default about 12 coordinates.
        positions: (blocks, d) points; separators are then planes across the longest side (meshes).
        last: blocks to be eliminated last, in the root.
    """
    graph = _Graph(pattern, None if positions is None else np.asarray(positions, float))
    leaf = max(1, 12 // pattern.size) if leaf is None else leaf
    supernodes, stack = [], []
    everything, root = list(range(pattern.num_blocks)), -1
    if len(last):
        supernodes.append((sorted({int(k) for k in last}), -1))
        everything, root = [k for k in everything if k not in set(supernodes[0][0])], 0
    stack = [(part, root) for part in graph.components(everything)]
    while stack:
        part, parent = stack.pop()
        separator = part if len(part) <= leaf else graph.separator(part)
        if len(separator) > 0.7 * len(part):  # a separator that leaves so little saves no work: one dense front
            separator = part
        supernodes.append((separator, parent))
        if len(separator) < len(part):
            cut = set(separator)
            rest = [v for v in part if v not in cut]
            stack += [(component, len(supernodes) - 1) for component in graph.components(rest)]
    return supernodes


def elimination_tree(pattern: Pattern, order):
    """Supernodes of one block each, eliminated in the user's order: the elimination tree.

    Raises: ValueError unless `order` names every block once.
    """
    order = [int(v) for v in order]
    if sorted(order) != list(range(pattern.num_blocks)):
        raise ValueError(f"order must be a permutation of 0 ... {pattern.num_blocks - 1}")
    place = {v: k for k, v in enumerate(order)}
    reach: list[set[int]] = [set()] * len(order)
    parent = [-1] * len(order)
    waiting = [[] for _ in order]
    for k, v in enumerate(order):
        later = {w for w in pattern.neighbours[v] if place[w] > k}
        later.update(*(reach[c] for c in waiting[k]))
        later.discard(v)
        reach[k] = later
        if later:
            parent[k] = min(place[w] for w in later)
            waiting[parent[k]].append(k)
    number = {k: len(order) - 1 - k for k in range(len(order))}
    return [([order[k]], number.get(parent[k], -1)) for k in reversed(range(len(order)))]


class _Graph:
    """Parts of a pattern's graph; a part is a list of blocks."""

    def __init__(self, pattern, positions):
        self.neighbours, self.positions = pattern.neighbours, positions
        self.inside = np.zeros(pattern.num_blocks, bool).tolist()

    def components(self, part):
        inside, found = self.inside, []
        for v in part:
            inside[v] = True
        for seed in part:
            if inside[seed]:
                inside[seed] = False
                found.append(self._reach(seed))
        return found

    def _reach(self, seed):
        inside, neighbours, order = self.inside, self.neighbours, [seed]
        for v in order:
            for w in neighbours[v]:
                if inside[w]:
                    inside[w] = False
                    order.append(w)
        return order

    def levels(self, part, seed):
        """Level sets of the part around a block: the order of visits, and the level of each."""
        inside, neighbours = self.inside, self.neighbours
        for v in part:
            inside[v] = True
        inside[seed], order, level = False, [seed], {seed: 0}
        for v in order:
            for w in neighbours[v]:
                if inside[w]:
                    inside[w], level[w] = False, level[v] + 1
                    order.append(w)
        return order, level

    def separator(self, part):
        order, level = self.levels(part, part[0])
        edges = sum(w in level for v in part for w in self.neighbours[v]) // 2
        if edges == len(part) - 1:
            return [self._centroid(order)]
        if self.positions is not None:
            return self._plane(part)
        for _ in range(2):  # towards a pseudo-peripheral block (Gibbs, Poole and Stockmeyer 1976)
            order, level = self.levels(part, order[-1])
        return self._level_set(order, level)

    def _centroid(self, order):
        """The block of a tree whose removal leaves the smallest largest part."""
        known, parent = set(order), {order[0]: -1}
        for v in order:
            for w in self.neighbours[v]:
                if w in known and w not in parent:
                    parent[w] = v
        size, heaviest = dict.fromkeys(order, 1), dict.fromkeys(order, 0)
        for v in reversed(order):
            p = parent[v]
            if p >= 0:
                size[p] += size[v]
                heaviest[p] = max(heaviest[p], size[v])
        return min(order, key=lambda v: max(heaviest[v], len(order) - size[v]))

    def _level_set(self, order, level):
        """The thinnest level set that leaves at least a fifth on either side."""
        count = np.bincount([level[v] for v in order])
        below, n = np.cumsum(count), len(order)
        choices = [
            (count[k] * (1 + 0.5 * abs(below[k - 1] - (n - below[k])) / n), k)
            for k in range(1, len(count) - 1)
            if min(below[k - 1], n - below[k]) >= 0.2 * n
        ]
        if not choices:
            return order
        k = min(choices)[1]
        return self._trim([v for v in order if level[v] == k], lambda w: level.get(w, -1) == k + 1)

    def _plane(self, part):
        """The blocks on one side of the median plane that touch the other side."""
        points = self.positions[part]
        axis = np.argmax(np.ptp(points, axis=0))
        middle = np.median(points[:, axis])
        above = {v for v, x in zip(part, points[:, axis], strict=True) if x > middle}
        return self._trim([v for v in part if v not in above], above.__contains__) if above else part

    def _trim(self, candidates, across):
        return [v for v in candidates if any(across(w) for w in self.neighbours[v])]
