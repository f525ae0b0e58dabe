"""Eigenvalues of a product of matrices that is never formed: small ones keep their digits beside large ones."""

import jax.numpy as jnp
from jax import Array, lax

from ..runtime import jit, lapack
from ._eigen import eig

_SWEEPS = 60  # after which values of ratio 0.6 are apart to 5e-14
_APART = 1e-12  # of the mixing of two directions: less is none


@jit
def product_eigenvalues(factors: Array) -> Array:
    """Eigenvalues (n,) of `F_p ... F_2 F_1` of factors (p, n, n), the largest first.

    Orthogonal iteration on the factors in turn makes each upper triangular between two orthonormal frames, up to
    blocks of values of nearly one size: the periodic Schur form.  The eigenvalues of the product are then those of
    the product of its triangular factors, each to rounding of its own size, not of the largest.  Single values have
    derivatives in forward mode.

    Source: Bojanczyk, Golub and Van Dooren, The periodic Schur decomposition (1992); Golub and Van Loan, Matrix
    Computations, 7.3.2 (orthogonal iteration).
    """
    n = factors.shape[-1]
    if n == 0:
        return lax.complex(*[jnp.zeros(0, factors.dtype)] * 2)
    fixed = lax.stop_gradient(factors)

    def once(Q, F):
        Q, R = lapack.qr(F @ Q)
        return Q, R

    def sweep(Q, _):
        return lax.scan(lambda Q, F: (once(Q, F)[0], None), Q, fixed)[0], None

    begin = lax.scan(sweep, jnp.eye(n, dtype=factors.dtype), None, length=_SWEEPS)[0]
    end, triangles = lax.scan(once, begin, fixed)
    turn = begin.T @ end
    mixes = (jnp.abs(turn) > _APART) | (jnp.arange(n)[:, None] <= jnp.arange(n)[None, :])
    product = lax.scan(lambda P, R: (R @ P, None), jnp.eye(n, dtype=factors.dtype), triangles)[0]
    own = jnp.where(mixes, turn, 0.0) @ product
    whole = lax.scan(lambda P, F: (F @ P, None), begin, factors)[0]
    changes = begin.T @ whole
    return eig(own + changes - lax.stop_gradient(changes))[0][::-1]
