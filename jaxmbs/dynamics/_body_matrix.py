"""`M + A^T C^-1 A` of a mechanism as a block-sparse matrix on its bodies, and its inverse on the tree's columns.

Every group of bodies has 12 unknowns: its twist v at its joint (angles times the characteristic length), and the
wrench w of that joint, which keeps the twist relative to the parent within the joint's columns s: with P the
projector across them, `J v + P w - (X^T P w of the children) = f`, `P (v - X v_parent) = 0`.  Closures and drives are
springs C^-1.  Such blocks can be eliminated in any order while every column has inertia.  A massless body is lent a
small part of its subtree's inertia; iterative refinement removes that error.  The matrix is a preconditioner:
derivatives do not pass through it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from .. import blocksparse
from ..math._components import UPPER, pack, symmetric_matrix, unpack
from ..math._linalg import skew
from ..math._spd import spd_inverse
from ._body_graph import BodyGraph

#: Inertia lent to bodies, relative to that of their subtree (double, single precision): well above rounding, so that
#: pivots are positive, and small enough that two refinements remove it.
ADDED_INERTIA = {8: 1e-11, 4: 1e-5}
_TRIANGLE_INDEX = np.zeros((6, 6), int)
for _k, (_i, _j) in enumerate(UPPER):
    _TRIANGLE_INDEX[_i, _j] = _TRIANGLE_INDEX[_j, _i] = _k


class JointMaps(NamedTuple):
    """World twists of local ones `world` (g + 1, 6, 6); X that carries the parent's twist `shift`, G that reads the
    columns' rates `G (v - X v_parent)` `along`, P `across`, (g, 6, 6) each."""

    world: Array
    shift: Array
    along: Array
    across: Array


def joint_maps(graph: BodyGraph, at, length) -> JointMaps:
    """The maps at a configuration."""
    point = jnp.concatenate([at.W[graph.node, 9:12], jnp.zeros((1, 3), at.W.dtype)])
    held = jnp.asarray(graph.parent < len(graph.node), point.dtype)[:, None, None]
    arm = jax.vmap(skew)(point)
    world = _block_lower(1.0 / length, arm / length)
    shift = _block_lower(jnp.ones_like(length), (arm[graph.parent] - arm[:-1]) / length) * held
    local = _block_lower(length, -arm[:-1])
    columns = jnp.concatenate([at.S, jnp.zeros((1, 6), at.S.dtype)])[graph.columns]
    s = local @ jnp.swapaxes(columns, 1, 2)
    unused = jnp.asarray(graph.columns == len(at.S), s.dtype)[:, :, None] * jnp.eye(6, dtype=s.dtype)[None]
    along = jax.vmap(spd_inverse)(_transpose(s) @ s + unused) @ _transpose(s)
    return JointMaps(world, shift, along, jnp.eye(6, dtype=s.dtype)[None] - s @ along)


def _block_lower(angle, arm):
    """`[angle I, 0; arm, I]` (n, 6, 6)."""
    eye = jnp.broadcast_to(jnp.eye(3, dtype=arm.dtype), arm.shape)
    upper = jnp.concatenate([angle * eye, jnp.zeros_like(arm)], axis=2)
    return jnp.concatenate([upper, jnp.concatenate([arm, eye], axis=2)], axis=1)


def _transpose(x):
    return jnp.swapaxes(x, -1, -2)


