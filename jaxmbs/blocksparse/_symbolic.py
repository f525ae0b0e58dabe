"""Symbolic analysis: fronts of the multifrontal method, their levels, work and memory; once per pattern.

A front is a supernode's pivots and its boundary: the later blocks they couple to, by the matrix or by fill.
"""

from dataclasses import dataclass

import numpy as np

from ..runtime import tuning
from ._pattern import Pattern


@dataclass(frozen=True)
class SymbolicFront:
    """Front: blocks eliminated here, boundary blocks updated by them, child fronts, and height above the leaves."""

    pivots: list
    boundary: list
    children: list
    height: int


@dataclass(frozen=True)
class AnalysisReport:
    """Cost of a factorisation: levels, largest front [coordinates], flops, entries; `padded_flops` with padding."""

    levels: int
    fronts: int
    largest_front: int
    flops: float
    factor_entries: int
    padded_flops: float = 0.0
    tiers: tuple = ()

    def __str__(self):
        tiers = ", ".join(f"{count} x ({pivots}+{boundary})" for count, pivots, boundary in self.tiers)
        return (
            f"{self.fronts} fronts in {self.levels} levels, largest {self.largest_front} coordinates, "
            f"{self.flops / 1e6:.3g} Mflop ({self.padded_flops / max(self.flops, 1):.2f} times with padding), "
            f"{self.factor_entries * 8 / 1e6:.3g} MB; tiers (pivots+boundary): {tiers}"
        )


def build_fronts(pattern: Pattern, supernodes) -> list[SymbolicFront]:
    """Build the fronts, children first, from supernodes, parents first."""
    place = np.zeros(pattern.num_blocks, np.int64)  # place of the elimination of every block
    for k, (blocks, _) in enumerate(supernodes):
        place[blocks] = len(supernodes) - 1 - k
    below = [[] for _ in supernodes]
    made = []
    for k in reversed(range(len(supernodes))):
        blocks, parent = supernodes[k]
        children = _merge_children(below[k], made, place)
        own = set(blocks)
        reach = {w for v in blocks for w in pattern.neighbours[v] if place[w] > place[v]}
        reach.update(*(made[c].boundary for c in children))
        boundary = sorted(reach - own, key=lambda v: (place[v], v))
        made.append(SymbolicFront(blocks, boundary, children, _height(children, made)))
        if parent >= 0:
            below[parent].append(len(made) - 1)
    return made


def _height(children, made):
    return max((made[c].height + 1 for c in children), default=0)


def _merge_children(children, made, place):
    """Limit children to `tuning.FRONT_CHILDREN`: more are merged under fronts without pivots."""
    most = tuning.FRONT_CHILDREN
    while len(children) > most:
        children, groups = [], [children[k : k + most] for k in range(0, len(children), most)]
        for group in groups:
            if len(group) == 1:
                children += group
                continue
            reach = set().union(*(made[c].boundary for c in group))
            boundary = sorted(reach, key=lambda v: (place[v], v))
            made.append(SymbolicFront([], boundary, group, _height(group, made)))
            children.append(len(made) - 1)
    return children


def front_flops(pivots, boundary, size):
    """Floating-point operations of one Cholesky front; pivots and boundary are counted in blocks."""
    k, m = pivots * size, boundary * size
    return k**3 / 3 + k * k * m + k * m * m


def analysis_report(pattern: Pattern, made: list[SymbolicFront]) -> AnalysisReport:
    """Exact counts of an analysis, without padding."""
    b = pattern.size
    K, M = (
        np.array([len(part) for part in parts]) for parts in zip(*((f.pivots, f.boundary) for f in made), strict=True)
    )
    entries = int(np.sum((K * b) * (K * b + 1) // 2 + K * b * M * b))
    levels = max(f.height for f in made) + 1
    return AnalysisReport(levels, len(made), int((K + M).max()) * b, float(np.sum(front_flops(K, M, b))), entries)
