"""Plan of a factorisation: index arrays of the numeric phase from tiers of fronts; cached by pattern and options."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..tables import sentence_repr
from ..typing import AnyArray, ArrayLike
from ._ordering import elimination_tree, nested_dissection
from ._pattern import Pattern
from ._symbolic import AnalysisReport, analysis_report, build_fronts, front_flops
from ._tiers import build_tiers


@dataclass(frozen=True, eq=False)
class TierPlan:
    """Index arrays of one tier; `s` steps of `width` fronts with `pivots` + `boundary` = r blocks.

    values (s, width, r, r): rows of the pool of matrix blocks (diagonal, upper, below, zero).
    updates (s, slots, width, r, r) and carried (s, slots, width, r): rows of the children's updates, of matrix and
    of vectors (last row zero).
    pivot (s, width, k), border (s, width, m): blocks (the number of blocks: none).
    first_update, first_carried (s,): where each step puts its updates.
    """

    pivots: int
    boundary: int
    width: int
    values: np.ndarray
    updates: np.ndarray
    carried: np.ndarray
    pivot: np.ndarray
    border: np.ndarray
    first_update: np.ndarray
    first_carried: np.ndarray

    @property
    def steps(self) -> int:
        return len(self.pivot)

    @property
    def rows(self) -> int:
        return self.pivots + self.boundary


@dataclass(frozen=True, eq=False)
class Plan:
    """Index arrays of all tiers, and the sizes of their pools; one object per pattern and options, hashed by
    identity.
    """

    pattern: Pattern
    tiers: tuple[TierPlan, ...]
    num_updates: int
    num_carried: int
    report: AnalysisReport

    __repr__, _repr_html_ = sentence_repr(lambda plan: f"{plan.pattern}: {plan.report}")


def analyse(
    pattern: Pattern,
    order: Iterable[int] | AnyArray | None = None,
    leaf: int | None = None,
    positions: ArrayLike | None = None,
    last: Iterable[int] = (),
    tiers: int = 8,
) -> Plan:
    """Symbolic analysis of a pattern, which is cached: ordering, fronts, tiers and index arrays.

    Args:
        order: the user's elimination order of the blocks; default nested dissection with `leaf`, `positions` (of
            meshes) and the blocks to come `last`, see `ordering.nested_dissection`.
        tiers: maximum number of kernels to be compiled; more of them need less padding.
    """
    order = None if order is None else tuple(int(v) for v in order)
    points = None if positions is None else (np.asarray(positions, float).tobytes(), np.shape(positions))
    return _analyse_cached(pattern, order, leaf, points, tuple(int(v) for v in last), tiers)


@lru_cache(maxsize=256)
def _analyse_cached(pattern, order, leaf, points, last, most):
    if order is not None:
        supernodes = elimination_tree(pattern, order)
    else:
        positions = None if points is None else np.frombuffer(points[0]).reshape(points[1])
        supernodes = nested_dissection(pattern, leaf, positions, last)
    made = build_fronts(pattern, supernodes)
    chosen = build_tiers(made, pattern.size, most)
    places = _IndexTables(pattern, made, chosen)
    plans = tuple(places.tier(tier) for tier in chosen)
    plans = tuple(replace(p, **places.with_zero_rows(p)) for p in plans)
    padded = sum(len(t.steps) * t.width * front_flops(t.pivots, t.boundary, pattern.size) for t in chosen)
    shapes = tuple((sum(map(len, t.steps)), t.pivots, t.boundary) for t in chosen)
    done = replace(analysis_report(pattern, made), padded_flops=padded, tiers=shapes)
    return Plan(pattern, plans, places.updates.size, places.carried.size, done)


class _RowAllocator:
    """Allocator of rows for the updates of steps, which are reused once the parent fronts have read them."""

    def __init__(self):
        self.size, self.used = 0, []

    def take(self, rows, now, until):
        """Allocate consecutive rows until the step `until`; returns the first one."""
        self.used = sorted(stretch for stretch in self.used if stretch[2] > now)
        start = 0
        for first, end, _ in self.used:
            if first - start >= rows:
                break
            start = max(start, end)
        self.used.append((start, start + rows, until))
        self.size = max(self.size, start + rows)
        return start


class _IndexTables:
    """Index tables of matrix blocks, updates and fronts, filled tier by tier."""

    def __init__(self, pattern, made, chosen):
        self.pattern, self.made = pattern, made
        self.updates, self.carried = _RowAllocator(), _RowAllocator()
        steps = [step for tier in chosen for step in tier.steps]
        step_of = {f: now for now, step in enumerate(steps) for f in step}
        self.now, self.taken = 0, {c: step_of[f] for f, front in enumerate(made) for c in front.children}
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
        first = np.zeros((2, s), np.int64)
        for i, step in enumerate(tier.steps):
            until = max(self.taken.get(f, self.now) for f in step)
            first[0, i] = self.updates.take(c * m * m, self.now, until)
            first[1, i] = self.carried.take(c * m, self.now, until)
            self.now += 1
            for j, f in enumerate(step):
                front = self.made[f]
                pivot[i, j, : len(front.pivots)] = front.pivots
                border[i, j, : len(front.boundary)] = front.boundary
                at = {v: row for row, v in enumerate(front.pivots)}
                at.update({v: k + row for row, v in enumerate(front.boundary)})
                self._values(values[i, j], f, at)
                self._children(updates[i, :, j], carried[i, :, j], front, at)
                self.of[f] = (first[0, i] + j * m * m, first[1, i] + j * m, m)
        return TierPlan(k, m, c, values, updates, carried, pivot, border, *first)

    def _values(self, table, f, at):
        """Fill in the matrix blocks assembled in front f: rows and columns of its pivots."""
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
        """Replace missing entries by the last row of either pool, which is zero."""
        return {
            "updates": np.where(plan.updates < 0, self.updates.size, plan.updates).astype(np.int32),
            "carried": np.where(plan.carried < 0, self.carried.size, plan.carried).astype(np.int32),
        }
