"""Tiers: fronts of like size on neighbouring levels, padded to one shape, so that few kernels are compiled.

A tier is either a class of fronts of one level or all fronts of a range of levels, chosen by dynamic programming over
the levels: least padded work plus a charge per front, with a bounded number of tiers.
"""

from dataclasses import dataclass

import numpy as np

from ..runtime import tuning
from ._symbolic import SymbolicFront, front_flops


@dataclass(frozen=True)
class FrontTier:
    """Tier: `steps` of at most `width` fronts each (indices), padded to `pivots` and `boundary` blocks."""

    pivots: int
    boundary: int
    width: int
    steps: tuple[tuple[int, ...], ...]


def build_tiers(made: list[SymbolicFront], size: int, most: int) -> list[FrontTier]:
    """Group fronts into at most about `most` tiers, children always in an earlier step."""
    height = np.array([f.height for f in made])
    K = np.array([len(f.pivots) for f in made])
    M = np.array([len(f.boundary) for f in made])
    levels = [np.nonzero(height == h)[0] for h in range(height.max() + 1)]
    parts = _partition_levels(levels, K, M, size, most)
    return [_build_tier(part, height, K, M, size) for part in parts]


def _tier_cost(part, K, M, size):
    k, m = K[part].max(), M[part].max()
    return len(part) * (front_flops(k, m, size) + 4.0 * ((k + m) * size) ** 2 + tuning.FRONT_OVERHEAD)


def _merge_classes(part, K, M, size, most):
    """Options (cost, classes) with 1 ... most classes of fronts of one level, merged greedily at least cost."""
    shapes = {}
    for f in part:
        shapes.setdefault((K[f], M[f]), []).append(f)
    classes = [np.array(v) for _, v in sorted(shapes.items())]
    if len(classes) > tuning.FRONT_SHAPES:  # coarse first: neighbours in size
        order = np.array([f for c in classes for f in c])
        classes = [c for c in np.array_split(order, tuning.FRONT_SHAPES) if len(c)]
    options = {}
    while True:
        if len(classes) <= most:
            options[len(classes)] = (sum(_tier_cost(c, K, M, size) for c in classes), list(classes))
        if len(classes) == 1:
            return options
        pairs = [(i, j) for i in range(len(classes)) for j in range(i)]
        gain = [
            _tier_cost(np.r_[classes[i], classes[j]], K, M, size)
            - _tier_cost(classes[i], K, M, size)
            - _tier_cost(classes[j], K, M, size)
            for i, j in pairs
        ]
        i, j = pairs[int(np.argmin(gain))]
        classes[j] = np.r_[classes[j], classes[i]]
        del classes[i]


def _partition_levels(levels, K, M, size, most):
    """Lists of fronts, one per tier, in the order of elimination."""
    top = len(levels)
    best = {(0, 0): (0.0, None, [])}
    options = [_merge_classes(part, K, M, size, 3) for part in levels]
    for end in range(1, top + 1):
        for start in range(end):
            choices = options[start] if end - start == 1 else {1: _level_range(levels[start:end], K, M, size)}
            for used in range(most):
                if (used, start) not in best:
                    continue
                for count, (cost, parts) in choices.items():
                    total = best[used, start][0] + cost
                    key = (used + count, end)
                    if used + count <= most and (key not in best or total < best[key][0]):
                        best[key] = (total, (used, start), parts)
    ends = {used: best[used, top][0] for used in range(1, most + 1) if (used, top) in best}
    least = min(ends.values())
    used = min(u for u, cost in ends.items() if cost <= 1.1 * least)  # fewer kernels for a tenth more work
    parts, key = [], (used, top)
    while key != (0, 0):
        _, previous, own = best[key]
        parts, key = own + parts, previous
    return parts


def _level_range(levels, K, M, size):
    part = np.concatenate(levels)
    return _tier_cost(part, K, M, size) + tuning.STEP_OVERHEAD * len(levels), [part]


def _build_tier(part, height, K, M, size):
    k, m = int(K[part].max()), int(M[part].max())
    by_level = [part[height[part] == h] for h in np.unique(height[part])]
    widest = max(len(level) for level in by_level)
    bound = max(1, min(widest, tuning.STEP_ENTRIES // ((k + m) * size) ** 2))
    front = _tier_cost(part[:1], np.full_like(K, k), np.full_like(M, m), size)

    def work(width):
        steps = sum(-(-len(level) // width) for level in by_level)
        return steps * (width * front + tuning.STEP_OVERHEAD)

    width = min(range(1, bound + 1), key=work)
    steps = [tuple(level[a : a + width].tolist()) for level in by_level for a in range(0, len(level), width)]
    return FrontTier(k, m, width, tuple(steps))
