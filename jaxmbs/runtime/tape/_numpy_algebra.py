"""Products and factors of matrices, of the NumPy machine."""

import contextlib

import numpy as np

from ._numpy_memory import binding


@binding("DOT")
def _dot(i, memory):
    m, n, k, own_a, along_a, own_b, along_b = memory.table(i.table, 7).tolist()
    in_a, in_b = memory.parts(i.table + 7, i.x0, i.x0)
    step_a, step_b = _step(in_a), _step(in_b)
    if step_a is None or step_b is None:
        rows, columns, sums = map(np.arange, (m, n, k))
        return _products(i, memory, in_a, in_b, rows * own_a, columns * own_b, sums * along_a, sums * along_b)
    a = memory.stack(i.a + int(in_a[0]), (i.x0, m, k), (step_a, own_a, along_a))
    b = memory.stack(i.b + int(in_b[0]), (i.x0, k, n), (step_b, along_b, own_b))
    return np.matmul, (a, b, memory.matrices(i.out, i.x0, m, n))


def _step(starts):
    """The distance of starts that rise by the same, else None."""
    if not starts.size:
        return None
    steps = np.diff(starts)
    return None if np.any(steps != steps[:1]) else int(steps[0]) if steps.size else 0


@binding("DOT_TABLE")
def _dot_table(i, memory):
    return _products(i, memory, *memory.parts(i.table, i.x0, i.x0, i.x1, i.x2, i.x3, i.x3))


def _products(i, memory, in_a, in_b, own_a, own_b, along_a, along_b):
    """Of (batch, rows, sums) and (batch, sums, columns) at places that are sums of those given."""
    a = i.a + in_a[:, None, None] + own_a[None, :, None] + along_a[None, None]
    b = i.b + in_b[:, None, None] + along_b[None, :, None] + own_b[None, None]
    doubles, out = memory.doubles, memory.matrices(i.out, len(in_a), len(own_a), len(own_b))

    def multiply():
        np.matmul(doubles[a], doubles[b], out)

    return multiply, ()


@binding("CHOLESKY")
def _cholesky(i, memory):
    given, out = memory.matrices(i.a, i.x0, i.x1, i.x1), memory.matrices(i.out, i.x0, i.x1, i.x1)

    def factor():
        for matrix, result in zip(given, out, strict=True):
            found = np.full_like(matrix, np.nan)
            with contextlib.suppress(np.linalg.LinAlgError):
                found = np.linalg.cholesky(matrix)
            result[...] = found

    return factor, ()


@binding("TRIANGULAR")
def _triangular(i, memory):
    A = memory.matrices(i.a, i.x0, i.x1, i.x1)
    is_right = bool(i.mode & 8)
    given, out = (memory.matrices(place, i.x0, i.x1 * i.x2) for place in (i.b, i.out))
    sides = out.reshape((i.x0, i.x2, i.x1) if is_right else (i.x0, i.x1, i.x2))
    sides = sides.swapaxes(1, 2) if is_right else sides
    is_transposed = bool(i.mode & 2) != is_right
    A = A.swapaxes(1, 2) if is_transposed else A
    is_forward = bool(i.mode & 1) != is_transposed

    def solve():
        out[...] = given
        for k in range(i.x1) if is_forward else reversed(range(i.x1)):
            solved = slice(0, k) if is_forward else slice(k + 1, i.x1)
            sides[:, k] -= np.matmul(A[:, None, k, solved], sides[:, solved])[:, 0]
            if not i.mode & 4:
                sides[:, k] /= A[:, k, k, None]

    return solve, ()


@binding("LU")
def _lu(i, memory):
    shape, least = (i.x0, i.x1, i.x2), min(i.x1, i.x2)
    given, out = memory.matrices(i.a, *shape), memory.matrices(i.out, *shape)
    pivots, orders = memory.matrices(i.b, i.x0, least), memory.matrices(i.c, i.x0, i.x1)

    def factor():
        out[...] = given
        for matrix, pivot, order in zip(out, pivots, orders, strict=True):
            order[...] = np.arange(i.x1)
            for k in range(least):
                _eliminate(matrix, pivot, order, k)

    return factor, ()


def _eliminate(matrix, pivot, order, k):
    """Column k below its largest number; NaN is the largest only where it stands at k."""
    column = np.abs(matrix[k:, k])
    best = k + (0 if np.isnan(column[0]) else int(np.nanargmax(column)))
    pivot[k] = best
    if best != k:
        order[[k, best]] = order[[best, k]]
        matrix[[k, best]] = matrix[[best, k]]
    matrix[k + 1 :, k] /= matrix[k, k] if matrix[k, k] != 0.0 else 1.0
    matrix[k + 1 :, k + 1 :] -= np.outer(matrix[k + 1 :, k], matrix[k, k + 1 :])