def body_matrix(graph: BodyGraph, maps: JointMaps, J, composite, springs, driven, clusters, scale):
    """The matrix as a `BlockMatrix`.

    Args:
        J: inertias (nodes, 10) of rigid bodies; composite: (nodes, 10) of subtrees, elastic bodies among them.
        springs: per closure group (elements, 6, 6), stiffness on world twists; driven: (nv,) that on each column.
        clusters: inertias (bodies, k, k, 6, 6) of the elastic bodies on world twists of their interfaces.
        scale: () usual inertia of a body.
    """
    g, T, X, dtype = len(graph.node), maps.world, maps.shift, J.dtype
    lent = ADDED_INERTIA[dtype.itemsize]
    inertia = _inertia_matrices(J[graph.node] + lent * composite[graph.node])
    # a point mass has no rotational inertia: a thousandth of what is lent to bodies is added in every direction
    diagonal = _transpose(T[:-1]) @ inertia @ T[:-1] + 1e-3 * lent * scale * jnp.eye(6, dtype=dtype)[None]
    diagonal = jnp.concatenate([diagonal, jnp.zeros((1, 6, 6), dtype)])
    upper = jnp.zeros((graph.pattern.num_edges + 1, 6, 6), dtype)

    on_column = jnp.concatenate([driven, jnp.zeros(1, dtype)])[graph.columns]
    K = _transpose(maps.along) @ (on_column[:, :, None] * maps.along)
    tree = graph.edges(graph.parent, np.arange(g))
    diagonal = diagonal.at[:-1].add(K).at[graph.parent].add(_transpose(X) @ K @ X)
    upper = upper.at[tree].add(-_transpose(X) @ K)

    if len(graph.ends):
        inside = jnp.asarray(graph.ends[:, 0] != graph.ends[:, 1], dtype)[:, None, None]
        low, high = graph.ends.min(axis=1), graph.ends.max(axis=1)
        K = jnp.concatenate(springs) * inside
        diagonal = (
            diagonal.at[low].add(_transpose(T[low]) @ K @ T[low]).at[high].add(_transpose(T[high]) @ K @ T[high])
        )
        upper = upper.at[graph.edges(low, high)].add(-_transpose(T[low]) @ K @ T[high])

    for at, E in zip(graph.clusters, clusters, strict=True):
        for i in range(at.shape[1]):
            diagonal = diagonal.at[at[:, i]].add(_transpose(T[at[:, i]]) @ E[:, i, i] @ T[at[:, i]])
            for j in range(i):
                a, b = at[:, i], at[:, j]
                block = _transpose(T[a]) @ E[:, i, j] @ T[b]
                block = jnp.where(jnp.asarray(a < b)[:, None, None], block, _transpose(block))
                upper = upper.at[graph.edges(np.minimum(a, b), np.maximum(a, b))].add(block)

    P, free = scale * maps.across, scale * (maps.across - jnp.eye(6, dtype=dtype)[None])
    diagonal = jnp.concatenate([jnp.concatenate([diagonal[:-1], P], 2), jnp.concatenate([P, free], 2)], axis=1)
    wrench = jnp.zeros_like(upper).at[tree].set(-_transpose(X) @ P)[:-1]
    upper = jnp.concatenate([upper[:-1], wrench], axis=2)
    return blocksparse.BlockMatrix(graph.pattern, diagonal, jnp.pad(upper, ((0, 0), (0, 6), (0, 0))))


def solve_columns(graph: BodyGraph, maps: JointMaps, factor, r, load):
    """Accelerations (nv,) of the columns and local twists (g + 1, 6) for efforts r (nv,), local wrenches load."""
    padded = jnp.concatenate([r, jnp.zeros(1, r.dtype)])[graph.columns]
    f = jnp.einsum("gca,gc->ga", maps.along, padded)
    load = load.at[:-1].add(f).at[graph.parent].add(-jnp.einsum("gba,gb->ga", maps.shift, f))[:-1]
    v = blocksparse.solve(factor, jnp.concatenate([load, jnp.zeros_like(load)], axis=1))[:, :6]
    v = jnp.concatenate([v, jnp.zeros((1, 6), r.dtype)])
    rates = v[:-1] - jnp.einsum("gab,gb->ga", maps.shift, v[graph.parent])
    rates = jnp.einsum("gca,ga->gc", maps.along, rates)
    return jnp.concatenate([rates, jnp.zeros((1, 6), r.dtype)])[graph.group, graph.slot], v


def _inertia_matrices(J):
    """Matrices (n, 6, 6) of inertias (n, 10)."""
    return pack(symmetric_matrix(unpack(J)))[:, _TRIANGLE_INDEX]
