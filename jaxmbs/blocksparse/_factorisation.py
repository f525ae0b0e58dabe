"""Factor once, solve often: the public face of the block-sparse solver, with derivatives of every order.

A factor carries the matrix values beside their factorisation.  The factorisation itself is a constant to
differentiation; derivatives come from A x = b, whose tangents and adjoints are solved by the same factor.
"""

from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..checks import is_concrete
from ..tables import sentence_repr
from ._matrix import BlockMatrix
from ._multifrontal import factorise_fronts, substitute
from ._pivots import KINDS
from ._plan import Plan, analyse


class Factor(eqx.Module):
    """Factorisation of a `BlockMatrix`, for `solve`, `log_determinant` and `matrix_inertia`."""

    matrix: BlockMatrix
    pivots: tuple
    plan: Plan = eqx.field(static=True)
    kind: str = eqx.field(static=True)

    __repr__, _repr_html_ = sentence_repr(lambda factor: f"{factor.kind} of {factor.plan.pattern}")

    @property
    def T(self) -> "Factor":
        """Factor of the transposed matrix, without a new factorisation."""
        return Factor(self.matrix.T, tuple(p.T for p in self.pivots), self.plan, self.kind)


def factor(matrix: BlockMatrix, kind: str = "cholesky", plan: Plan | None = None, **options: Any) -> Factor:
    """Factorise a block matrix: "cholesky" (symmetric positive definite), "ldl" (symmetric: saddle, complex) or "lu"
    (any).

    Pivoting happens inside fronts only: a saddle matrix needs blocks whose leading minors are regular (a body with
    its joint), or a small regularisation; see `refine` of `solve`.

    Args: plan: of `analyse`, default made with the options (`order`, `leaf`, `positions`, `last`, `tiers`).

    Raises: ValueError for an unknown kind, or a symmetric kind of an unsymmetric matrix: one with lower blocks or, if
    concrete, with diagonal blocks that are unsymmetric by more than the root of rounding.
    Fails: a matrix that is not positive definite gives non-finite values, see `is_finite`; under tracing also
    unsymmetric diagonal blocks where the kind is symmetric.
    """
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, got {kind!r}")
    if kind != "lu" and not matrix.is_symmetric:
        raise ValueError(
            f"kind {kind!r} is for symmetric matrices, but this one has lower blocks of its own: use 'lu'"
        )
    plan = analyse(matrix.pattern, **options) if plan is None else plan
    if plan.pattern != matrix.pattern:
        raise ValueError(f"the plan was made for {plan.pattern}, but the matrix has {matrix.pattern}")
    fixed = lax.stop_gradient(matrix)
    return Factor(
        matrix, factorise_fronts(plan, fixed if kind == "lu" else _require_symmetric(fixed, kind), kind), plan, kind
    )


def _require_symmetric(matrix, kind):
    """Refuse unsymmetric diagonal blocks, if concrete; under tracing they become NaN.  Raises: ValueError."""
    part, limit = matrix.asymmetry, jnp.finfo(matrix.diagonal.dtype).eps ** 0.5
    if not is_concrete(part):
        spoilt = jnp.where(part > limit, jnp.nan, 0.0).astype(matrix.diagonal.dtype)
        return eqx.tree_at(lambda m: m.diagonal, matrix, matrix.diagonal + spoilt)
    if part > limit:
        raise ValueError(f"kind {kind!r}: diagonal blocks are unsymmetric by {float(part):.1g} of the largest entry")
    return matrix


def solve(factor: Factor, right: Array | np.ndarray, refine: int = 0) -> Array:
    """Solve `A x = right` for x (blocks, size) or (blocks, size, columns).

    Args: refine: steps of iterative refinement by the stored factor.

    Derivatives with respect to the values of the matrix and the right-hand side, of every order, reuse the factor.
    """
    X = right[..., None] if right.ndim == 2 else right
    dtype = factor.matrix.diagonal.dtype
    if jnp.iscomplexobj(X) and not jnp.issubdtype(dtype, jnp.complexfloating):
        return lax.complex(solve(factor, right.real, refine), solve(factor, right.imag, refine))
    X = X.astype(dtype)
    kept, transposed = (lax.stop_gradient(f.pivots) for f in (factor, factor.T))
    by = lambda pivots: lambda apply, b: _solve_refined(factor.plan, pivots, apply, b, refine)
    symmetric = factor.kind != "lu"
    found = lax.custom_linear_solve(factor.matrix.__matmul__, X, by(kept), by(transposed), symmetric=symmetric)
    return found[..., 0] if right.ndim == 2 else found


def _solve_refined(plan, pivots, apply, b, steps):
    x = substitute(plan, pivots, b)
    for _ in range(steps):
        x = x + substitute(plan, pivots, b - apply(x))
    return x


def solve_once(
    matrix: BlockMatrix, right: Array | np.ndarray, kind: str = "cholesky", plan: Plan | None = None, **options: Any
) -> Array:
    """Factorise and solve at once: `solve(factor(matrix, kind), right)`."""
    return solve(factor(matrix, kind, plan, **options), right)


def log_determinant(factor: Factor) -> tuple[Array, Array]:
    """Sign and logarithm `(sign, log |det A|)`; the logarithm has the derivative `tr(A^-1 dA)`, of every order.

    A complex matrix has a phase for its sign, which carries no derivative.
    """
    signs, logs = zip(*(_tier_determinant(p) for p in factor.pivots), strict=True)
    sign = lax.stop_gradient(jnp.prod(jnp.stack(signs)))
    log = lax.stop_gradient(sum(logs))
    return sign, _with_trace_rule(factor.plan, factor.kind, factor.matrix, log)


def _tier_determinant(pivots):
    sign, log = pivots.log_determinant()
    return jnp.prod(sign), jnp.sum(log)


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _with_trace_rule(plan, kind, matrix, log):
    return log


@_with_trace_rule.defjvp
def _trace_rule(plan, kind, primals, tangents):
    """The log-determinant as the sum over pivots is differentiable as it stands: the tangent of that sum."""

    def total(matrix):
        return sum(jnp.sum(p.log_determinant()[1]) for p in factorise_fronts(plan, matrix, kind))

    return primals[1], jax.jvp(total, (primals[0],), (tangents[0],))[1]


def matrix_inertia(factor: Factor) -> tuple[Array, Array]:
    """Inertia of a symmetric matrix from its "ldl" factor: numbers (positive, negative) of its eigenvalues.

    Padding is not counted.  Raises: ValueError, if concrete, for a factor that is not finite.
    Source: Sylvester's law; with A = K - w^2 M it counts the frequencies below w.
    """
    if is_concrete(factor.pivots) and not is_finite(factor):
        raise ValueError("a factor that is not finite has no inertia: the matrix is singular, or not finite itself")
    negative = jnp.sum(jnp.stack([jnp.sum(p.negatives()) for p in factor.pivots]))
    return int(factor.plan.pattern.sizes.sum()) - negative, negative


def is_finite(factor: Factor) -> Array:
    """True if the factorisation met no singular or, for "cholesky", indefinite front."""
    leaves = jax.tree.leaves(factor.pivots)
    return jnp.all(jnp.stack([jnp.all(jnp.isfinite(leaf)) for leaf in leaves]))
