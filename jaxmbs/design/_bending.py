"""Limit states that bend away from the surface that a method puts in their place at the design point."""

from typing import Any

import numpy as np

from ..probability import RandomVariables
from ._design_point import DesignPoint

_NEAR, _FAR = 0.05, 1.0  # standard deviations along which curvature, and the bend of the surface, are seen
_MOST = 1.5  # factor between probabilities from which a surface is not the one that was assumed


def bent_points(
    traced: Any, variables: RandomVariables, points: DesignPoint, which: np.ndarray, question: Any
) -> tuple[str, ...]:
    """A sentence where a limit state is not the plane, or of second order the paraboloid, at its design point.

    Values a standard deviation to both sides of the design point along `n - 1` directions of the tangent plane say
    how far the surface bends; Breitung's factor of these bends is to be that of the assumed surface.

    Source: Breitung 1984, Asymptotic approximations for multinormal integrals; Der Kiureghian, Lin and Hwang 1987,
    Second-order reliability approximations (fitting at points beside the design point).
    """
    worst = 1.0
    for u, gradient, index, row in zip(points.u, points.gradient, points.answer, which, strict=True):
        n, size = len(u), float(np.linalg.norm(gradient))
        if n < 2 or not size > 0.0:
            continue
        tangents = np.linalg.qr(np.column_stack([gradient / size, np.eye(n)]))[0][:, 1:n].T
        lengths = (_FAR,) if question.method == "form" else (_FAR, _NEAR)
        around = np.concatenate([u + side * h * tangents for h in lengths for side in (1.0, -1.0)])
        values = traced.sampled(np.concatenate([u[None], around]), variables, question.compile, len(around) + 1)
        values = values[:, row]
        sides = values[1:].reshape(len(lengths), 2, n - 1).sum(axis=1) - 2.0 * values[0]
        bends = sides / (size * np.square(lengths)[:, None])
        logs = [_log_factor(index, bend) for bend in bends]
        change = abs(logs[0] - (logs[1] if len(logs) > 1 else 0.0))
        worst = max(worst, float(np.exp(min(change, 700.0)))) if not np.isnan(change) else np.inf
    if worst <= _MOST:
        return ()
    better = 'ask for "sorm", or sample' if question.method == "form" else "sample"
    return (f"the limit state bends within a deviation of its design point, by a factor of {worst:.2g}: {better}",)


def _log_factor(index: float, curvatures: np.ndarray) -> float:
    """Logarithm of Breitung's factor."""
    arguments = 1.0 + index * curvatures
    return -0.5 * float(np.sum(np.log(arguments))) if np.all(arguments > 0.0) else float("inf")
