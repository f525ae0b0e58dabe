"""The lowest modes of large structures from one block-sparse factorisation, with derivatives."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..blocksparse import BlockMatrix, Factor, factor, matrix_inertia, solve
from ..checks import is_concrete
from ..linear._mass_rank import rank_of_blocks
from ..linear._rigid_flags import block_rigid_flags
from ..linear._symmetric import symmetric_blocks
from ..math._eigen import of_groups, same
from ..runtime import jit, lapack
from ._modes import Modes

#: Vectors per block: groups of up to so many equal eigenvalues are certainly found complete.
BLOCK_WIDTH = 8
#: Power of rounding: modes below it times a typical squared frequency count as rigid in the choice of a shift.
LEAST_ELASTIC = 5 / 8


def lowest_modes(stiffness: Factor, mass: BlockMatrix, num: int, sweeps: int = 30) -> Modes:
    """Lowest modes of `M x'' + K x = 0` by block Lanczos iteration with `K^-1 M`, with thick restarts.

    Args:
        stiffness: the "cholesky" factor of K, positive definite.
        mass: on the same pattern; it may be singular.
        num: number of modes; it should not cut a group of equal values, whose derivative then does not exist.
        sweeps: maximum number of restarts.

    First derivatives are those of `math.eigen.eigh`, refusals included; the contribution of the other modes comes
    from iterative solutions of `(K - w_k^2 M) y = b`, preconditioned by the factor.  If `sweeps` restarts do not
    suffice, the values are not finite.

    Raises: ValueError, if concrete, for fewer than `num + 8` coordinates with mass: dense matrices serve these.

    Returns: shapes (blocks * size, num).  Source: S1 (33)-(37).
    """
    check_range(mass, num)
    values, X = _block_lanczos(num, sweeps, stiffness, mass)
    return Modes(values, X.reshape(-1, num), jnp.zeros(num, bool))


def block_modes(stiffness: BlockMatrix, mass: BlockMatrix, num: int) -> Modes:
    """Lowest modes of block matrices, of a free system too: `K + s M` is factorised, s is taken from its values.

    Raises: ValueError, if concrete, for unsymmetric matrices, and for fewer than `num + 8` coordinates with mass.
    Source: S1 (33)-(37).
    """
    check_range(mass, num)  # before the program, in which no number is known
    return _block_modes(symmetric_blocks(stiffness), symmetric_blocks(mass), num)


@jit
def _block_modes(K, M, num):
    shift = _spectral_shift(lax.stop_gradient(K), lax.stop_gradient(M))
    found = lowest_modes(factor(K + shift * M), M, num)
    values = found.values - shift
    return Modes(values, found.shapes, block_rigid_flags(K, values, found.shapes))


def _spectral_shift(K, M):
    """Shift (): zero of a constrained system, of a free one about its lowest elastic squared frequency.

    With less the rigid motions would take the digits of the elastic ones, with more these would lie close together.
    It is found by bisection over powers of four times a typical value, by the number of modes below each.
    """
    k, m = (jnp.diagonal(A.diagonal, axis1=1, axis2=2).reshape(-1) for A in (K, M))
    typical = jnp.nanmedian(jnp.where(m > 0, jnp.abs(k) / jnp.where(m > 0, m, 1.0), jnp.nan))
    least = jnp.finfo(k.dtype).eps ** LEAST_ELASTIC
    level = lambda power: least * 4.0**power * typical
    below = lambda power: matrix_inertia(factor(K + (-level(power)) * M, "ldl"))[1]

    most = int(np.ceil(-np.log(least) / np.log(4.0)))

    def step(count_step, state):
        low, high, rigid = state
        middle = jnp.where(count_step == 0, 0, (low + high) // 2)
        count = below(middle)
        rigid = jnp.where(count_step == 0, count, rigid)
        is_above = count > rigid
        return jnp.where(is_above, low, middle), jnp.where(is_above, middle, high), rigid

    steps = 1 + int(np.ceil(np.log2(most)))
    _, high, rigid = lax.fori_loop(0, steps, step, (jnp.asarray(0), jnp.asarray(most), jnp.asarray(0)))
    return jnp.where(rigid > 0, level(high), 0.0)


def has_range(mass: BlockMatrix, num: int) -> bool:
    """True if the mass may have a range for `num` modes and one more block of vectors; spurious shapes else."""
    if not is_concrete(mass.diagonal):
        return int(mass.pattern.sizes.sum()) >= num + BLOCK_WIDTH
    return bool(rank_of_blocks(mass) >= num + BLOCK_WIDTH)


def check_range(mass, num):
    """Refuse a mass of too low rank: the block of vectors must fit into its range, or spurious shapes are found."""
    if is_concrete(mass.diagonal) and not has_range(mass, num):
        raise ValueError(
            f"{rank_of_blocks(mass)} coordinates with mass are too few for {num} modes of block matrices: use "
            "`to_dense()`"
        )


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _block_lanczos(num, sweeps, K, M):
    n, b = M.pattern.shape
    dtype = M.diagonal.dtype
    width = min(BLOCK_WIDTH, n * b)
    keep, depth = num + width, 2 + 2 * num // width
    # Residual of the shapes: eigenvalues are then right to its square, that is to rounding.
    tolerance = max(10 * jnp.finfo(dtype).eps ** (2 / 3), 1e4 * jnp.finfo(dtype).eps)

    def grow(d, state):
        X, spaces = state
        X, MX = _orthonormalise(M, X, *spaces[:2])
        blocks = X, MX, solve(K, MX)
        at = lambda space, block: lax.dynamic_update_slice(space, block, (0, 0, keep + d * width))
        return blocks[2], tuple(at(*pair) for pair in zip(spaces, blocks, strict=True))

    def sweep(state):
        X, kept, *_, count = state
        spaces = tuple(jnp.concatenate([A, jnp.zeros((n, b, depth * width), dtype)], axis=2) for A in kept)
        X, (V, MV, Z) = lax.fori_loop(0, depth, grow, (X, spaces))
        H = _inner_products(MV, Z)
        inverse, Y = lapack.eigh((H + H.T) / 2)
        inverse, Y = inverse[::-1][:num], Y[:, ::-1][:, :keep]
        kept = tuple(A @ Y for A in (V, MV, Z))
        AX = kept[2][:, :, :num]
        miss = AX - kept[0][:, :, :num] * inverse[None, None, :]
        error = jnp.sqrt(jnp.max(jnp.sum(miss**2, (0, 1)) / jnp.sum(AX**2, (0, 1))))
        return X - V @ _inner_products(MV, X), kept, 1 / inverse, error, count + 1

    X = solve(K, M @ jax.random.normal(jax.random.key(0), (n, b, width), dtype))
    start = (X, (jnp.zeros((n, b, keep), dtype),) * 3, jnp.zeros(num, dtype), jnp.ones((), dtype), 0)
    state = lax.while_loop(lambda s: (s[3] > tolerance) & (s[4] < sweeps), sweep, start)
    return jnp.where(state[3] <= tolerance, state[2], jnp.nan), state[1][0][:, :, :num]


def _orthonormalise(M, X, V, MV):
    """Make X M-orthonormal and M-orthogonal to the columns V, twice (Daniel et al. 1976); return it and M X.

    Columns that lie in the span of the others become zero.
    """
    eps = jnp.finfo(X.dtype).eps
    size = jnp.sqrt(jnp.sum(X**2, (0, 1)))
    X = X / jnp.where(size > 0, size, 1.0)[None, None, :]
    C = _inner_products(MV, X)
    X = X - V @ C
    MX = M @ X
    whole = jnp.max(jnp.sum(C**2, 0) + jnp.diagonal(_inner_products(X, MX)))
    X, MX = _normalise(X, MX, (100 * eps) ** 2 * whole)
    C = _inner_products(MV, X)
    return _normalise(X - V @ C, MX - MV @ C, jnp.zeros_like(whole))


def _normalise(X, MX, least):
    G = _inner_products(X, MX)
    values, U = lapack.eigh((G + G.T) / 2)
    kept = values > jnp.maximum(least, 100 * jnp.finfo(X.dtype).eps * values[-1])
    U = jnp.where(kept[None], U / jnp.sqrt(jnp.where(kept, values, 1.0))[None], 0.0)
    return X @ U, MX @ U


def _inner_products(A, B):
    return A.reshape(-1, A.shape[2]).T @ B.reshape(-1, B.shape[2])


@_block_lanczos.defjvp
def _block_lanczos_jvp(num, sweeps, primals, tangents):
    (K, M), (K_dot, M_dot) = primals, tangents
    values, X = _block_lanczos(num, sweeps, K, M)
    change = M_dot @ X
    R = K_dot.matrix @ X - change * values[None, None, :]
    P, Q = _inner_products(X, R), _inner_products(X, change)
    together = same(values)
    gap = jnp.where(together, 1.0, values[None, :] - values[:, None])
    kept = X @ jnp.where(together, -0.5 * Q, P / gap)
    flat = of_groups(values, X.reshape(-1, num), (kept - _solve_in_complement(K, M, values, X, R)).reshape(-1, num))
    return (values, X), (jnp.diagonal(P), flat.reshape(X.shape))


def _solve_in_complement(K, M, values, X, right):
    """Solve `K Y - M Y diag(values) = right` for Y M-orthogonal to the modes X, by preconditioned conjugate
    gradients.

    The operator is positive definite there where the values are the lowest ones.  300 steps are more than any
    converging solution takes; the residual is reduced by `eps^0.75`, squared in the test.
    """
    K, M, values, X = lax.stop_gradient((K, M, values, X))
    MX = M @ X
    outside = lambda Y: Y - X @ _inner_products(MX, Y)
    balanced = lambda B: B - MX @ _inner_products(X, B)
    inner = lambda A, B: jnp.sum(A * B, (0, 1), keepdims=True)

    def apply(Y):
        Y = outside(Y)
        return balanced(K.matrix @ Y - (M @ Y) * values[None, None, :])

    def iterate(_, B):
        B = balanced(B)
        Z = outside(solve(K, B))
        least = jnp.finfo(B.dtype).eps ** 1.5 * inner(B, Z)

        def step(state):
            Y, R, D, product, count = state
            A = apply(D)
            along = inner(D, A)
            a = product / jnp.where(along > 0, along, 1.0)
            Y, R = Y + a * D, R - a * A
            Z = outside(solve(K, R))
            new = inner(R, Z)
            return Y, R, Z + new / jnp.where(product > 0, product, 1.0) * D, new, count + 1

        go_on = lambda s: jnp.any(s[3] > least) & (s[4] < 300)
        return outside(lax.while_loop(go_on, step, (jnp.zeros_like(B), B, Z, inner(B, Z), 0))[0])

    return lax.custom_linear_solve(apply, right, iterate, symmetric=True)
