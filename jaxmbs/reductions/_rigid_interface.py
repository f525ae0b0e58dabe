"""Rigid (RBE2) and averaged (RBE3) interfaces: six coordinates for an interface of many nodes."""

from collections.abc import Iterable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import as_flag, count_faults, distinct_names, faults_if, is_concrete
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._condensation import partition
from ..linear._rigid_motions import rigid_motions
from ..linear._system import LinearSystem
from ..math import _square as square
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike, RowsLike
from ._base import Reduced, numbered_labels, project


def rigid_body_motions(positions: AnyArray, reference: ArrayLike, rotations: bool = True) -> Float[Array, "n 6"]:
    """Rigid-body motions (nodes * c, 6) of nodes for unit translations and rotations of a reference point.

    Args:
        positions: (nodes, 3) [m].
        reference: (3,) [m].
        rotations: True if nodes have c = 6 coordinates (x y z rx ry rz), else c = 3 (x y z).

    Source: S1 (14).
    """
    motions = rigid_motions(positions, reference)
    return (motions if as_flag("rotations", rotations) else motions[:, :3]).reshape(-1, 6)


def averaged_motion(
    positions: AnyArray, reference: ArrayLike, weights: AnyArray | None = None, rotations: bool = True
) -> Float[Array, "6 n"]:
    """Rows (6, nodes * c) of the weighted mean motion of nodes at a reference point, from their translations (RBE3).

    The transposed rows distribute a force on the mean motion over the nodes without stiffening them.

    Args:
        positions, reference, rotations: as in `rigid_body_motions`.
        weights: (nodes,), default 1 each.

    Raises: ValueError, if concrete, for nodes on one line, whose mean rotation is undetermined, and for numbers that
    are not finite.
    """
    R = rigid_body_motions(positions, reference, False)
    w = jnp.ones(len(positions), R.dtype) if weights is None else weights
    weighted = R * jnp.repeat(w, 3)[:, None]
    spread = R.T @ weighted
    _check_spread(spread)
    rows = square.solve(spread, weighted.T)
    if not rotations:
        return rows
    wide = jnp.zeros((6, len(positions), 6), R.dtype)
    return wide.at[:, :, :3].set(rows.reshape(6, -1, 3)).reshape(6, -1)


def _check_spread(spread):
    if not is_concrete(spread):
        return
    if not np.all(np.isfinite(spread)):
        raise ValueError("positions, reference or weights are not finite")
    size = np.sqrt(np.maximum(np.diagonal(spread), 1e-300))
    if np.linalg.eigvalsh(spread / np.outer(size, size))[0] < 1e3 * np.finfo(spread.dtype).eps:
        raise ValueError("the nodes lie on one line, or too few have weight: their mean rotation is undetermined")


def rigid_transformation(size: int, interface: RowsLike, motions: AnyArray) -> Float[Array, "n r"]:
    """Transformation `x = W y` (n, n - b + 6) of a rigid interface (RBE2): its six coordinates are the first of y."""
    inner, outer = partition(size, interface)
    k = motions.shape[1]
    W = jnp.zeros((size, k + len(inner)), motions.dtype).at[outer, :k].set(motions)
    return W.at[inner, k + np.arange(len(inner))].set(1.0)


def averaged_transformation(
    size: int, interface: RowsLike, rows: AnyArray, dependent: RowsLike
) -> Float[Array, "n n"]:
    """Transformation `x = W y` (n, n) of an averaged interface (RBE3): the first six of y are `rows @ x[interface]`.

    Args:
        rows: (6, b) of `averaged_motion`.
        dependent: six interface coordinates that y replaces; their columns of `rows` must be regular: translations of
            three nodes that are not on one line, such as `x y z` of one, `y z` of the next, `z` of the third.

    Raises: ValueError for dependent coordinates outside the interface, or not six.
    """
    _, outer = partition(size, interface)
    k, place = rows.shape[0], {int(c): i for i, c in enumerate(outer)}
    if len(dependent) != k or not set(dependent) <= set(place):
        raise ValueError(f"dependent must be {k} coordinates of the interface, not {tuple(dependent)}")
    columns = np.array([place[c] for c in dependent])
    others = np.setdiff1d(np.arange(size), dependent)
    spread = jnp.zeros((k, size), rows.dtype).at[:, outer].set(rows)
    right = jnp.concatenate([jnp.eye(k, dtype=rows.dtype), -spread[:, others]], axis=1)
    W = jnp.zeros((size, size), rows.dtype).at[np.asarray(dependent)].set(square.solve(rows[:, columns], right))
    return W.at[others, k + np.arange(len(others))].set(1.0)


def transform_interface(system: LinearSystem, W: AnyArray, num: int) -> Reduced:
    """The component in the coordinates `x = W y`, the first `num` its interface, the others "inner 0", "inner 1", ...

    `reduce(transform_interface(s, W, 6), CraigBampton(20))` is Craig and Bampton's on a rigid or averaged interface.

    Raises: ValueError for a transformation of another size; ModelError for more interface coordinates than it has.
    """
    W = jnp.asarray(W)
    if W.ndim != 2 or len(W) != system.num_rows:
        raise ValueError(f"W has shape {W.shape}, not ({system.num_rows}, coordinates)")
    faults = count_faults("num", num) or faults_if(
        (num > W.shape[1], f"num = {num} of the interface: there are {W.shape[1]} coordinates")
    )
    if faults:
        raise ModelError(faults, "the interface")
    made = project(system, W, (*numbered_labels("interface", num), *numbered_labels("inner", W.shape[1] - num)), num)
    return made.chain_to(system) if isinstance(system, Reduced) else made


def rigid_node(system: LinearSystem, name: str, nodes: Iterable, position: ArrayLike | None = None) -> Reduced:
    """Attach nodes of a component rigidly to a new node of six coordinates, which becomes its interface (RBE2).

    Args:
        name: name of the new node.
        nodes: names or numbers of the nodes, whose coordinates the new node replaces.
        position: (3,) [m] of the new node; default the mean of the nodes.

    Raises: ModelError for unknown nodes, missing positions, a name that is taken.
    Source: S1 (14).
    """
    s, nodes = system, [str(node) for node in distinct_names("nodes", nodes)]
    if s.positions is None:
        raise ModelError("a rigid node needs the positions of the nodes: LinearSystem(..., positions=...)")
    if name in s.nodes and name not in nodes:
        raise ModelError(f"rigid node {name!r}: another node has this name")
    rows = s.rows(*nodes)
    members = s.positions[np.array([s.nodes.index(node) for node in nodes])]
    place = jnp.mean(members, axis=0) if position is None else as_dtype(position, members.dtype)
    at = [(nodes.index(s.coordinates[i][0]), DIRECTIONS.index(s.coordinates[i][1])) for i in rows]
    W = rigid_transformation(s.num_rows, rows, rigid_motions(members, place)[tuple(np.array(at).T)])
    kept = [i for i in range(s.num_rows) if i not in set(rows)]
    labels = [(name, direction) for direction in DIRECTIONS] + [s.coordinates[i] for i in kept]
    places = {name: place} | {n: p for n, p in zip(s.nodes, s.positions, strict=True) if n not in nodes}
    M, K, C = (None if A is None else W.T @ A @ W for A in (s.mass, s.stiffness, s.damping))
    made = Reduced(s, W, mass=M, stiffness=K, damping=C, coordinates=labels, positions=places)
    made = made.chain_to(s) if isinstance(s, Reduced) else made
    return made.with_interface(name, *(s.coordinates[i] for i in s.interface if i in set(kept)))
