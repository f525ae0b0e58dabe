"""Linear algebra that keeps its derivatives: saddle systems with redundant rows, full-column-rank least squares."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..runtime import is_on, jit, save_factor, tuning
from ._spd import spd_inverse, spd_solve

#: Weight of the lower block of a saddle system, relative to the largest of diag(A diag(M)^-1 A^T) (double, single).
#: Motions through singular poses (A02, 10 s) err 7e-10 m at 3e-10, 6e-10 here, 3e-9 at 1e-8, 3e-8 at 1e-7; a crank of
#: a thousandth of the other links loses 1e-5 of its acceleration at 3e-10, 4e-11 here.
PROXIMAL = {8: 3e-9, 4: 1e-5}
#: Rows whose squares are below this, of the largest mobility of a column, hold rounding alone (hinges on one line).
NOISE = {8: 1e-16, 4: 1e-9}
#: Proximal rounds that a saddle solve always makes, see `saddle_solve` (double, single).  They do for most; where
#: light inertias stand beside heavy ones, and near singular poses, each gains less, so they go on while it gains
#: (masses over twelve decades: 1e-3 -> 4e-15).  Rows that contradict each other come no nearer, and their multipliers
#: must not grow.
ROUNDS, _MOST_ROUNDS = {8: 3, 4: 6}, 100


class RowScale(NamedTuple):
    """Units of constraint rows: `unit` (rows,) brings rows to one unit, `block` (rows,) numbers their elements."""

    unit: jax.Array
    block: np.ndarray


def diagonal(M):
    """Diagonal (n,) of a matrix."""
    return jnp.sum(M * np.eye(len(M), dtype=M.dtype), axis=1)


def _row_mobility(M, A, block):
    """Scale (rows,) of A M^-1 A^T: one for all rows of an element.

    A row that vanishes at a singular pose fades out there and is not blown up; light and heavy elements keep theirs.
    """
    own = diagonal(M)
    massless = own <= 1e-9 * jnp.max(own, initial=1e-30)  # columns that must not set the scale
    mobility = 1.0 / jnp.where(massless, jnp.inf, own)
    size = (A * A) @ mobility
    together = (block[:, None] == block[None, :]).astype(size.dtype)
    of_block = jnp.max(together * size[None, :], axis=1, initial=0.0)
    largest = jnp.max(mobility, initial=1e-18)
    of_block = jnp.where(of_block > NOISE[M.dtype.itemsize] * largest, of_block, largest)
    return jnp.maximum(of_block, 1e-12 * jnp.max(size, initial=1e-18))


def saddle_factor(M, A, block):
    """Inverse of `M + A^T (eps C)^-1 A` (n, n) and the diagonal eps C (rows,); no derivative passes.

    Works for redundant but consistent rows, and for M singular outside the null space of A.
    """
    M, A = lax.stop_gradient((M, A))
    C = PROXIMAL[M.dtype.itemsize] * _row_mobility(M, A, block) if A.shape[0] else jnp.zeros(0, M.dtype)
    return save_factor((spd_inverse(M + A.T @ (A / C[:, None])), C))


def proximal_rounds(right, improved, apply, gap, fewest=3):
    """Solution z of `apply(z) = right`.

    Args:
        improved: correction for what is left over, near enough that the rounds converge.
        gap: (left over, z) -> how large that is (), of what adds up to it; rounds go on while it falls.
        fewest: rounds that are always made.
    """
    rounding = jnp.finfo(right.dtype).eps

    def once(carry):
        k, z, left, last, _ = carry
        z = z + improved(left)
        left = right - apply(z)
        return k + 1, z, left, gap(left, z), last

    def goes_on(carry):
        k, _, _, last, before = carry
        return (k < fewest) | ((last > 8.0 * rounding) & (last < 0.9 * before) & (k < _MOST_ROUNDS))

    far = jnp.full((), jnp.inf, right.dtype)
    return lax.while_loop(goes_on, once, (0, jnp.zeros_like(right), right, far, far))[1]


#: Directions that `conjugate_rounds` takes at most, and the least share of what is left over that one may move: rows
#: of 1e-7 of their element move 1e-5 of it by a factor's compliance, those that count as dependent move less.
_MOST_DIRECTIONS, _LEAST_SHARE = 10, {8: 1e-5, 4: 1e-3}


def conjugate_rounds(right, improved, apply, gap):
    """`proximal_rounds` whose corrections are directions of generalised conjugate residuals.

    Each round of a factor with compliance takes little from a row that fades, as those of a crank beside its dead
    centre; a direction for each such row takes all.  Rows that contradict each other move nothing and end it.

    Source: Eisenstat, Elman, Schultz (1983), algorithm 2.2.
    """
    rounding, least = jnp.finfo(right.dtype).eps, _LEAST_SHARE[right.dtype.itemsize]
    none, first = jnp.zeros((_MOST_DIRECTIONS, len(right)), right.dtype), np.int32(0)

    def once(carry):
        k, z, left, ways, moves = carry
        way = improved(left)
        move = apply(way)
        before = moves @ move  # of unit length each
        way, move = way - before @ ways, move - before @ moves
        moved = move @ move
        helps = moved > least**2 * (left @ left)
        per_size = jnp.where(helps, lax.rsqrt(moved), 0.0)
        way, move = per_size * way, per_size * move
        z = z + (move @ left) * way
        ways, moves = (lax.dynamic_update_slice(x, new[None], (k, first)) for x, new in ((ways, way), (moves, move)))
        return jnp.where(helps, k + 1, _MOST_DIRECTIONS), z, right - apply(z), ways, moves

    def unfinished(carry):
        k, z, left, *_ = carry
        return (k < _MOST_DIRECTIONS) & ~(gap(left, z) <= 8.0 * rounding)

    return lax.while_loop(unfinished, once, (first, jnp.zeros_like(right), right, none, none))[1]


def saddle_solve(M, A, b, c, rows: RowScale | None = None, fading: bool = False):
    """Solution (x, y) of `M x + A^T y = b`, `A x = c`, by proximal iterations on one factor.

    Redundant consistent rows leave x unique and give some y; both have derivatives of every order.  Costs one
    inverse; the adjoint reuses it.  The rows are eliminated: `H = M + A^T (eps C)^-1 A` is (n, n) but loses the
    digits of 1 / eps in free directions.  Each round refines, and corrects what is left over in the whole system.

    Args: M (n, n), A (m, n), b (n,) or (n, k), c (m,) or (m, k); rows: units and elements of the rows (default: one
        element); fading: rows that nearly vanish are satisfied too, see `conjugate_rounds`.
    """
    n = M.shape[0]
    if not n:  # a structure of welds: nothing moves, and rows on nothing carry nothing
        return jnp.zeros_like(b), jnp.zeros_like(c)
    unit, block = (jnp.ones_like(c, shape=len(c)), np.zeros(c.shape[0], int)) if rows is None else rows
    return _saddle_solution(M, A, b, c, unit, tuple(int(k) for k in block), fading)


@jit  # traced once for all the places of a program
def _saddle_solution(M, A, b, c, unit, block, fading):
    n, block = M.shape[0], np.asarray(block, int)
    each = (lambda x: x) if b.ndim == 1 else (lambda x: x[:, None])  # numbers of a row, for all columns
    A, c = unit[:, None] * A, each(unit) * c
    inverse, C = saddle_factor(M, A, block)
    K = jnp.block([[M, A.T], [A, jnp.zeros((len(c), len(c)), A.dtype)]])
    fixed, magnitude = lax.stop_gradient((K, jnp.abs(K)))
    # [M A^T; A -eps C]^-1 = F H^-1 F^T - diag(0, 1 / (eps C)), F = [1; (eps C)^-1 A]
    F = jnp.concatenate([np.eye(n, dtype=A.dtype), fixed[n:, :n] / C[:, None]])
    halves = np.repeat(np.eye(2, dtype=A.dtype), [n, len(c)], axis=1)  # efforts and rows: each has its own unit
    softness = jnp.concatenate([jnp.zeros(n, A.dtype), C])
    at_once = jnp.concatenate([jnp.zeros(n, A.dtype), 1.0 / C])
    is_whole = len(F) <= tuning.WHOLE_SADDLE and is_on("whole_saddle")
    whole = F @ inverse @ F.T - at_once[:, None] * np.eye(len(F), dtype=A.dtype) if is_whole else None

    def eliminated(left):
        if whole is not None:
            return few_columns(whole, left)
        onto = left @ F if left.ndim == 1 else F.T @ left
        return F @ (inverse @ onto) - each(at_once) * left

    def improved(left):
        # H may be so near to singular (a crank of a thousandth of the other links) that its inverse has few digits
        z = eliminated(left)
        return z + eliminated(left - few_columns(fixed, z) + each(softness) * z)

    def solve(_, right):
        def gap(left, z):
            sizes = few_columns(magnitude, jnp.abs(z)) + jnp.abs(right)
            gaps, sizes = (_largest_of_halves(halves, x) for x in (jnp.abs(left), sizes))
            return jnp.max(gaps / jnp.maximum(sizes, jnp.finfo(gaps.dtype).tiny))

        apply = lambda z: few_columns(fixed, z)
        if fading:
            return conjugate_rounds(right, eliminated, apply, gap)
        return proximal_rounds(right, improved, apply, gap, ROUNDS[A.dtype.itemsize])

    z = lax.custom_linear_solve(lambda z: few_columns(K, z), jnp.concatenate([b, c]), solve, solve, symmetric=True)
    return z[:n], each(unit) * z[n:]


def few_columns(A, x):
    """A @ x for x (n,), or for few columns (n, k): small products are sums in one loop, which on the CPU is several
    times faster than a call of the matrix product."""
    if x.ndim == 1 or A.size * x.shape[1] > tuning.FEW_COLUMNS:
        return A @ x
    return jnp.sum(A[:, :, None] * x[None], axis=1)


def _largest_of_halves(halves, x):
    """Largest entries (2,) or (2, k) of the efforts and of the rows in x (rows,) or (rows, k)."""
    if x.ndim == 1:
        return jnp.max(halves * x[None], axis=1)
    return jnp.max(halves[:, :, None] * x[None], axis=1)


def relative(gaps, sizes):
    """The largest gap (), of the largest of the sizes that added up to it; no derivative passes."""
    return _relative(*lax.stop_gradient((gaps, sizes)))


def _relative(gaps, sizes):
    return jnp.max(jnp.abs(gaps), initial=0.0) / jnp.max(sizes, initial=jnp.finfo(gaps.dtype).tiny)


def small_matmul(A, B):
    """A @ B for batches of matrices with few inner columns, as a sum of outer products.

    On the CPU five times faster than the batched product of 6 by 6 matrices, and in batches of loads a third faster
    than the sum over a broadcast axis; its derivative takes that product, whose transpose is cheaper.
    """
    return _sum_of_outer_products(A, B) if is_on("small_matmul") else A @ B


@jax.custom_jvp
def _sum_of_outer_products(A, B):
    terms = [A[..., :, k, None] * B[..., k, None, :] for k in range(A.shape[-1])]
    return sum(terms) if terms else A @ B


@_sum_of_outer_products.defjvp
def _small_matmul_jvp(primals, tangents):
    (A, B), (dA, dB) = primals, tangents
    return small_matmul(A, B), dA @ B + A @ dB


@jax.custom_jvp
def full_rank_lstsq(B, right):
    """Least-squares solution X (n, k) of `B X = right` for B (m, n) of full column rank; consistent rows do no harm.

    By modified Gram-Schmidt of `[B, right]`, as stable as Householder's QR.
    """
    n = B.shape[1]
    if not n:
        return jnp.zeros((0, right.shape[1]), B.dtype)
    index = jnp.arange(n)

    def orthogonalise(k, carry):
        B, right, R, Y = carry
        q = B[:, k]
        q = q * lax.rsqrt(jnp.sum(q * q))
        row, y = q @ B, q @ right
        R = R.at[k].set(jnp.where(index >= k, row, 0.0))
        return B - q[:, None] * row[None], right - q[:, None] * y[None], R, Y.at[k].set(y)

    def substitute(i, carry):
        Y, R = carry
        k = n - 1 - i
        y = Y[k] / R[k, k]
        above = jnp.where(index < k, R[:, k], 0.0)
        return jnp.where((index == k)[:, None], y[None], Y - above[:, None] * y[None]), R

    R, Y = jnp.zeros((n, n), B.dtype), jnp.zeros((n, right.shape[1]), B.dtype)
    *_, R, Y = lax.fori_loop(0, n, orthogonalise, (B, right, R, Y))
    return lax.fori_loop(0, n, substitute, (Y, R))[0]


@full_rank_lstsq.defjvp
def _full_rank_lstsq_jvp(primals, tangents):
    """`dX = B^+ (dright - dB X) + (B^T B)^-1 dB^T (right - B X)`; the last part is of rows that do not agree."""
    (B, right), (dB, dright) = primals, tangents
    X = full_rank_lstsq(B, right)
    return X, full_rank_lstsq(B, dright - dB @ X) + spd_solve(B.T @ B, dB.T @ (right - B @ X))


def safe_norm(x):
    """Length of x (n,) with zero derivative at zero."""
    square = jnp.sum(x * x)
    positive = square > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, square, 1.0)), 0.0)


def direction(x):
    """Unit vector of x (n,), zero at zero."""
    square = jnp.sum(x * x)
    positive = square > 0
    return x * jnp.where(positive, lax.rsqrt(jnp.where(positive, square, 1.0)), 0.0)


#: Matrix (3, 3) of the vector product by a vector: this times the vector, over the last axis.
CROSS = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    CROSS[_i, _k, _j], CROSS[_i, _j, _k] = 1.0, -1.0


def skew(a):
    """Matrix (3, 3) of the vector product: `skew(a) @ b = a x b`; also `skew(a) @ R` for columns."""
    return jnp.tensordot(jnp.asarray(CROSS, a.dtype), a, axes=([2], [0]))
