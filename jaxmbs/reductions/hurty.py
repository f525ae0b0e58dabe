"""Rigid, constraint and normal modes (Hurty 1965): statically determinate and redundant bonds apart."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
import scipy.linalg

from ..checks import known
from ..linear.condensation import constraint_modes, interface_basis, partition
from .base import Reduced, numbered, transformed
from .craig_bampton import craig_bampton


def determinate_coordinates(stiffness, interface: Sequence[int]) -> tuple[int, ...]:
    """Interface coordinates that just hold the component: as many as it has rigid motions, best conditioned.

    On the host, once for each topology.  Raises: ValueError under tracing, for negative stiffness, and where the
    interface cannot hold it.
    """
    if not known(stiffness):
        raise ValueError("give the determinate coordinates: they cannot be chosen under tracing")
    K = np.asarray(stiffness)
    _, outer = partition(len(K), interface)
    size = np.sqrt(np.maximum(np.abs(np.diagonal(K)), 1e-300))
    values, vectors = np.linalg.eigh(K / np.outer(size, size))
    limit = 200 * np.finfo(K.dtype).eps * np.max(np.abs(values), initial=0.0)
    if np.any(values < -limit):
        raise ValueError(f"the stiffness is negative: {np.min(values):.3g} of its diagonal in one of its shapes")
    rigid = (vectors / size[:, None])[:, values <= limit]
    if rigid.shape[1] == 0:
        return ()
    rows = rigid[outer] * size[outer, None]
    _, R, order = scipy.linalg.qr(rows.T, pivoting=True, mode="economic")
    if len(outer) < rigid.shape[1] or abs(R[rigid.shape[1] - 1, rigid.shape[1] - 1]) < 1e-8 * abs(R[0, 0]):
        raise ValueError(f"the interface leaves some of the {rigid.shape[1]} rigid motions free")
    return tuple(int(c) for c in outer[np.sort(order[: rigid.shape[1]])])


def hurty(
    stiffness,
    mass,
    interface: Sequence[int],
    num_modes: int,
    damping=None,
    determinate: Sequence[int] | None = None,
) -> Reduced:
    """Coordinates: rigid motions, redundant bonds' constraint modes, fixed-interface modes.

    The connection is `phi = [[RR 0 0], [CR CC 0]]` for determinate and redundant bonds, its rows in the order of
    `interface`; here RR = CC = 1 and CR is what a rigid motion does at the redundant bonds.  A rigid motion then
    costs no stiffness, and the spaces spanned are those of Craig and Bampton.

    Args:
        determinate: coordinates of the interface that just hold the component; default `determinate_coordinates`.

    Raises: ValueError for a determinate coordinate that is not one of the interface and, if concrete, ones that do
    not hold the component.  Source: S1 (13)-(20).
    """
    rigid = determinate_coordinates(stiffness, interface) if determinate is None else tuple(determinate)
    stray = sorted(set(rigid) - set(interface))
    if stray:
        raise ValueError(f"determinate coordinates {stray} are not in the interface")
    order = (*rigid, *(c for c in interface if c not in rigid))
    reduced = craig_bampton(stiffness, mass, order, num_modes, damping)
    d, b = len(rigid), len(order)
    inner, _ = partition(len(stiffness), rigid)
    CR = constraint_modes(stiffness, rigid, "the determinate coordinates")[np.searchsorted(inner, order[d:])]
    E = jnp.eye(b + num_modes, dtype=CR.dtype).at[d:b, :d].set(CR)
    labels = numbered("rigid", d) + numbered("constraint", b - d) + reduced.labels[b:]
    places = np.array([order.index(c) for c in interface], int)
    return transformed(reduced, E, (reduced.connection @ E)[places], labels)


def support_motions(stiffness, determinate: Sequence[int]):
    """Rigid motions (n, d) of a free component, each with one determinate coordinate moved by 1.  Source: S1 (14)."""
    return interface_basis(stiffness, determinate)
