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


def component_self_stresses(
    ties, components: Sequence[Reduced], rigid: Sequence | None = None
) -> tuple[np.ndarray, int]:
    """Self-stresses (ties, r) of rigid components, orthonormal, and the number of free motions; on the host.

    A redundant bond can be cut without a new motion of the components as rigid bodies.

    Args:
        ties: (ties, b), rows over the interface coordinates of all components.
        rigid: rigid motions of each component's interface (b_c, d_c); default: those below the widest gap in the
            eigenvalues of its stiffness.

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
        raise ValueError("redundant bonds are found on the host, which is not possible under tracing")
    b, K = component.num_interface, np.asarray(component.stiffness)
    return K[:b, :b] - K[:b, b:] @ np.linalg.solve(K[b:, b:], K[b:, :b])


def _strain_free_motions(K, floor):
    """Strain-free motions (b, d) of an interface, of unit norm: eigenvectors below the widest gap of the eigenvalues.

    Eigenvalues are relative to the diagonal, bounded below by 1e-12 (rounding) so that the gap is finite; one below
    -1e-3 is not rounding of a condensation.
    """
    size = np.sqrt(np.maximum(np.diagonal(K), floor))
    values, vectors = np.linalg.eigh(K / np.outer(size, size))
    if np.min(values, initial=0.0) < -1e-3:
        raise ValueError(f"the stiffness of an interface is negative: {np.min(values):.3g} of its diagonal")
    values = np.concatenate([[1e-12], np.maximum(values, 1e-12), [max(1.0, values.max(initial=0.0))]])
    vectors = vectors[:, : np.argmax(values[1:] / values[:-1])] / size[:, None]
    return vectors / np.linalg.norm(vectors, axis=0)


def impedance(c: LinearSystem, omega=None) -> Array:
    """Dynamic stiffness of a component at one angular frequency [rad/s], or K for None.  Source: S1 (41)."""
    return c.stiffness if omega is None else dynamic_stiffness(c.stiffness, c.damping, c.mass, jnp.asarray(omega))
