"""Check of a search's gradients against finite differences, at its first design."""

import numpy as np

from ._search import Point, Search

#: Step of the differences, of each variable's scale: near the cube root of the rounding of motions (1e-13 or so),
#: where truncation and rounding of a central difference are alike.
_STEP = 1e-5
#: Deviation that is a fault, of the largest derivative of a function per scale: wrong gradients miss by more,
#: differences of motions by less.
_TOLERANCE = 1e-3


def check_gradients(search: Search) -> None:
    """Compare the gradients at the current point with central differences, one-sided at a bound.

    Raises: ValueError naming function, variable, gradient and difference of all that disagree.
    """
    at, variables, (names, rows) = search.current, search.variables, search.functions
    gradients = np.concatenate([at.gradient[None], at.jacobian]) * variables.scale
    differences = np.zeros_like(gradients)
    for k, width in enumerate(_STEP * variables.scale):
        ends = [search.evaluate(at.x + side * width * np.eye(len(at.x))[k]) for side in (1.0, -1.0)]
        distance = (ends[0].x[k] - ends[1].x[k]) / variables.scale[k]
        if distance > 0.0:
            differences[:, k] = (_values(ends[0], rows) - _values(ends[1], rows)) / distance
        else:
            differences[:, k] = gradients[:, k]  # a fixed variable
    sizes = np.max(np.abs(gradients), axis=1) + _STEP * (1.0 + np.abs(_values(at, rows)))
    wrong = ~(np.abs(gradients - differences) <= _TOLERANCE * sizes[:, None])
    faults = [
        f"{names[i]} by {variables.names[k]}: gradient {gradients[i, k] / variables.scale[k]:.6g}, "
        f"difference {differences[i, k] / variables.scale[k]:.6g}"
        for i, k in np.argwhere(wrong)
    ]
    if faults:
        raise ValueError("gradients disagree with finite differences: " + "; ".join(faults))


def _values(point: Point, rows: np.ndarray) -> np.ndarray:
    """Objective and the constraints of the rows."""
    return np.concatenate([[point.value], point.constraints[rows]])
