"""Decompositions of matrices that the machine leaves to NumPy and SciPy, of arrays (..., rows, columns).

Each takes arrays, complex ones too, and a whole number that says what is wanted, and returns a list of arrays.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ._flatten import UnsupportedError


def _eigh(mode, matrix):
    """Mode: 1 of the lower triangle, else of the upper one."""
    values, vectors = np.linalg.eigh(matrix, "L" if mode & 1 else "U")
    return [vectors, values]


def _svd(mode, matrix):
    """Mode: 1 with vectors, 2 with all of them."""
    if not mode & 1:
        return [np.linalg.svd(matrix, compute_uv=False)]
    u, s, vh = np.linalg.svd(matrix, full_matrices=bool(mode & 2))
    return [s, u, vh]


def _each(function, matrix):
    """Results of a function of one matrix, stacked as the matrices are."""
    lead = matrix.shape[:-2]
    found = [function(one) for one in matrix.reshape(-1, *matrix.shape[-2:])]
    return [np.stack(column).reshape(*lead, *column[0].shape) for column in zip(*found, strict=True)]


def _eig(mode, matrix):
    """Mode: 1 with left vectors, 2 with right ones."""
    from scipy import linalg

    def eig(one):
        found = linalg.eig(one, left=bool(mode & 1), right=bool(mode & 2), check_finite=False)
        return [part.astype(complex) for part in (found if mode & 3 else (found,))]

    return _each(eig, matrix)


def _schur(mode, matrix):
    """Mode: 1 with vectors."""
    from scipy import linalg

    output = "complex" if np.iscomplexobj(matrix) else "real"
    return _each(lambda one: linalg.schur(one, output, check_finite=False)[: 1 + (mode & 1)], matrix)


def _qr(mode, matrix):
    """Mode: 1 all columns, 2 with pivots."""
    from scipy import linalg

    kind = "full" if mode & 1 else "economic"
    return _each(lambda one: linalg.qr(one, mode=kind, pivoting=bool(mode & 2), check_finite=False), matrix)


def _householder_product(mode, matrix, taus):
    from scipy import linalg

    name = "ungqr" if np.iscomplexobj(matrix) else "orgqr"
    width = matrix.shape[-1]

    def product(one):
        return [linalg.get_lapack_funcs(name, (one,))(one[:, :width], one[0, width:])[0]]

    rows = np.broadcast_to(taus[..., None, :], (*matrix.shape[:-1], taus.shape[-1]))
    return _each(product, np.concatenate([matrix, rows], -1))


def _lu(mode, matrix):
    from scipy import linalg

    def lu(one):
        factors, pivots = linalg.get_lapack_funcs("getrf", (one,))(one)[:2]
        order = np.arange(len(one))
        for k, pivot in enumerate(pivots):
            order[[k, pivot]] = order[[pivot, k]]
        return factors, pivots, order

    return _each(lu, matrix)


def _cholesky(mode, matrix):
    return _each(lambda one: [np.linalg.cholesky(one)], matrix)


def _triangular_solve(mode, matrix, sides):
    """Mode: 1 from the left, 2 lower, 4 unit diagonal, 8 transposed, 16 conjugate."""
    from scipy.linalg import blas

    matrix = matrix.conj() if mode & 16 else matrix
    options = {"side": not mode & 1, "lower": bool(mode & 2), "diag": bool(mode & 4), "trans_a": bool(mode & 8)}
    solve = blas.ztrsm if np.iscomplexobj(matrix) or np.iscomplexobj(sides) else blas.dtrsm
    found = [solve(1.0, A, B, **options) for A, B in zip(_stacked(matrix), _stacked(sides), strict=True)]
    return [np.stack(found).reshape(sides.shape)]


def _stacked(array):
    return array.reshape(-1, *array.shape[-2:])


def _fft(mode, array):
    """Mode: kind (0 forward, 1 inverse, 2 of real numbers, 3 its inverse), 4 times axes, 16 times the last length."""
    kind, axes, last = mode & 3, tuple(range(-(mode >> 2 & 3), 0)), mode >> 4
    if kind == 3:
        lengths = [*(array.shape[axis] for axis in axes[:-1]), last]
        return [np.fft.irfftn(array, lengths, axes)]
    return [(np.fft.fftn, np.fft.ifftn, np.fft.rfftn)[kind](array, axes=axes)]


def _of_scipy(name: str, is_inside: Callable[..., Any], is_odd: bool = False) -> Callable[..., list[np.ndarray]]:
    """A function of SciPy's, number by number; at the ends of where it is one XLA has numbers of its own."""

    def function(mode, *arrays):
        from scipy import special

        if not np.all(is_inside(*arrays)):
            raise UnsupportedError(f"{name} at the ends of its domain")
        found = getattr(special, name)(*arrays)
        return [np.copysign(found, arrays[0]) if is_odd else found]

    return function


def _are_positive(*numbers):
    return np.logical_and.reduce([(x > 0.0) & np.isfinite(x) for x in np.broadcast_arrays(*numbers)])


def _refuse(mode, letters):
    """Raises: EquinoxRuntimeError with the words of an `eqx.error_if`, given by the numbers of their letters."""
    import equinox as eqx

    raise eqx.EquinoxRuntimeError("".join(map(chr, letters.astype(int))))


#: Functions number by number, by the names of JAX's primitives.
SPECIAL_FUNCTIONS = {
    "erf_inv": _of_scipy("erfinv", lambda x: np.abs(x) < 1.0, is_odd=True),
    "digamma": _of_scipy("digamma", lambda x: (x > 0.0) & np.isfinite(x)),
    "igamma": _of_scipy("gammainc", _are_positive),
    "igammac": _of_scipy("gammaincc", _are_positive),
    "bessel_i0e": _of_scipy("i0e", np.isfinite),
    "bessel_i1e": _of_scipy("i1e", np.isfinite, is_odd=True),
    "regularized_incomplete_beta": _of_scipy("betainc", _are_positive),
    "zeta": _of_scipy("zeta", lambda x, q: (x > 1.0) & _are_positive(x, q)),
    "polygamma": _of_scipy("polygamma", lambda n, x: (n >= 0.0) & (n == np.floor(n)) & _are_positive(n + 1.0, x)),
}
#: Functions by name, in the order of their numbers in instructions.
HOST_FUNCTIONS: dict[str, Callable[..., list[np.ndarray]]] = {
    "eigh": _eigh,
    "svd": _svd,
    "eig": _eig,
    "schur": _schur,
    "qr": _qr,
    "householder_product": _householder_product,
    "lu": _lu,
    "cholesky": _cholesky,
    "triangular_solve": _triangular_solve,
    "fft": _fft,
    **SPECIAL_FUNCTIONS,
    "refuse": _refuse,
}
