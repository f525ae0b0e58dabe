"""Graph of a system for block-sparse solvers: rigid groups of bodies, connected by joints, loops and elastic bodies.

A group is the set of bodies welded to one node of the tree.  Massless nodes inside a joint and modal coordinates
form no group.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..blocksparse import Pattern
from ..model._system import System


@dataclass(frozen=True, eq=False)
class BodyGraph:
    """Groups in the order of their nodes, g of them; g is also the number of the ground.

    Attributes:
        node (g,): node that carries each group; of_frame (frames,): group of each frame.
        parent (g,): group on the other side of its tree joint.
        columns (g, 6): velocity columns of that joint, num_velocities where it has fewer.
        group, slot (nv,): place of each column in `columns`; group is g for modal columns.
        ends (elements, 2): groups of frames A and B of every closure, in the order of their rows.
        common_ancestor (elements,): lowest common ancestor of both frames in the tree, the number of nodes for none.
        clusters: (elastic bodies, interfaces) groups, one array per elastic group.
        pattern: blocks of 12, twist and joint wrench of each group.
    """

    node: np.ndarray
    of_frame: np.ndarray
    parent: np.ndarray
    columns: np.ndarray
    group: np.ndarray
    slot: np.ndarray
    ends: np.ndarray
    common_ancestor: np.ndarray
    clusters: tuple[np.ndarray, ...]
    pattern: Pattern

    def edges(self, i, j):
        """Numbers of the edges between groups i < j; the number of edges where there is none (ground, i == j)."""
        index, none = self.pattern.edge_index, self.pattern.num_edges
        return np.array([index.get(pair, none) for pair in zip(i.tolist(), j.tolist(), strict=True)], int)


def body_graph(system: System) -> BodyGraph:
    """The graph of a system, cached by its topology, closures and elastic bodies."""
    ends = tuple(end for group in system.closures for end in zip(group.first, group.second, strict=True))
    clusters = tuple(group.frames for group in system.elastic)
    modal = tuple(c for group in system.elastic for columns in group.columns for c in columns)
    return _body_graph(system.topology, ends, clusters, modal)


@lru_cache(maxsize=64)
def _body_graph(top, ends, clusters, modal):
    n, above = top.nodes.size, np.append(top.nodes.parent_or_size, top.nodes.size)
    carriers = sorted({k for k in top.body_node if k >= 0} - set(modal))
    g, number = len(carriers), {node: k for k, node in enumerate(carriers)}
    of_node, columns, slot, group = np.full(n + 1, g), np.full((g, 6), n), np.zeros(n, int), np.full(n, g)
    for k in range(n):
        of_node[k] = number.get(k, of_node[above[k]])
    for k in set(range(n)) - set(modal):
        joint = top.joints[top.node_joint[k]]
        last = joint.velocities.stop - 1
        group[k], slot[k] = number[last], k - joint.velocities.start
        columns[group[k], slot[k]] = k
    first = columns[:, 0]
    parent = of_node[above[first]]
    of_frame = of_node[np.asarray(top.frame_node)]
    pairs = of_frame[np.array(ends, int).reshape(-1, 2)]
    ancestor = np.array([_common_ancestor(top, *end) for end in ends], int).reshape(-1)
    clusters = tuple(of_frame[np.array(frames, int)] for frames in clusters)
    inside = [c[:, [i, j]] for c in clusters for i in range(c.shape[1]) for j in range(i)]
    edges = np.concatenate([np.stack([parent, np.arange(g)], axis=1), pairs, *inside])
    edges = edges[(edges < g).all(axis=1) & (edges[:, 0] != edges[:, 1])]
    pattern = Pattern(g, 12, edges)
    return BodyGraph(
        np.array(carriers, int), of_frame, parent, columns, group, slot, pairs, ancestor, clusters, pattern
    )


def _common_ancestor(top, first, second):
    """Lowest common ancestor of two frames in the tree of nodes."""
    path = np.vstack([top.nodes.path, np.zeros((1, top.nodes.size), bool)])
    node = np.asarray(top.frame_node)
    both = np.nonzero(path[node[first]] & path[node[second]])[0]
    return both[-1] if len(both) else top.nodes.size
