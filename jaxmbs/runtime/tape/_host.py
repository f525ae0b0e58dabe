"""Decompositions of matrices, which the machine leaves to NumPy."""

from collections.abc import Callable
from typing import Any

import numpy as np


def host_results(name: str, params: dict, arrays: list[np.ndarray]) -> list[np.ndarray]:
    """Results of a decomposition of matrices (..., n, n) or (..., m, n); NaN where it does not converge."""
    try:
        return _FUNCTIONS[name](*arrays, **params)
    except np.linalg.LinAlgError:
        return [np.array(np.nan)] * 3


def _eigh(matrix: np.ndarray, **_: Any) -> list[np.ndarray]:
    if not np.all(np.isfinite(matrix)):
        return [np.array(np.nan)] * 2
    values, vectors = np.linalg.eigh((matrix + matrix.swapaxes(-1, -2)) / 2)
    return [vectors, values]


def _svd(matrix: np.ndarray, full_matrices: bool, compute_uv: bool) -> list[np.ndarray]:
    if not np.all(np.isfinite(matrix)):
        return [np.array(np.nan)] * 3
    if not compute_uv:
        return [np.linalg.svd(matrix, compute_uv=False)]
    u, s, vh = np.linalg.svd(matrix, full_matrices=full_matrices)
    return [s, u, vh]


_FUNCTIONS: dict[str, Callable[..., list[np.ndarray]]] = {"eigh": _eigh, "svd": _svd}
