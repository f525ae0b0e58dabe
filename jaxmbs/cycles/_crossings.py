"""Points of a branch of cycles at which its stability changes: functions that are zero there.

Source: Seydel, Practical bifurcation and stability analysis (2010), 7.4 to 7.6; Kuznetsov, Elements of applied
bifurcation theory (2004), 10.2.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

FOLD, DOUBLING, TORUS, BRANCHING = "fold", "period doubling", "torus", "branch point"
_ROUNDING = 1e-10
_ON_AXIS = 1e-6  # imaginary part of a multiplier that is real


def test_values(tangent: float, multipliers: np.ndarray) -> dict[str, float]:
    """Numbers whose signs change at each kind of point.

    Args: tangent: its part along the parameter; multipliers: (n,) without the trivial ones.
    """
    i, j = np.triu_indices(len(multipliers), 1)
    pairs = multipliers[i] * multipliers[j]
    return {
        FOLD: float(tangent),
        DOUBLING: float(np.prod(multipliers + 1.0).real),
        TORUS: float(np.prod(pairs - 1.0).real),
        BRANCHING: float(np.prod(multipliers - 1.0).real),
    }


def changed(before: dict[str, float], after: dict[str, float]) -> list[str]:
    """Kinds of the points between two places of a branch; at a fold a multiplier passes 1 as well."""
    kinds = [kind for kind in before if before[kind] * after[kind] < 0.0 and _is_told(before[kind], after[kind])]
    return [kind for kind in kinds if kind != BRANCHING or FOLD not in kinds]


def _is_told(*values):
    """True unless all are zero but for rounding, as of the product of two multipliers where nothing damps."""
    return max(map(abs, values)) > _ROUNDING


def is_of_kind(kind: str, multipliers: np.ndarray) -> bool:
    """True unless two real multipliers, one the inverse of the other, only look like a torus."""
    if kind != TORUS:
        return True
    i, j = np.triu_indices(len(multipliers), 1)
    nearest = np.argmin(np.abs(multipliers[i] * multipliers[j] - 1.0))
    return abs(multipliers[i[nearest]].imag) > _ON_AXIS


def locate(function: Callable[[float], tuple[float, Any]], length: float, ends: tuple[float, float]) -> Any:
    """Length and result of a function at its zero between 0 and a length, by the Illinois method.

    Args: function: of a length, gives (value, result), None for the result where there is none; ends: values at both.

    Returns: the length of the zero and the result there, None where the function failed.
    """
    a, b = 0.0, length
    fa, fb = ends
    last = 0.0
    for _ in range(60):
        middle = b - fb * (b - a) / (fb - fa)
        value, result = function(middle)
        if result is None or not np.isfinite(value):
            return None
        if abs(middle - last) <= 1e-11 * length or value == 0.0:
            break
        last = middle
        if value * fb < 0.0:
            a, fa = b, fb
        else:
            fa *= 0.5
        b, fb = middle, value
    return middle, result
