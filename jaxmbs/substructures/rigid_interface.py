"""Six coordinates for an interface of many nodes: rigid (RBE2) or averaged (RBE3)."""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..math.linalg import skew
from .base import Reduced, partition


def rigid_body_motions(positions, reference, rotations: bool = True):
    """Motions (nodes * c, 6) of nodes for unit translations and rotations of a reference point.

    Args:
        positions: (nodes, 3) [m].
        reference: (3,) [m].
        rotations: nodes have 6 coordinates (x y z rx ry rz), else 3 (x y z).

    Source: S1 (14).
    """
    arms = [-skew(p - reference) for p in positions]
    eye, zero = jnp.eye(3, dtype=positions.dtype), jnp.zeros((3, 3), positions.dtype)
    rows = [jnp.block([[eye, a], [zero, eye]]) if rotations else jnp.concatenate([eye, a], axis=1) for a in arms]
    return jnp.concatenate(rows)


def averaged_motion(positions, reference, weights=None, rotations: bool = True):
    """Rows (6, nodes * c): the weighted mean motion of the nodes at a reference point, from their translations.

    A force on the mean motion spreads over the nodes by the transposed rows and stiffens nothing.

    Args:
        weights: (nodes,) default 1 each.
    """
    R = rigid_body_motions(positions, reference, False)
    w = jnp.ones(len(positions), R.dtype) if weights is None else weights
    weighted = R * jnp.repeat(w, 3)[:, None]
    rows = jnp.linalg.solve(R.T @ weighted, weighted.T)
    if not rotations:
        return rows
    wide = jnp.zeros((6, len(positions), 6), R.dtype)
    return wide.at[:, :, :3].set(rows.reshape(6, -1, 3)).reshape(6, -1)


def rigid_transformation(size: int, interface: Sequence[int], motions):
    """`x = W y` (n, n - b + 6): the interface moves rigidly with six coordinates, which are y's first (RBE2)."""
    inner, outer = partition(size, interface)
    k = motions.shape[1]
    W = jnp.zeros((size, k + len(inner)), motions.dtype).at[outer, :k].set(motions)
    return W.at[inner, k + np.arange(len(inner))].set(1.0)


def averaged_transformation(size: int, interface: Sequence[int], rows, dependent: Sequence[int]):
    """`x = W y` (n, n): y's first six are `rows @ x[interface]`, in place of six dependent coordinates (RBE3).

    Args:
        dependent: six coordinates of the interface whose columns of `rows` are regular: translations of three nodes
            that are not in line, such as `x y z` of one, `y z` of the next, `z` of the third.
    """
    _, outer = partition(size, interface)
    k, place = rows.shape[0], {int(c): i for i, c in enumerate(outer)}
    if len(dependent) != k or not set(dependent) <= set(place):
        raise ValueError(f"dependent: {k} coordinates of the interface, not {tuple(dependent)}")
    columns = np.array([place[c] for c in dependent])
    others = np.setdiff1d(np.arange(size), dependent)
    spread = jnp.zeros((k, size), rows.dtype).at[:, outer].set(rows)
    right = jnp.concatenate([jnp.eye(k, dtype=rows.dtype), -spread[:, others]], axis=1)
    W = jnp.zeros((size, size), rows.dtype).at[np.asarray(dependent)].set(jnp.linalg.solve(rows[:, columns], right))
    return W.at[others, k + np.arange(len(others))].set(1.0)


def on_interface(
    method: Callable[..., Reduced], W, num: int, stiffness, mass, *args, damping=None, **options
) -> Reduced:
    """Any reduction of a component in the coordinates `x = W y`, whose first `num` are the interface.

    `on_interface(craig_bampton, W, 6, K, M, 20)` is Craig and Bampton's on a rigid or averaged interface.
    """
    K, M, C = (None if A is None else W.T @ A @ W for A in (stiffness, mass, damping))
    reduced = method(K, M, tuple(range(num)), *args, damping=C, **options)
    return eqx.tree_at(lambda r: r.basis, reduced, W @ reduced.basis)
