"""Columns that span a matrix best, by pivoting; on the host."""

import numpy as np

_TIE = 1e-9  # relative difference of sizes that are taken as equal: rounding decides nothing


def pivoted_columns(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of A (m, n) in the order (k,), k = min(m, n), in which each is farthest from the span of those before,
    of equal ones the first; and their distances (k,).

    They are pivots and diagonal of the R of a QR with column pivoting.
    Source: Golub, Van Loan, Matrix Computations, section 5.4.2 (Businger's and Golub's algorithm).
    """
    A, count = np.array(A, float), min(A.shape)
    order, sizes, is_left = np.zeros(count, int), np.zeros(count), np.ones(A.shape[1], bool)
    for k in range(count):
        size = np.where(is_left, np.linalg.norm(A, axis=0), -1.0)
        order[k] = place = np.argmax(size >= (1.0 - _TIE) * size.max())
        sizes[k], is_left[place] = size[place], False
        if sizes[k] > 0.0:
            unit = A[:, place] / sizes[k]
            A -= np.outer(unit, unit @ A)
    return order, sizes
