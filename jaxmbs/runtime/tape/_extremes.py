"""The larger and the smaller of two numbers: NaN wins, and of two zeros that with the sign."""

from typing import Any

import numpy as np


def larger(x: Any, y: Any) -> np.ndarray:
    """The larger of each pair of numbers."""
    found = np.maximum(x, y)
    are_zero = (found == 0) & (np.minimum(x, y) == 0)
    return np.where(are_zero, x + y, found) if found.dtype.kind == "f" and np.any(are_zero) else found


def smaller(x: Any, y: Any) -> np.ndarray:
    """The smaller of each pair of numbers."""
    return -larger(-x, -y) if np.result_type(x, y).kind == "f" else np.minimum(x, y)


def extreme(dtype: np.dtype, is_largest: bool) -> Any:
    """The largest or the least number of a type."""
    if dtype.kind == "b":
        return is_largest
    if dtype.kind in "iu":
        return np.iinfo(dtype).max if is_largest else np.iinfo(dtype).min
    return np.inf if is_largest else -np.inf
