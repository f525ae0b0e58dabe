"""Recursions over the kinematic tree: poses, ancestor sums, subtree sums and the solve with the mass matrix.

All else is algebra per body.  Arrays are (nodes, components[, batch]) with any batch axes LAST, in depth-first order.
One executor serves chains and trees: `lax.scan` over nodes, with a carry on chains and a stack indexed by depth on
trees.  Three derivative rules make reverse mode cost a few evaluations: the tangent of `poses` is one ancestor sum
of twists, the two sums are declared transposes of each other, and `solve` is a symmetric linear solve that
reuses its factors.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..math import _components as components
from ..math._spatial import (
    axial,
    compose,
    compose_inverse,
    compose_pose,
    cross,
    dot,
    momentum,
    pose_rate,
    rotate,
    rotations,
    scale,
)
from ..model._tree import Tree
from ..runtime import constant_product, fusion_barrier, gather_static, is_on, tuning

_IDENTITY = np.r_[np.eye(3).ravel(), np.zeros(3)]
_ROW, _COLUMN = (np.array(index) for index in zip(*components.UPPER, strict=True))


def _scan_down(tree: Tree, step, x, start):
    """From the root to the leaves: `step(state of the parent, x_k) -> (state, output)`; returns the outputs."""
    if tree.is_chain:
        return lax.scan(step, start, x)[1]
    stack = jnp.zeros((int(tree.depth.max()) + 2, *start.shape), start.dtype).at[0].set(start)

    def visit(stack, row):
        depth, row = row
        state, output = step(lax.dynamic_index_in_dim(stack, depth, 0, False), row)
        return lax.dynamic_update_index_in_dim(stack, state, depth + 1, 0), output

    return lax.scan(visit, stack, (jnp.asarray(tree.depth), x))[1]


def _scan_up(tree: Tree, step, x, zero):
    """From the leaves to the root: `step(sum of the children's states, x_k) -> (state, output)`."""
    if tree.is_chain:
        return lax.scan(step, zero, x, reverse=True)[1]

    # Depth first and in reverse, a node's last child comes first: it overwrites the sum of an earlier branch at its
    # depth.
    inner = tree.end > np.arange(tree.size) + 1
    later = tree.end < np.append(tree.end, tree.size)[tree.parent_or_size]

    def visit(stack, row):
        depth, inner, later, row = row
        below = jnp.where(inner, lax.dynamic_index_in_dim(stack, depth + 1, 0, False), zero)
        state, output = step(below, row)
        state = state + jnp.where(later, lax.dynamic_index_in_dim(stack, depth, 0, False), zero)
        return lax.dynamic_update_index_in_dim(stack, state, depth, 0), output

    stack = jnp.zeros((int(tree.depth.max()) + 2, *zero.shape), zero.dtype)
    rows = (jnp.asarray(tree.depth), jnp.asarray(inner), jnp.asarray(later), x)
    return lax.scan(visit, stack, rows, reverse=True)[1]


# ---------------------------------------------------------------------------------------------------------- sums
def _sum_ancestors(tree, x):
    return _scan_down(tree, lambda c, y: (c + y, c + y), x, jnp.zeros(x.shape[1:], x.dtype))


def _sum_subtrees(tree, x):
    """Along each chain by a scan; then to every node the chains that start below it.  Nothing is subtracted: a
    difference of sums over all nodes would leave the rounding of heavy branches on light ones."""
    zero = jnp.zeros(x.shape[1:], x.dtype)
    if tree.is_chain:
        return lax.scan(lambda c, y: (c + y, c + y), zero, x, reverse=True)[1]

    def step(below, row):
        goes_on, y = row
        total = goes_on * below + y
        return total, total

    along = lax.scan(step, zero, (jnp.asarray(tree.continues_chain, x.dtype), x), reverse=True)[1]
    return along + jnp.tensordot(jnp.asarray(tree.hanging, x.dtype), gather_static(along, tree.starts), 1)


def _is_small(tree, x):
    return tree.size <= tuning.TREE_SUM_PRODUCT and x.ndim == 2 and is_on("tree_sums")


def _subtract_parents(tree, y):
    return y - gather_static(jnp.concatenate([y, jnp.zeros_like(y[:1])]), tree.parent_or_size)


def ancestors(tree: Tree, x):
    """Sum of the rows of `x` over each node and all nodes above it; (nodes, ...)."""
    if _is_small(tree, x):
        return constant_product(tree.path, x)
    return lax.custom_linear_solve(
        partial(_subtract_parents, tree), x, lambda _, b: _sum_ancestors(tree, b), lambda _, b: _sum_subtrees(tree, b)
    )


def subtrees(tree: Tree, x):
    """Sum of the rows of `x` over each node and all nodes below it; the transpose of `ancestors`."""
    if _is_small(tree, x):
        return constant_product(tree.path.T, x)
    less_children = jax.linear_transpose(partial(_subtract_parents, tree), x)
    return lax.custom_linear_solve(
        lambda y: less_children(y)[0], x, lambda _, b: _sum_subtrees(tree, b), lambda _, b: _sum_ancestors(tree, b)
    )


# --------------------------------------------------------------------------------------------------------- poses
@partial(jax.custom_jvp, nondiff_argnums=(0,))
def poses(tree: Tree, local):
    """World pose of every node from its pose in its parent: (nodes, 12, ...), 9 numbers of the rotation, 3 of the
    position.  Rotations must stay rotations under perturbation (the derivative rule drops any other part)."""

    def step(above, below):
        # by outer products: a product of matrices would be a call in every pass of the loop
        pose = compose_pose(above[None], below[None])[0]
        return pose, pose

    start = jnp.broadcast_to(
        jnp.asarray(_IDENTITY, local.dtype).reshape((12,) + (1,) * (local.ndim - 2)), local.shape[1:]
    )
    return _scan_down(tree, step, local, start)


@poses.defjvp
def _poses_jvp(tree, primals, tangents):
    (local,), (local_dot,) = primals, tangents
    world = poses(tree, local)
    R, X = rotations(world), world[:, 9:]
    R_parent = compose_inverse(R, rotations(local))
    omega = axial(compose_inverse(compose(R_parent, rotations(local_dot)), R))
    twist = jnp.concatenate([omega, rotate(R_parent, local_dot[:, 9:]) + cross(X, omega)], axis=1)
    return world, pose_rate(world, ancestors(tree, twist))


# --------------------------------------------------------------------------------------------------------- solve
# The articulated-body algorithm (Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 7) in world axes, for
# momenta in place of efforts.  A value that two results of a step share is behind a barrier: XLA would compute it
# anew in the loop of each of them.
def _factor(tree, S, J):
    """Articulated inertias, leaf to root: (U, 1/D) of each node, U = A S, D = S . U."""
    matrix = components.pack(components.symmetric_matrix(components.unpack(J)))

    def step(below, row):
        s, j = row
        A = below + j
        U = fusion_barrier(jnp.stack(components.symmetric_product(tuple(A), tuple(s))))
        inverse = fusion_barrier(1.0 / components.dot(tuple(s), tuple(U)))
        return A - U[_ROW] * (U * inverse[None])[_COLUMN], (U, inverse)

    zero = jnp.zeros((21, *S.shape[2:]), S.dtype)
    return _scan_up(tree, step, (S, matrix), zero)


def _substitute(tree, S, factors, p):
    """Velocities of momenta `p` by one sweep up (impulses) and one down (twists)."""
    U, inverse = factors

    def up(below, row):
        s, U, inverse, p = row
        u = fusion_barrier(p - components.dot(tuple(s), tuple(below)))
        return below + U * (inverse * u)[None], u

    def down(above, row):
        s, U, inverse, u = row
        rate = fusion_barrier((u[0] - components.dot(tuple(U), tuple(above))) * inverse[0])
        return above + s * rate[None], rate

    zero = jnp.zeros((6, *S.shape[2:]), S.dtype)
    u = _scan_up(tree, up, (S, U, inverse, p), zero)
    return _scan_down(tree, down, (S, U, inverse[:, None], u[:, None]), zero)


def apply_mass(tree: Tree, S, J, x):
    """Mass matrix times `x` (nodes, ...), O(nodes): `S . subtrees(J ancestors(S x))`."""
    return dot(S, subtrees(tree, momentum(J, ancestors(tree, scale(S, x)))))


def solve(tree: Tree, S, J, p):
    """Velocities u with `M(S, J) u = p`, in O(nodes).

    Args: S (nodes, 6, ...) joint twists, J (nodes, 10, ...) inertias, both world; p (nodes, ...) momenta.
    Source: S2 (43) for a tree, `phi_dot = I*^-1 p`.
    """
    fixed_S, fixed_J = lax.stop_gradient((S, J))
    factors = _factor(tree, fixed_S, fixed_J)
    return lax.custom_linear_solve(
        partial(apply_mass, tree, S, J), p, lambda _, b: _substitute(tree, fixed_S, factors, b), symmetric=True
    )


def tree_mass_matrix(tree: Tree, S, J):
    """The mass matrix (..., nodes, nodes) by composite inertias: `M_ij = S_i . (Jc_j S_j)` for i above j."""
    F = momentum(subtrees(tree, J), S)
    lower = jnp.einsum("kc...,jc...->...kj", F, S)
    path = tree.path.reshape((1,) * (lower.ndim - 2) + tree.path.shape)
    lower = lower * jnp.asarray(path, S.dtype)
    strict = jnp.asarray(path & ~np.eye(tree.size, dtype=bool), S.dtype)
    return lower + jnp.swapaxes(lower * strict, -1, -2)
