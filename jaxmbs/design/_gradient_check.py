"""Gradients of a search against differences of what it evaluates, at its first design."""

import numpy as np

from ._search import Point, Search

_STEP = 1e-5  # of each variable's scale
_TOLERANCE = 1e-3  # of the largest slope of a function, per scale


def check_gradients(search: Search) -> None:
    """Compare the gradients at the current point with central differences, one-sided at a bound.

    Raises: ValueError naming function, variable, gradient and difference of all that disagree.
    """
    at, variables, (names, rows) = search.current, search.variables, search.functions
    gradients = np.concatenate([at.gradient[None], at.slopes]) * variables.scale
    differences = np.zeros_like(gradients)
    for k, width in enumerate(_STEP * variables.scale):
        ends = [search.evaluate(at.x + side * width * np.eye(len(at.x))[k]) for side in (1.0, -1.0)]
        apart = (ends[0].x[k] - ends[1].x[k]) / variables.scale[k]
        if apart > 0.0:
            differences[:, k] = (_values(ends[0], rows) - _values(ends[1], rows)) / apart
        else:
            differences[:, k] = gradients[:, k]  # a variable that is fixed
    sizes = np.max(np.abs(gradients), axis=1) + _STEP * (1.0 + np.abs(_values(at, rows)))
    wrong = ~(np.abs(gradients - differences) <= _TOLERANCE * sizes[:, None])
    faults = [
        f"{names[i]} by {variables.names[k]}: gradient {gradients[i, k] / variables.scale[k]:.6g}, "
        f"difference {differences[i, k] / variables.scale[k]:.6g}"
        for i, k in np.argwhere(wrong)
    ]
    if faults:
        raise ValueError("gradients disagree with differences: " + "; ".join(faults))


def _values(point: Point, rows: np.ndarray) -> np.ndarray:
    """Objective and the excess of the rows."""
    return np.concatenate([[point.value], point.excess[rows]])
