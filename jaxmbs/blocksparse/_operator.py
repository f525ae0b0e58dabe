"""The block-sparse matrix as a lineax operator, and its factorisation as a lineax solver."""

from typing import Any

import jax
import jax.numpy as jnp
import lineax as lx
from jaxtyping import Array

from ..tables import sentence_repr
from ._factorisation import Factor, factor, solve
from ._matrix import BlockMatrix


class BlockOperator(lx.AbstractLinearOperator):
    """`lineax.linear_solve(BlockOperator(matrix), b, BlockSolver("cholesky"))` with b (blocks, size)."""

    matrix: BlockMatrix

    __repr__, _repr_html_ = sentence_repr(lambda operator: repr(operator.matrix))

    def __init__(self, matrix: BlockMatrix) -> None:
        if not isinstance(matrix, BlockMatrix):
            raise TypeError(f"a BlockMatrix is needed, not {matrix!r}")
        self.matrix = matrix

    def mv(self, vector: Array) -> Array:
        return self.matrix @ vector

    def as_matrix(self) -> Array:
        return self.matrix.to_dense()

    def transpose(self) -> "BlockOperator":
        return BlockOperator(self.matrix.T)

    def in_structure(self) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct(self.matrix.pattern.shape, self.matrix.diagonal.dtype)

    def out_structure(self) -> jax.ShapeDtypeStruct:
        return self.in_structure()


def _is_symmetric(operator):
    return operator.matrix.is_symmetric


@lx.is_symmetric.register(BlockOperator)
def _(operator):
    return _is_symmetric(operator)


for _question in (
    lx.is_diagonal,
    lx.is_tridiagonal,
    lx.has_unit_diagonal,
    lx.is_lower_triangular,
    lx.is_upper_triangular,
    lx.is_positive_semidefinite,
    lx.is_negative_semidefinite,
):
    _question.register(BlockOperator)(lambda operator: False)

for _same in (lx.linearise, lx.materialise):
    _same.register(BlockOperator)(lambda operator: operator)


@lx.conj.register(BlockOperator)
def _(operator):
    return BlockOperator(jax.tree.map(jnp.conj, operator.matrix))


@lx.diagonal.register(BlockOperator)
def _(operator):
    return jnp.diagonal(operator.matrix.diagonal, axis1=-2, axis2=-1).reshape(-1)


class BlockSolver(lx.AbstractLinearSolver):
    """Factorises a `BlockOperator`; `kind` as in `factor`."""

    kind: str = "cholesky"

    def init(self, operator: lx.AbstractLinearOperator, options: dict[str, Any]) -> Factor:
        if not isinstance(operator, BlockOperator):
            raise ValueError("BlockSolver solves a BlockOperator; wrap the BlockMatrix in one")
        return factor(operator.matrix, self.kind, **options)

    def compute(
        self, state: Factor, vector: Array, options: dict[str, Any]
    ) -> tuple[Array, lx.RESULTS, dict[str, Any]]:
        return solve(state, vector), lx.RESULTS.successful, {}

    def transpose(self, state: Factor, options: dict[str, Any]) -> tuple[Factor, dict[str, Any]]:
        return state.T, options

    def conj(self, state: Factor, options: dict[str, Any]) -> tuple[Factor, dict[str, Any]]:
        return jax.tree.map(jnp.conj, state), options

    def assume_full_rank(self) -> bool:
        return True
