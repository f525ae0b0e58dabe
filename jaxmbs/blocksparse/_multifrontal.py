"""The numeric phase: factorisation and substitution, tier by tier, by scans over steps of batched dense fronts."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ._matrix import BlockMatrix
from ._pivots import KINDS
from ._plan import Plan


def factorise_fronts(plan: Plan, matrix: BlockMatrix, kind: str) -> tuple:
    """Factorise a matrix: the pivots of every tier, arrays with leading axes (steps, width)."""
    b, eliminate = plan.pattern.size, KINDS[kind].eliminate
    pool = _block_pool(matrix)
    updates = jnp.zeros((plan.num_updates + 1, b * b), pool.dtype)
    padding = np.concatenate([plan.pattern.padding, np.ones((1, b), bool)])
    kept = []
    for tier in plan.tiers:

        def step(updates, x, tier=tier):
            values, sources, empty, first = x
            blocks = [pool[v] for v in values]  # rows of the pivots, columns of the pivots (unsymmetric only)
            blocks += [jnp.zeros((tier.width, tier.boundary, tier.boundary, b * b), pool.dtype)]
            for each in sources:
                blocks = [block + updates[rows] for block, rows in zip(blocks, each, strict=True)]
            F1, *F21, F22 = (_front_matrix(block, b) for block in blocks)
            k = tier.pivots * b
            F11 = jnp.where(empty[:, :, None] & np.eye(k, dtype=bool)[None], jnp.ones((), F1.dtype), F1[:, :, :k])
            pivots, passed = eliminate(F11, F1[:, :, k:], *F21, F22)
            if tier.boundary:
                updates = lax.dynamic_update_slice(updates, _front_blocks(passed, b), (first, 0))
            return updates, pivots

        empty = padding[tier.pivot].reshape(tier.steps, tier.width, -1)
        values = _split_table(tier.values, tier.pivots, kind)[:-1]  # the matrix has nothing between boundary blocks
        sources = [_split_table(tier.updates[:, slot], tier.pivots, kind) for slot in range(tier.updates.shape[1])]
        updates, pivots = _scan_steps(step, updates, (values, sources, empty, tier.first_update))
        kept.append(pivots)
    return tuple(kept)


def _split_table(table, k, kind):
    """Index tables (..., r, r) cut up: rows of the pivots, columns below them ("lu" only), the boundary's own."""
    return [table[..., :k, :], *([table[..., k:, :k]] if kind == "lu" else []), table[..., k:, k:]]


def substitute(plan: Plan, kept: tuple, right):
    """Substitute right-hand sides (blocks, size, columns); returns the solution of that shape."""
    n, b = plan.pattern.shape
    columns = right.shape[-1]
    right = jnp.concatenate([right, jnp.zeros((1, b, columns), right.dtype)])
    carried = jnp.zeros((plan.num_carried + 1, b, columns), right.dtype)
    reduced = []
    for tier, pivots in zip(plan.tiers, kept, strict=True):

        def forward(carried, x, tier=tier):
            pivot, sources, pivots, first = x
            y = jnp.concatenate(
                [right[pivot], jnp.zeros((tier.width, tier.boundary, b, columns), right.dtype)], axis=1
            )
            for slot in range(tier.carried.shape[1]):
                y = y + carried[sources[slot]]
            y = y.reshape(tier.width, tier.rows * b, columns)
            z, passed = pivots.forward(y[:, : tier.pivots * b], y[:, tier.pivots * b :])
            if tier.boundary:
                carried = lax.dynamic_update_slice(carried, passed.reshape(-1, b, columns), (first, 0, 0))
            return carried, z

        carried, z = _scan_steps(forward, carried, (tier.pivot, tier.carried, pivots, tier.first_carried))
        reduced.append(z)
    x = jnp.zeros((n + 1, b, columns), right.dtype)
    for tier, pivots, z in reversed(list(zip(plan.tiers, kept, reduced, strict=True))):

        def backward(x, step, tier=tier):
            pivot, border, pivots, z = step
            known = x[border].reshape(tier.width, tier.boundary * b, columns)
            found = pivots.backward(z, known).reshape(-1, b, columns)
            return x.at[pivot.reshape(-1)].set(found).at[n].set(0.0), None

        x, _ = _scan_steps(backward, x, (tier.pivot, tier.border, pivots, z), reverse=True)
    return x[:n]


def _block_pool(matrix: BlockMatrix):
    """All blocks as rows: diagonal, upper, lower, and a row of zeros."""
    b = matrix.pattern.size
    blocks = [matrix.diagonal, matrix.upper, matrix.lower_blocks, jnp.zeros((1, b, b), matrix.diagonal.dtype)]
    return jnp.concatenate([x.reshape(-1, b * b) for x in blocks])


def _front_matrix(blocks, b):
    """Reshape blocks (width, r, s, b * b) to matrices (width, r b, s b)."""
    c, r, s = blocks.shape[:3]
    return blocks.reshape(c, r, s, b, b).transpose(0, 1, 3, 2, 4).reshape(c, r * b, s * b)


def _front_blocks(matrix, b):
    """Reshape matrices (width, m b, m b) to rows of blocks (width m m, b * b)."""
    c, m = matrix.shape[0], matrix.shape[1] // b
    return matrix.reshape(c, m, b, m, b).transpose(0, 1, 3, 2, 4).reshape(-1, b * b)


def _scan_steps(body, carry, xs, reverse=False):
    """Scan over steps by `lax.scan`, or call the body once where there is one step."""
    if len(jax.tree.leaves(xs)[0]) == 1:
        carry, y = body(carry, jax.tree.map(lambda x: x[0], xs))
        return carry, jax.tree.map(lambda v: v[None], y)
    return lax.scan(body, carry, xs, reverse=reverse)
