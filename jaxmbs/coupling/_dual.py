"""Bonds as unknowns: the dual assembly, and which reactions rigid-body statics alone determine."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jax import lax
from jaxtyping import Array

from ..checks import is_concrete
from ..linear._system import LinearSystem
from ..math import _square as square
from ..reductions._base import Reduced
from ..vibration._direct_response import dynamic_stiffness
from ._primal import ROUNDING, balanced, join


def dual_response(components: Sequence[LinearSystem], joints: Sequence[Sequence[int]], forces: Sequence, omega=None):
    """Static or harmonic response with the reactions as unknowns: the dual assembly `[Z B^T; B 0]`.

    Args:
        forces: on the components' own coordinates (n_c,), None for none.
        omega: angular frequency [rad/s], or None for statics; the joined structure must be held.

    Returns: (tuple of rho_c in explicit coordinates, Reactions).

    Raises: ValueError, if concrete, where the bonds leave a motion free that the load drives or that resonates.
    Source: S1 (1)-(3), (19), (25).
    """
    assembly = join(components, joints)
    parts = assembly.components
    starts = np.cumsum([0, *(len(p) for p in assembly.places)])
    B = jnp.asarray(_compatibility(assembly.places, starts), parts[0].stiffness.dtype)
    Z = [impedance(c, omega) for c in parts]
    n, m = starts[-1], len(B)
    B = B.astype(Z[0].dtype)
    saddle = jnp.zeros((n + m, n + m), Z[0].dtype).at[:n, n:].set(B.T).at[n:, :n].set(B)
    right = jnp.zeros(n + m, Z[0].dtype)
    for start, c, z, f in zip(starts[:-1], parts, Z, forces, strict=True):
        saddle = lax.dynamic_update_slice(saddle, z, (start, start))
        if f is not None:
            right = lax.dynamic_update_slice(right, (c.basis.T.astype(f.dtype) @ f).astype(right.dtype), (start,))
    solution = square.solve(saddle, right)
    _check_solved(saddle, solution, right)
    reactions = -B.T @ solution[n:]
    cut = [
        (start, start + c.num_interface, end) for start, end, c in zip(starts[:-1], starts[1:], parts, strict=True)
    ]
    rhos = tuple(solution[start:end] for start, _, end in cut)
    return rhos, balanced(assembly, [reactions[start:middle] for start, middle, _ in cut])


def _check_solved(saddle, solution, right):
    """What is left over is at most the rounding of its terms, and these leave two digits: else it is singular."""
    if not is_concrete(saddle, solution, right) or not np.any(np.asarray(right)):
        return
    saddle, solution, right = map(np.asarray, (saddle, solution, right))
    eps, size = np.finfo(right.dtype).eps, np.max(np.abs(right))
    rounding = ROUNDING * eps * np.max(np.abs(saddle) @ np.abs(solution)) / size
    if not np.max(np.abs(saddle @ solution - right)) / size < np.clip(rounding, eps**0.4, eps**0.125):
        raise ValueError("the joined structure is singular: the bonds leave a motion free, or it resonates undamped")


def self_stresses(ties, components: Sequence[Reduced], rigid: Sequence | None = None) -> tuple[np.ndarray, int]:
    """Forces (ties, r) that rigid components carry without a load, orthonormal, and how many motions are left free.

    On the host.  A redundant bond can be cut and leaves no new motion of the components as rigid bodies.

    Args:
        ties: rows over the components' interface coordinates in turn.
        rigid: rigid motions of each component's interface (b_c, d_c); default: those below the widest gap in its
            stiffness.

    Source: S1 (14), (20).
    """
    if rigid is None:
        condensed = [_condensed(c) for c in components]
        floor = 1e-6 * (max(np.max(np.diagonal(K), initial=0.0) for K in condensed) or 1.0)
        rigid = [_rigid(K, floor) for K in condensed]
    moved = ties @ scipy.linalg.block_diag(*(np.asarray(R) for R in rigid))
    U, s, _ = np.linalg.svd(moved)
    rank = int(np.sum(s > 1e-9 * max(s, default=0.0)))
    return U[:, rank:], moved.shape[1] - rank


def _condensed(component):
    if not is_concrete(component.stiffness):
        raise ValueError("redundant bonds are found on the host: not under tracing")
    b, K = component.num_interface, np.asarray(component.stiffness)
    return K[:b, :b] - K[:b, b:] @ np.linalg.solve(K[b:, b:], K[b:, :b])


def _rigid(K, floor):
    """Motions of the interface (b, d) that strain nothing, each of unit size: those below the widest gap."""
    size = np.sqrt(np.maximum(np.diagonal(K), floor))
    values, vectors = np.linalg.eigh(K / np.outer(size, size))
    if np.min(values, initial=0.0) < -1e-3:
        raise ValueError(f"the stiffness of an interface is negative: {np.min(values):.3g} of its diagonal")
    values = np.concatenate([[1e-12], np.maximum(values, 1e-12), [max(1.0, values.max(initial=0.0))]])
    vectors = vectors[:, : np.argmax(values[1:] / values[:-1])] / size[:, None]
    return vectors / np.linalg.norm(vectors, axis=0)


def _compatibility(places, starts):
    """Rows B with `B rho = 0`: members of a joint move with the first, held ones not at all.  Source: S1 (1)."""
    flat = np.concatenate([np.array(p) for p in places])
    rows = []
    for j in np.unique(flat):
        members = np.flatnonzero(flat == j)
        first = None if j < 0 else members[0]
        for member in members if j < 0 else members[1:]:
            row = np.zeros(starts[-1])
            row[member] = 1.0
            if first is not None:
                row[first] = -1.0
            rows.append(row)
    return np.array(rows).reshape(-1, starts[-1])


def impedance(c: LinearSystem, omega=None) -> Array:
    """`dynamic_stiffness` of a component at one angular frequency [rad/s], or K for None.  Source: S1 (41)."""
    return c.stiffness if omega is None else dynamic_stiffness(c.stiffness, c.damping, c.mass, jnp.asarray(omega))
