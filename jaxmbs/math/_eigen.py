"""Eigenproblems whose derivatives stay finite and right when eigenvalues repeat."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax

from ..runtime import jit, lapack


@jax.custom_jvp
def eigh(K, M):
    """Eigenvalues (n,), rising, and vectors (n, n) of `K X = M X diag(values)`, `X^T M X = 1`; K, M symmetric.

    Derivatives of any order exist for single values, for vectors of single values, and for what does not depend on
    the choice of vectors in a group of equal values: sums of values and projectors over whole groups.  A single
    vector of a group has no derivative: reverse mode refuses what depends on the choice of vectors, forward mode
    cannot tell and gives finite numbers without meaning.  Nor has a single value of a group where a parameter parts
    it; what comes out then lies between those of the parts.  Sums of functions of the values over vectors are
    `spectral`.

    Args:
        M: positive definite (n, n).

    All values are right to rounding times the highest one, the lowest `LOW` as far as the rounding of K lets them.

    Raises: an error at run time in reverse mode, as above.  Source: S1 (33)-(37).
    """
    return _eigh(K, M)


@jit
def _eigh(K, M):
    K, M = (K + K.T) / 2, (M + M.T) / 2
    L = lapack.cholesky(M)
    A = lapack.solve_factor(L, lapack.solve_factor(L, K).T)
    values, Y = lapack.eigh((A + A.T) / 2)
    return _sharpened(K, values, lapack.solve_factor(L, Y, transposed=True))


#: So many of the lowest modes are looked at twice.
LOW = 24


def _sharpened(K, values, X):
    """The lowest pairs again, from the energies of their vectors.

    What the first look says of modes near zero is rounding of the highest one: a rigid motion and a soft mount come
    out mixed.  In the space of those vectors alone there is no high mode, and the others add their square only.
    """
    n = len(values)
    m = min(LOW, n)
    if m == 0:
        return values, X
    V, first = X[:, :m], values[:m]
    low = jnp.abs(first) <= jnp.finfo(values.dtype).eps ** 0.5 * jnp.max(jnp.abs(values))
    energy = V.T @ (K @ V)
    energy = jnp.where(low[:, None] & low[None, :], (energy + energy.T) / 2, 0.0)
    # The others keep their places: beside the low ones by numbers larger than those may be.
    size, place = m * jnp.max(jnp.abs(energy)), jnp.arange(1, m + 1, dtype=values.dtype)
    size = jnp.where(size > 0, size, 1.0)
    apart = jnp.where(low, 0.0, jnp.where(first < 0, place - (m + 1), place) * size)
    found, turn = lapack.eigh(energy + jnp.diag(apart))
    values = values.at[:m].set(jnp.where(low, found, first))
    order = jnp.argsort(values) if n > m else slice(None)
    return values[order], X.at[:, :m].set(jnp.where(low[None], V @ turn, V))[:, order]


@eigh.defjvp
@jit
def _eigh_jvp(primals, tangents):
    K_dot, M_dot = ((d + d.T) / 2 for d in tangents)
    values, X = eigh(*primals)
    P, Q = X.T @ K_dot @ X, X.T @ M_dot @ X
    R = P - Q * values[None, :]
    together = same(values)
    gap = jnp.where(together, 1.0, values[None, :] - values[:, None])
    return (values, X), (jnp.diagonal(R), of_groups(values, X, X @ jnp.where(together, -0.5 * Q, R / gap)))


def of_groups(values, X, X_dot):
    """`X_dot` (n, m), tangent of the vectors X; in reverse mode an error where what is asked turns with the vectors.

    A function that does not change when the vectors of a group turn among themselves has a cotangent C with
    `X^T C` symmetric within the group.
    """

    def transposed(_, C):
        together = same(values)
        G, size = X.T @ C, jnp.abs(X).T @ jnp.abs(C)
        turns = jnp.abs(G - G.T) > jnp.finfo(values.dtype).eps ** 0.25 * jnp.max(jnp.where(together, size, 0.0))
        return eqx.error_if(C, jnp.any(together & turns), _SINGLE)

    return lax.custom_linear_solve(lambda x: x, X_dot, lambda _, b: b, transposed)


_SINGLE = (
    "a vector of a group of equal eigenvalues has no derivative: use what does not depend on the choice of vectors "
    "in the group (a projector over all of it, math.eigen.spectral), or part the group by a small change of the model"
)


def same(values):
    """Mask (n, n) of eigenvalues that count as equal: by their size, with a floor at the rounding of the largest."""
    eps = jnp.finfo(values.dtype).eps
    size = jnp.maximum(jnp.abs(values)[:, None], jnp.abs(values)[None, :])
    gap = jnp.abs(values[:, None] - values[None, :])
    return gap <= jnp.sqrt(eps) * size + 50 * eps * jnp.max(size)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def spectral(function, K, M, *parameters):
    """`sum_k x_k f(value_k) x_k^T` (n, n), for the pencil (K, M) of `eigh`; right at repeated eigenvalues.

    First derivatives by divided differences of f (Daleckii and Krein); second ones only where values are single.

    Args:
        function: `f(values, *parameters)`, entry by entry, real or complex, smooth near the values; it closes over no
            traced array.
        parameters: arguments with derivatives, each () or (n,), one number for each mode: then equal in a group.
    """
    values, X = eigh(K, M)
    return _sum(X, jnp.diag(function(values, *parameters)))


def _sum(X, f):
    X = X.astype(f.dtype)
    return X @ f @ X.T


@spectral.defjvp
def _spectral_jvp(function, primals, tangents):
    K, M, *parameters = primals
    values, X = eigh(K, M)
    P, Q = (X.T @ ((d + d.T) / 2) @ X for d in tangents[:2])
    f, f_dot = jax.jvp(lambda *p: function(values, *p), tuple(parameters), tuple(tangents[2:]))
    slope = divided_differences(function, values, *parameters)
    slope_by_value = divided_differences(lambda v, *p: v.astype(f.dtype) * function(v, *p), values, *parameters)
    change = slope * P.astype(f.dtype) - slope_by_value * Q.astype(f.dtype) + jnp.diag(f_dot)
    return _sum(X, jnp.diag(f)), _sum(X, change)


def divided_differences(function, values, *parameters):
    """`(f_i - f_j) / (v_i - v_j)` (n, n); for close values the mean slope between them (three Gauss points)."""
    columns = [jnp.broadcast_to(p, values.shape)[:, None] for p in parameters]
    means = [(p + p.T) / 2 for p in columns]
    equal = jnp.ones((values.shape[0],) * 2, bool)
    for p in columns:
        equal = equal & (p == p.T)
    size = jnp.maximum(jnp.abs(values)[:, None], jnp.abs(values)[None, :])
    gap = values[:, None] - values[None, :]
    near = (equal & (jnp.abs(gap) <= jnp.finfo(values.dtype).eps ** 0.25 * size)) | same(values)
    middle = (values[:, None] + values[None, :]) / 2
    slope = 0.0
    for point, weight in ((-(0.15**0.5), 5 / 18), (0.0, 8 / 18), (0.15**0.5, 5 / 18)):
        at = jnp.where(near, middle + point * gap, values[:, None])
        slope = slope + weight * jax.jvp(lambda v: function(v, *means), (at,), (jnp.ones_like(at),))[1]
    f = function(values, *parameters)
    gap = jnp.where(near, 1.0, gap).astype(f.dtype)
    return jnp.where(near, slope, (f[:, None] - f[None, :]) / gap)


@jax.custom_jvp
def eig(A):
    """Eigenvalues (n,), right vectors X (n, n) and left ones Y = X^-1 of a square matrix; on the CPU.

    Ordered by size, of a conjugate pair the positive imaginary part first.  Values and vectors have derivatives where
    they are single (vectors up to their scale); sums over a group too where its vectors are complete.  A single
    vector of a group is refused as in `eigh`.  At a defective value no derivative exists, and zero is returned.
    """
    return _eig(A)


@jit
def _eig(A):
    values, X = lapack.eig(A)
    size = jnp.abs(values)
    if jnp.iscomplexobj(A):  # no conjugates, pairs of opposite sign perhaps, as equal as single precision says
        order = jnp.lexsort((-jnp.sign(values.imag), size.astype(jnp.float32)))
    else:  # LAPACK puts conjugates side by side: a stable sort keeps pairs of equal frequency together
        second = jnp.concatenate([jnp.zeros(1, bool), (values[1:].imag < 0) & (values[1:] == values[:-1].conj())])
        order = jnp.argsort(jnp.where(second, jnp.roll(size, 1), size), stable=True)
    values, X = values[order], X[:, order]
    return values, X, lapack.pseudo_inverse(X)


@eig.defjvp
@jit
def _eig_jvp(primals, tangents):
    values, X, Y = eig(*primals)
    C = Y @ (tangents[0].astype(X.dtype) @ X)
    eps = jnp.finfo(X.real.dtype).eps
    complete = _conditions(_balanced(lax.stop_gradient(primals[0])), X, Y) < eps**-0.375  # a defective one has none
    gap = values[None, :] - values[:, None]
    size = jnp.maximum(jnp.abs(values)[:, None], jnp.abs(values)[None, :])
    apart = (jnp.abs(gap) > jnp.sqrt(eps) * size + 50 * eps * jnp.max(size)) & complete[:, None] & complete[None, :]
    mixing = jnp.where(apart, C / jnp.where(apart, gap, 1.0), 0.0)
    group = ~apart & complete[:, None] & complete[None, :] & ~jnp.eye(len(values), dtype=bool)
    X_dot, Y_dot = _of_complex_groups(group, X, Y, X @ mixing, -mixing @ Y)
    return (values, X, Y), (jnp.where(complete, jnp.diagonal(C), 0.0), X_dot, Y_dot)


def _balanced(A):
    """(n,) units d that make rows and columns of `A_ij d_j / d_i` equally large.  Source: Osborne (1960)."""
    A = jnp.abs(A)
    A = A - jnp.diag(jnp.diagonal(A))

    def sweep(_, d):
        scaled = A * d[None, :] / d[:, None]
        rows, columns = jnp.sum(scaled, axis=1), jnp.sum(scaled, axis=0)
        apart = (rows > 0) & (columns > 0)
        return d * jnp.where(apart, jnp.where(apart, rows, 1.0) / jnp.where(apart, columns, 1.0), 1.0) ** 0.25

    return lax.fori_loop(0, 60, sweep, jnp.ones(len(A), A.dtype))


def _conditions(d, X, Y):
    """(n,) condition of each value in units d, at least 1; infinite where Y X is not 1: vectors parallel to the last
    bit."""
    right, left = jnp.sum((jnp.abs(X) / d[:, None]) ** 2, axis=0), jnp.sum((jnp.abs(Y) * d[None, :]) ** 2, axis=1)
    whole = jnp.abs(jnp.sum(Y.T * X, axis=0) - 1) < jnp.finfo(right.dtype).eps ** 0.25
    return jnp.where(whole, jnp.sqrt(right * left), jnp.inf)


@jit
def eig_rounding(A, X, Y):
    """(n,) bound of the error that rounding makes in each of the values of `eig`; without derivative.

    Rounding of A, in units that balance it, times the condition of a value; a defective one moves by its root.
    Source: Golub and Van Loan, Matrix Computations, 7.2.2 and 7.2.3.
    """
    A, X, Y = lax.stop_gradient((A, X, Y))
    d = _balanced(A)
    size, eps = jnp.sqrt(jnp.sum((jnp.abs(A) * d[None, :] / d[:, None]) ** 2)), jnp.finfo(d.dtype).eps
    return 16.0 * size * jnp.minimum(eps * _conditions(d, X, Y), eps**0.5)


def _of_complex_groups(group, X, Y, *tangents):
    """As `of_groups`, for right and left vectors that change to `X T` and `T^-1 Y`."""

    def transposed(_, cotangents):
        A, B = cotangents
        H, size = A.T @ X - Y @ B.T, jnp.abs(A).T @ jnp.abs(X) + jnp.abs(Y) @ jnp.abs(B).T
        turns = jnp.abs(H) > jnp.finfo(size.dtype).eps ** 0.25 * jnp.max(jnp.where(group, size, 0.0))
        return eqx.error_if(cotangents, jnp.any(group & turns), _SINGLE)

    return lax.custom_linear_solve(lambda x: x, tangents, lambda _, b: b, transposed)
