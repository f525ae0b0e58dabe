"""Matrix Market files; SciPy's reader ends the process at a damaged number in the data."""

from pathlib import Path
from typing import Any

import numpy as np

from ._numbers import reals


def parse_matrix_market(path: str) -> Any:
    """A dense array or a SciPy sparse matrix, of real numbers.  Raises: ValueError for anything else."""
    import scipy.io
    import scipy.sparse

    rows, columns, entries, form, field, symmetry = scipy.io.mminfo(path)
    if field not in ("real", "integer", "double", "unsigned-integer", "pattern") or symmetry == "hermitian":
        raise ValueError(f"it holds {field} numbers, {symmetry}; real ones are read")
    body = _parse_numbers(Path(path).read_text("latin-1"))
    if form == "array":
        return _unpack_dense(body, rows, columns, symmetry)
    width = 2 if field == "pattern" else 3
    if len(body) != entries * width or max(rows, columns) > len(body) + 1:
        raise ValueError(f"it says {rows} x {columns} with {entries} entries, it has {len(body)} numbers")
    table = body.reshape(entries, width)
    i, j = (table[:, :2].T - 1).astype(int)
    if np.any(table[:, :2] % 1) or np.any((i < 0) | (i >= rows) | (j < 0) | (j >= columns)):
        raise ValueError(f"an entry lies outside of {rows} x {columns}")
    values = np.ones(entries) if width == 2 else table[:, 2]
    below = i != j if symmetry != "general" else np.zeros(entries, bool)
    sign = -1.0 if symmetry == "skew-symmetric" else 1.0
    places = np.concatenate([i, j[below]]), np.concatenate([j, i[below]])
    return scipy.sparse.coo_matrix((np.concatenate([values, sign * values[below]]), places), (rows, columns))


def _parse_numbers(text):
    """All numbers after the line of sizes."""
    lines = text.splitlines()
    size = next(k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("%"))
    return reals(" ".join(lines[size + 1 :]))


def _unpack_dense(body, rows, columns, symmetry):
    """Unpack columns stored one after another; of symmetric matrices the lower triangle is stored."""
    first = {"general": rows, "symmetric": 0, "skew-symmetric": -1}[symmetry]
    count = rows * columns if first > 0 else rows * (rows + 1 + 2 * first) // 2
    if len(body) != count or (first <= 0 and rows != columns):
        raise ValueError(f"it says {rows} x {columns}, {symmetry}, it has {len(body)} numbers")
    if first > 0:
        return body.reshape(columns, rows).T
    found = np.zeros((rows, rows))
    found.T[np.triu_indices(rows, -first)] = body
    below = np.tril(found, -1)
    return found + (below.T if symmetry == "symmetric" else -below.T)
