"""Transfer matrix at complex arguments: by inversion, and as a sum over modes."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex

from ..checks import require_numbers
from ..typing import AnyArray, ArrayLike
from . import _refined_solve as refined_solve
from ._modes import Modes


def transfer_matrix(
    *,
    K: AnyArray,
    M: AnyArray,
    s: ArrayLike,
    C: AnyArray | None = None,
    out: AnyArray | None = None,
    into: AnyArray | None = None,
    chunk: int = 32,
) -> Complex[Array, "points outputs inputs"]:
    """Transfer matrix `B(s) = (s^2 M + s C + K)^-1` at complex s, one solution each; at `s = i w` the receptance.

    It holds for any damping and for unsymmetric matrices; it is not finite at a root.

    Args:
        s: (points,) [rad/s], the lambda of S1.
        out: (outputs, n) output matrix, into: (n, inputs) load columns; default all coordinates.
        chunk: points solved together: memory grows with this and not with their number.

    Returns: (points, outputs, inputs).

    Raises: ValueError for s that is not (points,).  Source: S1 (39)-(40), B(lambda) between them.
    """
    dtype = np.result_type(K.dtype, np.complex64)
    points = _check_points(s, dtype)
    one = jnp.eye(len(K), dtype=dtype)
    rows, load = (one if A is None else A.astype(dtype) for A in (out, into))

    @jax.checkpoint
    def at(s):
        Z = K.astype(dtype) + s**2 * M.astype(dtype)
        return rows @ refined_solve.refined_solve(Z if C is None else Z + s * C.astype(dtype), load)

    return lax.map(at, points, batch_size=chunk)


def modal_transfer_matrix(
    modes: Modes, s: ArrayLike, out: Sequence[int] | None = None, into: Sequence[int] | None = None
) -> Complex[Array, "points outputs inputs"]:
    """Transfer matrix `B(s)` as a sum over modes: `sum_k shapes_k left_k / (s - root_k)` of complex ones, or
    `sum_k shapes_k shapes_k^T / (s^2 + w_k^2)` of natural ones with unit modal mass.

    Args:
        modes: all of them, or the part of them to keep.
        s: (points,) complex [rad/s].
        out, into: coordinates, default all.

    Each term is the response of one mode.  Derivatives with respect to what splits modes of one frequency are right
    in `transfer_matrix` only.

    Raises: ValueError for complex modes without left vectors, and s that is not (points,).  Source: S1 (39)-(40).
    """
    if modes.is_complex and modes.left is None:
        raise ValueError(
            "these complex modes have no left vectors: use the modes of complex_modes, or transfer_matrix"
        )
    dtype = np.result_type(modes.shapes.dtype, np.complex64)
    s = _check_points(s, dtype)[:, None]
    left = modes.shapes.T if modes.left is None else modes.left
    over = s**2 + modes.values[None].astype(dtype) if modes.roots is None else s - modes.roots[None]
    shapes = modes.shapes if out is None else modes.shapes[_check_rows(out, len(modes.shapes))]
    left = left if into is None else left[:, _check_rows(into, len(modes.shapes))]
    return jnp.einsum("ik,wk,kj->wij", shapes.astype(dtype), 1 / over.astype(dtype), left.astype(dtype))


def _check_rows(numbers, size):
    rows = np.asarray(numbers, int)
    if np.any((rows < 0) | (rows >= size)):
        raise ValueError(f"coordinates {rows.tolist()} must be among 0 ... {size - 1}")
    return rows


def _check_points(s, dtype):
    require_numbers(s=s)
    s = jnp.asarray(s, dtype)
    if s.ndim != 1:
        raise ValueError(f"s has shape {s.shape}, not (points,)")
    return s
