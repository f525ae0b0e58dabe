"""From tiers of fronts to the index arrays of the numeric phase; cached by pattern and options."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from .ordering import given_order, nested_dissection
from .pattern import Pattern
from .symbolic import Report, flops, fronts, report
from .tiers import tiers


@dataclass(frozen=True, eq=False)
class TierPlan:
    """Index arrays of one tier; `s` steps of `width` fronts with `pivots` + `boundary` = r blocks.

    values (s, width, r, r): rows of the pool of matrix blocks (diagonal, upper, below, zero).
    updates (s, slots, width, r, r) and carried (s, slots, width, r): rows of the children's updates, of matrix and
    of vectors (last row zero).
    pivot (s, width, k), border (s, width, m): blocks (the number of blocks: none).
    first_update, first_carried: where the updates of the tier begin.
    """

    pivots: int
    boundary: int
    width: int
    values: np.ndarray
    updates: np.ndarray
    carried: np.ndarray
    pivot: np.ndarray
    border: np.ndarray
    first_update: int
    first_carried: int

    @property
    def steps(self) -> int:
        return len(self.pivot)

    @property
    def rows(self) -> int:
        return self.pivots + self.boundary


@dataclass(frozen=True, eq=False)
class Plan:
    """All tiers, and how many rows of updates they make; one object per pattern and options, hashed by identity."""

    pattern: Pattern
    tiers: tuple[TierPlan, ...]
    num_updates: int
    num_carried: int
    report: Report


def analyse(pattern: Pattern, order=None, leaf: int | None = None, positions=None, last=(), tiers: int = 6) -> Plan:
    """Symbolic analysis, kept for the pattern: ordering, fronts, tiers and index arrays.

    Args:
        order: the user's elimination order of the blocks; default nested dissection with `leaf`, `positions` (of
            meshes) and the blocks to come `last`, see `ordering.nested_dissection`.
        tiers: most kernels to be compiled; more of them pad less.
    """
    order = None if order is None else tuple(int(v) for v in order)
    points = None if positions is None else (np.asarray(positions, float).tobytes(), np.shape(positions))
    return _analyse(pattern, order, leaf, points, tuple(int(v) for v in last), tiers)


@lru_cache(maxsize=256)
def _analyse(pattern, order, leaf, points, last, most):
    if order is not None:
        supernodes = given_order(pattern, order)
    else:
        positions = None if points is None else np.frombuffer(points[0]).reshape(points[1])
        supernodes = nested_dissection(pattern, leaf, positions, last)
    made = fronts(pattern, supernodes)
    chosen = tiers(made, pattern.size, most)
    places = _Places(pattern, made)
    plans = tuple(places.tier(tier) for tier in chosen)
    plans = tuple(replace(p, **places.with_zero_rows(p)) for p in plans)
    padded = sum(len(t.steps) * t.width * flops(t.pivots, t.boundary, pattern.size) for t in chosen)
    shapes = tuple((sum(map(len, t.steps)), t.pivots, t.boundary) for t in chosen)
    done = replace(report(pattern, made), padded_flops=padded, tiers=shapes)
    return Plan(pattern, plans, places.num_updates, places.num_carried, done)


class _Places:
    """Where everything stands; filled tier by tier."""

    def __init__(self, pattern, made):
        self.pattern, self.made = pattern, made
        self.num_updates = self.num_carried = 0
        self.of = {}  # front -> (first row of its update matrix, of its update vector, blocks in a row)
        self.supernode = np.full(pattern.num_blocks, -1)
        for k, front in enumerate(made):
            self.supernode[front.pivots] = k

    def tier(self, tier):
        s, c, k, m = len(tier.steps), tier.width, tier.pivots, tier.boundary
        n, r = self.pattern.num_blocks, k + m
        slots = max((len(self.made[f].children) for step in tier.steps for f in step), default=0)
        values = np.full((s, c, r, r), n + 2 * self.pattern.num_edges, np.int32)
        updates, carried = np.full((s, slots, c, r, r), -1, np.int32), np.full((s, slots, c, r), -1, np.int32)
        pivot, border = np.full((s, c, k), n, np.int32), np.full((s, c, m), n, np.int32)
        first = self.num_updates, self.num_carried
        for i, step in enumerate(tier.steps):
            for j, f in enumerate(step):
                front = self.made[f]
                pivot[i, j, : len(front.pivots)] = front.pivots
                border[i, j, : len(front.boundary)] = front.boundary
                at = {v: row for row, v in enumerate(front.pivots)}
                at.update({v: k + row for row, v in enumerate(front.boundary)})
                self._values(values[i, j], f, at)
                self._children(updates[i, :, j], carried[i, :, j], front, at)
                own = i * c + j
                self.of[f] = (first[0] + own * m * m, first[1] + own * m, m)
        self.num_updates += s * c * m * m
        self.num_carried += s * c * m
        return TierPlan(k, m, c, values, updates, carried, pivot, border, *first)

    def _values(self, table, f, at):
        """Matrix blocks assembled in front f: rows and columns of its pivots."""
        n, edges, index = self.pattern.num_blocks, self.pattern.num_edges, self.pattern.edge_index
        for v in self.made[f].pivots:
            table[at[v], at[v]] = v
            for w in self.pattern.neighbours[v]:
                if w in at and (self.supernode[w] != f or v < w):
                    upper, below = n + index[min(v, w), max(v, w)], n + edges + index[min(v, w), max(v, w)]
                    table[at[v], at[w]], table[at[w], at[v]] = (upper, below) if v < w else (below, upper)

    def _children(self, updates, carried, front, at):
        for slot, child in enumerate(front.children):
            rows = np.array([at[v] for v in self.made[child].boundary], int)
            matrix, vector, m = self.of[child]
            q = np.arange(len(rows))
            updates[slot][np.ix_(rows, rows)] = matrix + q[:, None] * m + q
            carried[slot][rows] = vector + q

    def with_zero_rows(self, plan):
        """The last row of either pool is zero: what is assembled where no child adds."""
        return {
            "updates": np.where(plan.updates < 0, self.num_updates, plan.updates).astype(np.int32),
            "carried": np.where(plan.carried < 0, self.num_carried, plan.carried).astype(np.int32),
        }
