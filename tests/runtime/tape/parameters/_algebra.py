"""Products and decompositions of matrices, loops and branches."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ._data import (
    BEYOND_53,
    COMPLEX_CUBE,
    CUBE,
    EMPTY,
    K32,
    K64,
    PLACES,
    POSITIVE,
    SQUARES,
    U32,
    A,
    B,
    C,
    W,
    X,
    Y,
    Z,
    of,
    varied,
)  # fmt: skip

_ROWS = (((0,), (0,)), ((), ()))
_CUBES = [CUBE.transpose(order).copy() for order in ((1, 2, 0), (2, 0, 1))]


def _dot(a, b, numbers, **options):
    return functools.partial(lax.dot_general, dimension_numbers=numbers, **options), (a, b)


def _dots():
    for numbers in (
        (((2,), (2,)), ((), ())), (((2,), (2,)), ((0,), (0,))), (((0, 2), (0, 2)), ((1,), (1,))),
        (((2, 0), (2, 0)), ((), ())), (((), ()), ((0, 1, 2), (0, 1, 2))), (((), ()), ((2, 0), (2, 0))),
    ):  # fmt: skip
        yield _dot(CUBE, CUBE, numbers)
        yield _dot(COMPLEX_CUBE, COMPLEX_CUBE[::-1].copy(), numbers)
    yield _dot(CUBE, _CUBES[0], (((2,), (1,)), ((1, 0), (0, 2))))
    yield _dot(CUBE, _CUBES[0], (((2,), (1,)), ((0, 1), (2, 0))))
    yield _dot(CUBE, _CUBES[1], (((2, 0), (0, 1)), ((), ())))
    for a, b in ((X[0], Y[0]), (np.float64(2.0), X), (U32, U32)):
        yield _dot(a, b, (((), ()), ((), ())))
    for a, b in (
        (EMPTY, EMPTY),
        (EMPTY.astype(int), EMPTY.astype(int)),
        (K32, K32),
        (B, B),
        (K64[:7], K64[6::-1].copy()),
    ):
        yield _dot(a, b, _ROWS)
    for kind in (np.int64, np.float64):
        yield _dot(K32[:4], K32[5:], _ROWS, preferred_element_type=kind)
    yield _dot(X, Y, _ROWS, precision=lax.Precision.DEFAULT)
    yield lambda x, y: 1.0 * lax.dot(x, y), (B, B)
    yield lambda x: lax.dot(x, jnp.ones(3, int)), (BEYOND_53,)
    yield _dot(np.array([[np.inf, 1.0], [np.nan, 0.0]]), np.array([[0.0, 1.0], [2.0, 3.0]]), _ROWS)


def _systems():
    names = ("left_side", "lower", "transpose_a", "conjugate_a", "unit_diagonal")
    solve = lax.linalg.triangular_solve
    yield from varied(solve, [(SQUARES, SQUARES[::-1].copy())], **dict.fromkeys(names, (False, True)))
    complex_ones = SQUARES * (1 + 0.5j), SQUARES[:, ::-1] * (1j - 2)
    yield from varied(solve, [complex_ones], **dict.fromkeys(names, (False, True)))
    yield functools.partial(solve, left_side=True), (A, A[:, :1].copy())


def _eigh(a, **options):
    """A matrix of its eigenvectors and eigenvalues, in place of vectors that are known but for a factor."""
    v, w = lax.linalg.eigh(a, **options)
    return (v * w[..., None, :]) @ v.conj().swapaxes(-1, -2), w


def _svd(a, **options):
    u, s, vh = lax.linalg.svd(a, **options)
    k = s.shape[-1]
    return (u[..., :k] * s[..., None, :]) @ vh[..., :k, :], s, jnp.abs(u @ u.conj().mT), jnp.abs(vh.conj().mT @ vh)


def _eig(a, **options):
    w, *vectors = lax.linalg.eig(a, **options)
    order = jnp.lexsort((w.imag, w.real))
    return [w[order], *(jnp.abs(v)[:, order] for v in vectors)]


def _qr(a, **options):
    q, r, *order = lax.linalg.qr(a, **options)
    return [q @ r, jnp.abs(r), jnp.abs(q), *order]


def _schur(a, **options):
    t, *u = lax.linalg.schur(a, **options)
    return [jnp.linalg.eigvals(t).sum(), *(v @ t @ v.conj().T for v in u)]


def _householder(a):
    return lax.linalg.householder_product(jnp.tril(a, -1), jnp.full((*a.shape[:-2], a.shape[-1]), 0.3, a.dtype))


def _factors_of():
    wide = POSITIVE + np.triu(A, 1), POSITIVE + np.triu(C, 1)
    stacks = np.stack([POSITIVE, -POSITIVE]), np.stack([POSITIVE, -POSITIVE]) + 0j
    return POSITIVE, -POSITIVE, POSITIVE + 0j, *wide, *stacks, np.zeros((0, 0)), np.ones((1, 1)), POSITIVE * np.nan


_COMPLEX_SQUARES = SQUARES * (1 + 0.5j)
_TALL = X.T.copy()


def _fft(kind, x, lengths):
    return functools.partial(lax.fft, fft_type=kind, fft_lengths=lengths), (x,)


def _loop(x, **options):
    return lax.scan(lambda c, r: (0.5 * c + r + x[1], c * r), x[0], x, **options)


def _two(x, y):
    return lax.scan(lambda c, r: ((c[1], c[0] * 0.5 + r[0]), (c[0], r[1])), (x[0], y), (x, y[None] * x))


def _branches(k, x):
    return lax.switch(k, [lambda x: x, lambda x: 2.0 * x, lambda x: x[::-1]], x)


def _while(x, y, limit):
    more = lambda c: jnp.sum(jnp.abs(c[0])) < limit
    return lax.while_loop(more, lambda c: (c[0] * 1.1 + y, c[1] * 1.5), (x, x))


ALGEBRA = {
    "dot_general": list(_dots()),
    "cholesky": varied(lax.linalg.cholesky, _factors_of(), symmetrize_input=(True, False)),
    "triangular_solve": list(_systems()),
    "lu": of(
        lax.linalg.lu, A, X, _TALL, SQUARES, C, _COMPLEX_SQUARES, np.zeros((2, 2)), np.zeros((0, 0)), np.ones((1, 1))
    ),
    "eigh": [
        *varied(_eigh, (A, C, SQUARES, _COMPLEX_SQUARES), lower=(True, False), symmetrize_input=(False, True)),
        *varied(_eigh, (POSITIVE,), sort_eigenvalues=(True, False)),
        *of(_eigh, A * np.nan, np.zeros((0, 0))),
    ],
    "svd": [
        *varied(_svd, (A, X, _TALL, Z, SQUARES), full_matrices=(False, True)),
        *varied(lax.linalg.svd, (X, Z), compute_uv=(False,)),
    ],
    "eig": varied(_eig, (A, C), compute_left_eigenvectors=(False, True), compute_right_eigenvectors=(False, True)),
    "schur": varied(_schur, (A, C), compute_schur_vectors=(False, True)),
    "qr": varied(_qr, (A, X, _TALL, C, SQUARES), full_matrices=(False, True), pivoting=(False, True)),
    "householder_product": of(_householder, A, _TALL, C, SQUARES),
    "fft": [
        *[_fft(kind, Z, lengths) for kind in ("fft", "ifft") for lengths in ((4,), (3, 4))],
        *[_fft("rfft", x, lengths) for x, lengths in ((X, (4,)), (X, (3, 4)), (CUBE, (2, 3, 4)))],
        *[_fft("irfft", Z, lengths) for lengths in ((6,), (7,), (3, 6))],
        _fft("fft", COMPLEX_CUBE, (2, 3, 4)),
    ],
    "cond": [
        *[(_branches, (np.int32(k), x)) for k in (-5, 0, 1, 2, 9) for x in (X, Z)],
        *[(lambda p, x: lax.cond(p, jnp.sin, jnp.cos, x), (np.bool_(p), X)) for p in (True, False)],
        (jax.vmap(_branches), (PLACES.astype(np.int32), X)),
    ],
    "scan": [
        *varied(_loop, (X, Z), reverse=(False, True), unroll=(1, 2), length=(None, 3)),
        *varied(_loop, (X[:2],), reverse=(False, True)),
        (_two, (X, Y[0])),
    ],
    "while": [
        *[(_while, (x, y, np.float64(50.0))) for x, y in ((X, Y), (Z, W))],
        (lambda x: lax.while_loop(lambda x: x[0] < 9.0, lambda x: 1.0 + abs(x) * 1.5, x), (X[0],)),
        (jax.vmap(_while), (X, Y, np.array([10.0, 20.0, 5.0]))),
    ],
    "platform_index": [
        (lambda x: lax.platform_dependent(x, cpu=jnp.sin, default=jnp.cos), (X,)),
        (lambda x: lax.platform_dependent(x, cuda=jnp.sin, default=jnp.cos), (X,)),
    ],
}
