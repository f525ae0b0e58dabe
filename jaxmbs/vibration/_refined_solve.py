"""Solutions with a dynamic stiffness by an approximate inverse: refined, checked, direct where the check fails.

Modes give an inverse only as far as they decouple the matrices: a defective root, damping that couples them or free
motion beside stiff modes costs digits or the whole answer.  The residual of the equation shows it.
"""

import jax.numpy as jnp
from jax import lax

from ..math import _square as square
from ..math._spd import refined
from ..runtime import lazy_where

#: What may be left over, of the sizes of its terms, in units of rounding times the root of their number.
RESIDUAL_FACTOR = 64.0


def refined_solve(Z, right):
    """Direct solution `Z^-1 right` (n, k), refined once; with derivatives of every order."""
    fixed = lax.stop_gradient(Z)
    straight, turned = (_factor(fixed, t) for t in (False, True))
    return lax.custom_linear_solve(lambda x: Z @ x, right, lambda _, r: straight(r), lambda _, r: turned(r))


def checked_solve(matrices, factors, right, inverse, transposed=None):
    """Solve `sum_k factor_k matrix_k x = right` by an approximate inverse; with derivatives of every order.

    Args:
        matrices: real (n, n); factors: complex numbers.
        inverse: `r -> v`, nearly the solution, held constant; transposed: that of the transposed matrix, None where
            all are symmetric.

    One step of refinement, then the direct solution where more than rounding is left over.
    """
    fixed, numbers = lax.stop_gradient((tuple(matrices), tuple(factors)))

    def by(inverse, matrices):
        return lambda _, r: _refine_and_check(inverse, matrices, numbers, r)

    return lax.custom_linear_solve(
        lambda v: _apply(matrices, factors, v),
        right,
        by(inverse, fixed),
        by(inverse if transposed is None else transposed, tuple(A.T for A in fixed)),
        symmetric=transposed is None,
    )


def _apply(matrices, factors, v):
    return sum(f * _real_product(A, v) for A, f in zip(matrices, factors, strict=True))


def _real_product(A, v):
    """Product of a real (n, n) and a complex (n, k) matrix as one real product."""
    both = A @ jnp.concatenate([v.real, v.imag], axis=1)
    return lax.complex(both[:, : v.shape[1]], both[:, v.shape[1] :])


def _refine_and_check(inverse, matrices, factors, right):
    v = refined(inverse, lambda v: _apply(matrices, factors, v), right, 1)
    miss = jnp.abs(right - _apply(matrices, factors, v))
    pairs = [(jnp.abs(f), jnp.abs(A)) for f, A in zip(factors, matrices, strict=True)]
    terms = jnp.abs(right) + sum(f * (A @ jnp.abs(v)) for f, A in pairs)
    # A row over the root of its own stiffness is in one unit whatever the row's: the root of an energy.
    own = sum(f * jnp.diagonal(A) for f, A in pairs)
    unit = jnp.where(own > 0, lax.rsqrt(jnp.where(own > 0, own, 1.0)), 1.0)[:, None]
    allowed = RESIDUAL_FACTOR * jnp.finfo(miss.dtype).eps * len(right) ** 0.5
    good = jnp.max(miss * unit, axis=0) <= allowed * jnp.max(terms * unit, axis=0)  # not where there is a NaN
    return lazy_where(jnp.all(good), v, _direct_solution, right, tuple(factors), tuple(matrices))


def _direct_solution(right, factors, matrices):
    """The solution of `sum(f A) x = right` by a factor of the whole matrix."""
    return _factor(sum(f * A.astype(right.dtype) for f, A in zip(factors, matrices, strict=True)), False)(right)


def _factor(Z, transposed):
    """Function that solves with Z, or with its transpose, refined once."""
    factor, A = square.factorise(Z), Z.T if transposed else Z
    steps = 1 if isinstance(factor, square.Lu) else 0  # small matrices come refined
    return lambda right: refined(lambda r: factor.solve(r, transposed), lambda x: A @ x, right, steps)
