"""Signs of determinants, block by block, in traced code without LAPACK; small pivots count as zero."""

import jax.numpy as jnp
import numpy as np
from jax import lax


def determinant_signs(A, block, least):
    """Sign -1, 0 or 1 (blocks,) of the determinant of every block of A (n, n); no derivative passes.

    Zero where a block is not finite.

    Args:
        block: (n,) static number of the block, from zero, of every column and of the row in the same place; entries
            of A between different blocks are zero.
        least: pivots up to this, relative to the largest entry of the block, count as zero.
    """
    members = np.arange(max(block, default=-1) + 1)[:, None] == np.asarray(block, int)[None]
    if isinstance(A, np.ndarray):
        return np.array([_known_sign(A[np.ix_(at, at)], least) for at in members], A.dtype)
    if not len(members):
        return jnp.zeros(0, A.dtype)
    signs = _column_signs(lax.stop_gradient(A), members[np.asarray(block, int)], least)
    negative, singular = (jnp.sum(members & x[None], axis=1) for x in (signs < 0, signs == 0))
    return jnp.where(singular > 0, 0, 1 - 2 * (negative % 2)).astype(A.dtype)


def _known_sign(A, least):
    """The sign of one block in NumPy."""
    if not np.all(np.isfinite(A)):
        return 0.0
    A, floor, sign = np.array(A), least * np.max(np.abs(A), initial=0.0), 1.0
    for k in range(len(A)):
        row = k + int(np.argmax(np.abs(A[k:, k])))
        if not abs(A[row, k]) > floor:
            return 0.0
        A[[k, row]] = A[[row, k]]
        sign *= np.sign(A[k, k]) if row == k else -np.sign(A[k, k])
        A[k + 1 :] -= np.outer(A[k + 1 :, k] / A[k, k], A[k])
    return float(sign)


def _column_signs(A, together, least):
    """Sign (n,) that each column contributes to its block by elimination; together (n, n): in the same block.

    The largest entry left in a column is its pivot.  Rows stay where they are: the determinant is expanded along the
    column, with the sign of the pivot's place among the rows of the block that are left.
    """
    index = np.arange(len(together))
    floor = least * jnp.max(jnp.where(together, jnp.max(jnp.abs(A), axis=1)[None], 0.0), axis=1)

    def eliminate(carry, step):
        A, left = carry
        column, mine, smallest = step
        mine, entries = mine & left, A @ column
        pivot_row = jnp.argmax(jnp.where(mine, jnp.abs(entries), -1.0))
        at = index == pivot_row
        row, pivot = jnp.sum(jnp.where(at[:, None], A, 0.0), axis=0), jnp.sum(jnp.where(at, entries, 0.0))
        odd = jnp.sum(mine & (index < pivot_row)) % 2 == 1
        sign = jnp.where(jnp.abs(pivot) > smallest, jnp.where(odd, -jnp.sign(pivot), jnp.sign(pivot)), 0.0)
        share = jnp.where(mine & ~at, entries, 0.0) / jnp.where(pivot == 0.0, 1.0, pivot)
        return (A - share[:, None] * row[None], left & ~at), sign

    return lax.scan(eliminate, (A, jnp.full(len(index), True)), (np.eye(len(index), dtype=A.dtype), together, floor))[
        1
    ]
