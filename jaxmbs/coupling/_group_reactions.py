"""Forces of the bonds on groups of components, all of a group at once, and the forces of the ties of the bonds."""

from collections.abc import Sequence
from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..runtime import jit
from ._component_groups import ComponentGroup, contract


def group_coordinates(groups: Sequence[ComponentGroup], xi: Array) -> tuple[Array, ...]:
    """Coordinates (r_c, ...) of every component from rows xi (N, ...) of the network.  Source: S1 (7), (11)."""
    padded, found = _pad(xi), {}
    for group in groups:
        own = group.coordinates(padded)
        found |= {k: own[i] for i, k in enumerate(group.members.numbers.tolist())}
    return tuple(found[k] for k in range(len(found)))


def gather_group_forces(groups: Sequence[ComponentGroup], shares: Sequence, num_rows: int) -> Array:
    """Joined forces (N, ...) of generalised forces (r_c, ...) on the components, None for none."""
    given = [share for share in shares if share is not None]
    dtype = np.result_type(*(share.dtype for share in given))
    total = jnp.zeros((num_rows + 1, *given[0].shape[1:]), dtype)
    for group, own in zip(groups, group_shares(groups, shares), strict=True):
        total = total if own is None else group.add_forces(total, own)
    return total[:-1]


def group_shares(groups: Sequence[ComponentGroup], shares: Sequence) -> tuple[Array | None, ...]:
    """Generalised forces (s, r, ...) of every group, None for none, from those (r_c, ...) by component."""
    found: list[Array | None] = []
    for group in groups:
        own = [shares[k] for k in group.members.numbers]
        at = [i for i, share in enumerate(own) if share is not None]
        if not at:
            found.append(None)
            continue
        dtype = np.result_type(*(own[i].dtype for i in at))
        given = jnp.stack([own[i].astype(dtype) for i in at])
        found.append(jnp.zeros((len(own), *given.shape[1:]), dtype).at[np.array(at)].set(given))
    return tuple(found)


@jit
def group_reactions(groups, num_rows, motions, shares) -> tuple[Array, Array, Array]:
    """Forces `phi^T R = M rho'' + C rho' + K rho - Q` of the bonds on all interfaces, component by component.

    Args:
        motions: (N, ...) displacement, velocity and acceleration, None for zero.
        shares: generalised forces (s, r, ...) on every group, None for none.

    Returns: forces (b, ...), their largest sum at a joint, and the largest sum of the sizes of their terms there.
    Source: S1 (3), (17)-(25).
    """
    padded = [None if x is None else _pad(x) for x in motions]
    sums = jnp.zeros((num_rows + 1, *motions[0].shape[1:]), motions[0].dtype)
    sizes, found = jnp.zeros_like(sums.real), []
    dtype, real = sums.dtype, sizes.dtype
    for group, load in zip(groups, shares, strict=True):
        b, force, size = group.num_interface, jnp.zeros((), dtype), jnp.zeros((), real)
        for A, x in zip((group.stiffness, group.damping, group.mass), padded, strict=True):
            if A is not None and x is not None:
                rho = group.coordinates(x)
                force = force + contract(A[:, :b], rho)
                size = size + contract(jnp.abs(A[:, :b]), jnp.abs(rho))
        if load is not None:
            force, size = force - load[:, :b].astype(dtype), size + jnp.abs(load[:, :b]).astype(real)
        found.append(force)
        sums, sizes = group.add_forces(sums, force), group.absolute().add_forces(sizes, size)
    starts = _interface_starts(groups)
    places = [starts[g.members.numbers][:, None] + np.arange(g.num_interface) for g in groups]
    flat = jnp.concatenate([f.reshape(-1, *f.shape[2:]) for f in found])
    order = np.argsort(np.concatenate([p.reshape(-1) for p in places]))
    gap, rounding = (jnp.max(jnp.abs(total[:-1]), initial=0.0) for total in (sums, sizes))
    return flat[order], gap, rounding


def _interface_starts(groups):
    """First interface coordinate of every component among all."""
    count = np.zeros(sum(len(g.members.numbers) for g in groups), int)
    for group in groups:
        count[group.members.numbers] = group.num_interface
    return np.concatenate([[0], np.cumsum(count)[:-1]])


def _pad(x):
    return jnp.concatenate([x, jnp.zeros_like(x[:1])])


@jit
def tie_forces(ties, size, forces):
    """Forces (ties, ...) of all ties from those on the interfaces: `B^T f = r`, joint by joint.

    Args: ties: pairs of interface coordinates of all components, -1 for the ground or a rigid body; they form no
        ring; size: number of interface coordinates.
    """
    which, place, share = _shares_of_ties(ties, size)
    share = jnp.asarray(share, forces.dtype).reshape(-1, *[1] * (forces.ndim - 1))
    return jnp.zeros((len(ties.numbers), *forces.shape[1:]), forces.dtype).at[which].add(share * forces[place])


@lru_cache(maxsize=64)
def _shares_of_ties(ties, size):
    """Entries (tie, interface coordinate, share) of `(B B^T)^-1 B`, which has a block for every joint."""
    pairs = ties.numbers
    inner = pairs[np.all(pairs >= 0, axis=1)]
    joint = connected_components(coo_array((np.ones(len(inner)), inner.T), (size, size)), directed=False)[1]
    of_joint: dict[int, list[int]] = {}
    for tie, k in enumerate(joint[pairs.max(axis=1)].tolist()):
        of_joint.setdefault(k, []).append(tie)
    entries = []
    for own in of_joint.values():
        places = np.unique(pairs[own])
        places = places[places >= 0]
        B = (pairs[own, :1] == places).astype(float) - (pairs[own, 1:] == places)
        shares = np.linalg.solve(B @ B.T, B)
        i, j = np.nonzero(shares)
        entries.append(np.stack([np.array(own)[i], places[j], shares[i, j]]))
    which, place, share = np.concatenate(entries, axis=1) if entries else np.zeros((3, 0))
    return which.astype(int), place.astype(int), share
