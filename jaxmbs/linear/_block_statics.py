"""Static response of block matrices: one factor for all load cases, of free structures with supports that carry none.

Inertia relief solves `K x + M R a = f`, `R^T M x = 0`, where K may be singular.  With springs on as many coordinates
as there are rigid motions, `K + E s E^T` is regular and sparse; their forces `s E^T x` are added to the load, so that
they leave the solution as it is.  What is left are twice as many equations as rigid motions.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..blocksparse import BlockMatrix, factor, solve
from ..checks import is_concrete
from ..math import _square as square
from ..runtime import jit, lapack
from ._block_rows import from_blocks, to_blocks

#: Columns of the test of regularity, and the relative error of their known solutions that counts as singular: that of
#: a condition number of about 0.01 over the rounding, the bound of dense matrices.
PROBES, PROBE_ERROR = 3, 1e-2


def factor_kind(*matrices: BlockMatrix | None) -> str:
    """Kind of the factor of a sum of matrices that need not be positive definite: "ldl" if all are symmetric."""
    return "ldl" if all(A is None or A.is_symmetric for A in matrices) else "lu"


def solve_statics(system, load: Array, rigid: Array | None) -> tuple[Array, Array, Array]:
    """Displacements (n, cases), accelerations along the rigid motions (d, cases), and the largest error of a test.

    Args: load: (n, cases); rigid: (n, d) or None.
    """
    rigid = None if rigid is None else jnp.asarray(rigid, load.dtype)
    return _solve(system.stiffness, system.mass, system.block_rows, load, rigid, is_concrete(system.stiffness))


@jit
def _solve(K, M, rows, load, rigid, tested):
    f = to_blocks(load, K.pattern, rows)
    R = None if rigid is None else to_blocks(rigid, K.pattern, rows)
    kind = factor_kind(K)
    F = factor(K if R is None else _supported(K, R), kind)
    error = _probe(F) if tested else jnp.zeros((), F.matrix.diagonal.dtype)
    x, a = (solve(F, f, 1), f[0, :0]) if R is None else _relieve_inertia(F, K, M, f, R)
    return from_blocks(x, rows), a, error


def _relieve_inertia(F, K, M, f, R):
    """Solution of the saddle system of inertia relief by the factor of the stiffness with supports."""
    d, cases = R.shape[2], f.shape[2]
    E, springs = _supports(K, R)
    carried = M @ R
    size = jnp.max(jnp.abs(K.diagonal))
    weight = lax.stop_gradient(jnp.where(size > 0, size, 1.0) / jnp.max(jnp.abs(carried)))
    E, B = E.astype(f.dtype), weight * carried
    found = solve(F, jnp.concatenate([f, E * springs[None, None], B], axis=2), 1)
    by_load, by_spring, by_inertia = jnp.split(found, [cases, cases + d], axis=2)
    dot = lambda X, Y: X.reshape(-1, d).T @ Y.reshape(-1, Y.shape[2])
    matrix = jnp.block(
        [
            [jnp.eye(d, dtype=f.dtype) - dot(E, by_spring), dot(E, by_inertia)],
            [dot(B, by_spring), -dot(B, by_inertia)],
        ]
    )
    right = jnp.concatenate([dot(E, by_load), -dot(B, by_load)])
    moved, a = jnp.split(square.solve(matrix, right), 2)
    return by_load + by_spring @ moved - by_inertia @ a, weight * a


def _supported(K, R):
    E, springs = _supports(K, R)
    added = E @ springs
    diagonal = K.diagonal + jnp.eye(K.pattern.size, dtype=added.dtype)[None] * added[:, :, None]
    return BlockMatrix(K.pattern, diagonal, K.upper, K.lower)


def _supports(K, R):
    """Unit columns (blocks, size, d) of coordinates that determine the rigid motions, and stiffnesses (d,) for them.

    Chosen one after the other where the rigid motions not yet held, measured by the energy of the diagonal stiffness,
    are largest; any regular choice gives the same solution.
    """
    K, R = lax.stop_gradient((K, R))
    d, own = R.shape[2], jnp.abs(jnp.diagonal(K.diagonal, axis1=1, axis2=2)).reshape(-1)
    most = jnp.max(own)
    own = jnp.maximum(own, jnp.where(most > 0, 1e-12 * most, 1.0))
    A = jnp.sqrt(own)[:, None] * R.reshape(-1, d)
    A = A / jnp.sqrt(jnp.sum(A**2, axis=0, keepdims=True))
    Q = square.solve(lapack.cholesky(A.T @ A), A.T).T
    chosen = []
    for _ in range(d):
        row = jnp.argmax(jnp.sum(Q**2, axis=1))
        unit = Q[row] / jnp.linalg.norm(Q[row])
        Q = Q - (Q @ unit)[:, None] * unit[None, :]
        chosen.append(row)
    rows = jnp.stack(chosen)
    E = jnp.zeros((len(own), d), own.dtype).at[rows, np.arange(d)].set(1.0)
    return E.reshape(R.shape), own[rows]


def _probe(F):
    """Largest relative error () of solutions that are known: random, over the roots of the diagonal."""
    A = F.matrix
    own = jnp.abs(jnp.diagonal(A.diagonal, axis1=1, axis2=2))
    root = jnp.sqrt(jnp.where(own > 0, own, 1.0))[:, :, None]
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (*A.pattern.shape, PROBES))
    known = jnp.asarray(np.where(A.pattern.padding[:, :, None], 0.0, signs), A.diagonal.dtype) / root
    return jnp.max(jnp.abs(solve(F, A @ known) - known) * root)
