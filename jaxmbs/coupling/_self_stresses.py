"""Self-stresses of bonds: which bond forces the statics of rigid components determines; impedances of components."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array

from ..checks import is_concrete
from ..linear._system import LinearSystem
from ..reductions._base import Reduced
from ..vibration._direct_response import dynamic_stiffness


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
        condensed = [_condensed_stiffness(c) for c in components]
        floor = 1e-6 * (max(np.max(np.diagonal(K), initial=0.0) for K in condensed) or 1.0)
        rigid = [_strain_free_motions(K, floor) for K in condensed]
    moved = ties @ scipy.linalg.block_diag(*(np.asarray(R) for R in rigid))
    U, s, _ = np.linalg.svd(moved)
    rank = int(np.sum(s > 1e-9 * max(s, default=0.0)))
    return U[:, rank:], moved.shape[1] - rank


def _condensed_stiffness(component):
    if not is_concrete(component.stiffness):
        raise ValueError("redundant bonds are found on the host: not under tracing")
    b, K = component.num_interface, np.asarray(component.stiffness)
    return K[:b, :b] - K[:b, b:] @ np.linalg.solve(K[b:, b:], K[b:, :b])


def _strain_free_motions(K, floor):
    """Motions of the interface (b, d) that strain nothing, each of unit size: those below the widest gap."""
    size = np.sqrt(np.maximum(np.diagonal(K), floor))
    values, vectors = np.linalg.eigh(K / np.outer(size, size))
    if np.min(values, initial=0.0) < -1e-3:
        raise ValueError(f"the stiffness of an interface is negative: {np.min(values):.3g} of its diagonal")
    values = np.concatenate([[1e-12], np.maximum(values, 1e-12), [max(1.0, values.max(initial=0.0))]])
    vectors = vectors[:, : np.argmax(values[1:] / values[:-1])] / size[:, None]
    return vectors / np.linalg.norm(vectors, axis=0)


def impedance(c: LinearSystem, omega=None) -> Array:
    """`dynamic_stiffness` of a component at one angular frequency [rad/s], or K for None.  Source: S1 (41)."""
    return c.stiffness if omega is None else dynamic_stiffness(c.stiffness, c.damping, c.mass, jnp.asarray(omega))
