"""The order in which the nodes of a tree with loops are eliminated, with a small front of open nodes.

Every node is eliminated after its children.  By then what hangs on it has become a quadratic form on the twists of
its parent and of the far ends of its loops.  These open nodes are the front, and each holds a slot of it.  The front
of a row of four-bars has two slots, of a ring three, of a ladder four.

Source: the frontal method of B. Irons, Int. J. Numer. Meth. Eng. 2 (1970) 5.
"""

import heapq
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..model._system import System


@dataclass(frozen=True, eq=False)
class FrontalPlan:
    """Steps of the elimination, one a node; n nodes, e closures, at most k closures a step.

    Attributes:
        width: slots of the front.
        order (n,): node of each step; step (n,): step of each node.
        own, parent (n, width): one-hot slots of the node and of its parent, zero for the ground.
        far (n, k, width): one-hot slots of the far ends of the closures that a step takes in, zero for the ground.
        closure (n, k): number of these closures, e for none; is_end_b (n, k): True where the node carries frame B.
        ends (e, 2): nodes that carry frames A and B, n for the ground.
        touching (n, d): ends `2 closure + side` on each node, 2 e for none.
    """

    width: int
    order: np.ndarray
    step: np.ndarray
    own: np.ndarray
    parent: np.ndarray
    far: np.ndarray
    closure: np.ndarray
    is_end_b: np.ndarray
    ends: np.ndarray
    touching: np.ndarray


def frontal_plan(system: System) -> FrontalPlan:
    """The plan of a system, cached by its tree and its closures."""
    top = system.topology
    ends = tuple(end for group in system.closures for end in zip(group.first, group.second, strict=True))
    return _plan(top.nodes, tuple((top.frame_node[a], top.frame_node[b]) for a, b in ends))


@lru_cache(maxsize=64)
def _plan(tree, ends):
    n = tree.size
    ends = np.array(ends, int).reshape(-1, 2) % (n + 1)  # -1, the ground, is node n
    on_node = [[e for e in each if ends[e, 0] != ends[e, 1]] for each in _touching(n, ends)]
    steps, width = _Elimination(tree.parent, ends, on_node).run()
    k, count = max((len(taken) for *_, taken in steps), default=0), len(ends)
    own, parent, far = np.zeros((n, width)), np.zeros((n, width)), np.zeros((n, k, width))
    closure, is_end_b = np.full((n, k), count), np.zeros((n, k), bool)
    for i, (node, slot, above, taken) in enumerate(steps):
        own[i, slot] = 1.0
        if above >= 0:
            parent[i, above] = 1.0
        for j, (e, other) in enumerate(taken):
            closure[i, j], is_end_b[i, j] = e, ends[e, 1] == node
            if other >= 0:
                far[i, j, other] = 1.0
    touching = np.full((n, max(map(len, on_node[:n]), default=0)), 2 * count)
    for node in range(n):
        touching[node, : len(on_node[node])] = [2 * e + int(ends[e, 1] == node) for e in on_node[node]]
    order = np.array([node for node, *_ in steps], int)
    return FrontalPlan(width, order, np.argsort(order), own, parent, far, closure, is_end_b, ends, touching)


def _touching(n, ends):
    """Closures on each node, the ground last."""
    found: list = [[] for _ in range(n + 1)]
    for e, pair in enumerate(ends):
        for node in set(pair.tolist()):
            found[node].append(e)
    return found


class _Elimination:
    """Of the nodes whose children are gone, the next one leaves the fewest open; of equals, the latest to be free."""

    def __init__(self, parent, ends, on_node):
        self.parent, self.ends, self.on_node, self.n = parent, ends, on_node, len(parent)
        self.gone, self.slots, self.free, self.width = np.zeros(self.n, bool), {}, [], 0
        self.children = np.zeros(self.n + 1, int)
        for p in parent:
            self.children[p] += 1
        self.queue, self.rank = [], {}

    def run(self):
        """Steps (node, slot, slot of the parent, [(closure, slot of the far end)]); the slot of the ground is -1."""
        for node in np.flatnonzero(self.children[: self.n] == 0).tolist():
            self._offer(node)
        steps = []
        while self.queue:
            growth, _, node = heapq.heappop(self.queue)
            if self.gone[node]:
                continue
            if self._growth(node) != growth:  # what was offered before the front changed
                self._offer(node)
                continue
            steps.append(self._eliminate(node))
        return steps, self.width

    def _others(self, node):
        """(closure, node at its far end) of the closures that are still to be taken in."""
        pairs = ((e, int(self.ends[e].sum()) - node) for e in self.on_node[node])
        return [(e, other) for e, other in pairs if other == self.n or not self.gone[other]]

    def _growth(self, node):
        needed = {node, self.parent[node], *(other for _, other in self._others(node))} - {-1, self.n}
        return len(needed - self.slots.keys()) - 1

    def _offer(self, node):
        rank = self.rank.setdefault(node, -len(self.rank))
        heapq.heappush(self.queue, (self._growth(node), rank, node))

    def _slot(self, node):
        if node in (-1, self.n):
            return -1
        if node not in self.slots:
            self.slots[node] = heapq.heappop(self.free) if self.free else self.width
            self.width = max(self.width, self.slots[node] + 1)
        return self.slots[node]

    def _eliminate(self, node):
        parent, others = self.parent[node], self._others(node)
        step = node, self._slot(node), self._slot(parent), [(e, self._slot(other)) for e, other in others]
        self.gone[node] = True
        heapq.heappush(self.free, self.slots.pop(node))
        self.children[parent] -= 1
        changed = {parent, *(far for v in (parent, *(o for _, o in others)) for far in self._near(v))}
        for each in changed:
            if 0 <= each < self.n and self.children[each] == 0 and not self.gone[each]:
                self._offer(each)
        return step

    def _near(self, node):
        """A node and the far ends of its closures, whose growth changes when it opens."""
        return [] if node in (-1, self.n) else [node, *(other for _, other in self._others(node))]
