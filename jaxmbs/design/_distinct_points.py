"""Design points of several starts: the distinct ones, and whether they are the nearest failures."""

from typing import Any

import jax
import numpy as np

from ..probability import RandomVariables
from ._design_point import CONVERGED, REASONS, DesignPoint

_APART = 0.1  # distance of design points that count as two, over the larger of their index and one
_FAR = 2.0  # a design point so much further than the nearest adds less than a hundredth
_ANGLE = 0.2  # rad, of the points about a design point that must hold


def distinct_points(found: DesignPoint, system: str) -> tuple[DesignPoint, np.ndarray, tuple[str, ...]]:
    """Design points (k,) of the limit states, by those of all starts (m, starts), the numbers (k,) of their limit
    states, and what is to be said of them.

    Of a system in parallel each limit state has its nearest one.
    """
    chosen: list[tuple[int, int]] = []
    faults = []
    for row in range(found.answer.shape[0]):
        of_what = f"limit state {row}: " if found.answer.shape[0] > 1 else ""
        good = [k for k in np.argsort(np.abs(found.answer[row])) if found.reason[row, k] == CONVERGED]
        if not good:
            faults.append(of_what + REASONS[int(found.reason[row, 0])])
            continue
        kept: list[int] = []
        for k in good:
            size = max(abs(found.answer[row, k]), 1.0)
            is_new = all(np.linalg.norm(found.u[row, k] - found.u[row, j]) > _APART * size for j in kept)
            is_near = abs(found.answer[row, k]) <= abs(found.answer[row, good[0]]) + _FAR
            if is_new and is_near:
                kept.append(int(k))
        if len(kept) > 1 and system == "parallel":
            faults.append(f"{of_what}{len(kept)} design points, of which the nearest is taken: sample instead")
            kept = kept[:1]
        chosen += [(row, k) for k in kept]
    rows, columns = np.array(chosen, int).reshape(-1, 2).T
    if system == "parallel" and faults and len(rows) < found.answer.shape[0]:
        rows, columns = rows[:0], columns[:0]
    return jax.tree.map(lambda x: x[rows, columns], found), rows, tuple(faults)


def unproven_points(
    traced: Any, variables: RandomVariables, points: DesignPoint, which: np.ndarray, compile: str
) -> tuple[str, ...]:
    """A sentence where a design point is not the nearest failure: the limit state has the other sign at the same
    distance from the medians, in one of `2 n - 1` directions."""
    n = points.u.shape[1]
    if n < 2:
        return ()
    for u, index, row in zip(points.u, points.answer, which, strict=True):
        length = float(np.linalg.norm(u))
        if length < 1e-3:
            continue
        base = np.linalg.qr(np.column_stack([u / length, np.eye(n)]))[0][:, 1:n]
        tangents = np.concatenate([base.T, -base.T, -u[None] / length])
        around = np.cos(_ANGLE) * u / length + np.sin(_ANGLE) * tangents
        around[-1] = -u / length
        values = traced.sampled((1.0 - 1e-6) * length * around, variables, compile, len(around))[:, row]
        if np.any(values * np.sign(index) < 0.0):
            where = f" of limit state {row}" if traced.size > 1 else ""
            return (f"the design point{where} is not the nearest failure: give more starts, or sample",)
    return ()
