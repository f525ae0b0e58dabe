"""Frequency-based substructuring (LM-FBS): interface forces as Lagrange multipliers of the compatibility."""

from collections.abc import Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex

from ..checks import distinct_names, require_numbers
from ..errors import ModelError
from ..linear._transfer import TransferFunctions
from ..math import _square as square
from ..typing import ArrayLike
from ._regularised_inverse import regularised_inverse
from ._uncoupled_transfer import uncoupled_transfer

#: Two channels with the same motion, or one channel and None: fixed to the ground.
Pair = tuple[str, str | None]


def signed_interface(names: Sequence[str], pairs: Sequence[Pair]) -> np.ndarray:
    """Signed Boolean matrix (pairs, channels): +1 at the first channel of a pair, -1 at the second one.

    Raises: ModelError with the names that are not there and the pairs of a channel with itself.
    Source: S1 (1).
    """
    faults = [f"there is no channel {n!r}" for pair in pairs for n in pair if n is not None and n not in names]
    faults += [f"channel {a!r} is joined to itself" for a, b in pairs if a == b]
    if faults:
        raise ModelError([f"{fault}; there are {', '.join(names)}" for fault in faults])
    B = np.zeros((len(pairs), len(names)))
    for row, (a, b) in enumerate(pairs):
        B[row, names.index(a)] = 1.0
        if b is not None:
            B[row, names.index(b)] = -1.0
    return B


def couple_transfer(
    parts: TransferFunctions | Mapping[str, TransferFunctions],
    pairs: Sequence[Pair],
    compliance: ArrayLike | None = None,
    **regular: Any,
) -> TransferFunctions:
    """Couple components by transfer functions: `Y - Y B^T (B Y B^T + S)^-1 B Y`.

    Args:
        parts: components by name (their channels are then named "component channel"), or what `uncoupled_transfer` or
            an earlier coupling returned.
        pairs: channels with the same motion, each both output and input.  (name, None) fixes a channel.
        compliance: S of elastic bonds, (pairs, pairs) or (frequencies, pairs, pairs): relative motion (displacement,
            velocity, acceleration as the kind says) per force; None is rigid.
        regular: `rank`, `rcond`, `noise`, `weights` of `regularised_inverse`, for measured interfaces.

    Repeated pairs and pairs in a ring (a-b, b-c, a-c) are allowed: redundant pairs are found from the names, so that
    no tolerance decides the rank of B; for S see `independent_pairs`.  With `regular` the rank is at most that of B.

    Source: S1 (1)-(3), (40)-(41); D. de Klerk, D. Rixen, S. Voormeeren, AIAA J. 46 (2008) 1169.
    """
    Y = parts if isinstance(parts, TransferFunctions) else uncoupled_transfer(parts)
    Bf, sums, shares = _multipliers(Y, pairs, compliance, regular)
    return Y.with_values(Y.values - (Y.values @ Bf.T @ shares) @ sums)


def coupling_forces(
    parts: TransferFunctions | Mapping[str, TransferFunctions],
    pairs: Sequence[Pair],
    compliance: ArrayLike | None = None,
    **regular: Any,
) -> Complex[Array, "frequencies pairs inputs"]:
    """Forces that the bonds exert on the first channel of each pair, for unit forces at the inputs.

    The second channel gets the opposite force.  Arguments as in `couple_transfer`.  Where pairs are redundant, the
    compliance S distributes the forces; rigid bonds take the distribution of least norm.  Source: S1 (2), (25).
    """
    Y = parts if isinstance(parts, TransferFunctions) else uncoupled_transfer(parts)
    _, sums, shares = _multipliers(Y, pairs, compliance, regular)
    return -shares @ sums


def add_stiffness(receptances: TransferFunctions, channels: Sequence[str], stiffness: Array) -> TransferFunctions:
    """Add a dynamic stiffness to a structure: `Y - Y Z (I + Y Z)^-1 Y`, without an inverse of Y.

    Args: channels: names, both outputs and inputs; stiffness: Z (1 or frequencies, channels, channels) [N/m].

    Source: S1 (41).
    """
    Y, Z = receptances.values, stiffness.astype(receptances.values.dtype)
    channels = distinct_names("channels", channels)
    columns, rows = receptances.columns(channels), Y[:, receptances.rows(channels)]
    inner = jnp.eye(Z.shape[-1], dtype=Z.dtype)[None] + rows[:, :, columns] @ Z
    return receptances.with_values(Y - Y[:, :, columns] @ Z @ jax.vmap(square.solve)(inner, rows))


def independent_pairs(B) -> tuple[np.ndarray, np.ndarray]:
    """First independent rows (r,) of a signed Boolean B (pairs, channels), and its rings (pairs, pairs - r).

    A ring N is a column of -1, 0, 1 with `B^T N = 0`: forces around it only strain its elastic bonds, so that they
    minimise the energy with `N^T S N`.  Where that is rounding of its terms (below 2e-10 of `|N|^T |S| |N|` in double
    precision, 5e-5 in single) nothing resists, and the last pair of the ring carries no force.
    """
    ground = B.shape[1]
    root = np.arange(ground + 1)

    def top(channel):
        while root[channel] != channel:
            channel = root[channel]
        return channel

    first = []
    for k, row in enumerate(B):
        a, b = (top(c) for c in (*np.flatnonzero(row), ground)[:2])
        if a != b:
            root[a] = b
            first.append(k)
    others = np.setdiff1d(np.arange(len(B)), first)
    rings = np.zeros((len(B), len(others)))
    if len(others):
        rings[first] = -np.rint(np.linalg.lstsq(B[first].T, B[others].T, rcond=None)[0])
        rings[others, np.arange(len(others))] = 1.0
    return np.array(first, int), rings


def _multipliers(Y, pairs, compliance, regular):
    """Matrix B of the inputs, multipliers (frequencies, r, inputs), and their distribution (..., pairs, r)."""
    dtype = Y.values.dtype
    B, Bf = (signed_interface(names, pairs) for names in (Y.outputs, Y.inputs))
    first, rings = independent_pairs(B)
    Bu, Bf, every = (jnp.asarray(A, dtype) for A in (B, Bf, np.eye(len(pairs))))
    if compliance is not None:
        require_numbers(compliance=compliance)
    S = None if compliance is None else jnp.asarray(compliance, dtype)
    S = S[None] if S is not None and S.ndim == 2 else S
    if regular:
        flexibility = Bu @ Y.values @ Bf.T
        if S is None:
            rank = regular.get("rank")
            regular = regular | {"rank": len(first) if rank is None else min(rank, len(first))}
        inverse = regularised_inverse(flexibility if S is None else flexibility + S, **regular)
        return Bf, inverse @ (Bu @ Y.values), every
    shares = _distribute_forces(first, rings, S, dtype)
    gap = Bu[first] @ Y.values
    flexibility = gap @ Bf[first].T
    if S is not None:
        flexibility = flexibility + (S @ shares)[:, first]
    return Bf, jax.vmap(square.solve)(flexibility, gap), shares


def _distribute_forces(first, rings, S, dtype):
    """Forces (..., pairs, r) of all pairs for unit forces of the independent pairs."""
    alone = np.eye(len(rings))[:, first]
    if S is None or not rings.shape[1]:
        return jnp.asarray(alone - rings @ (np.linalg.pinv(rings) @ alone), dtype)
    N, alone = jnp.asarray(rings, dtype), jnp.asarray(alone, dtype)
    own, size = N.T @ S @ N, jnp.abs(N).T @ jnp.abs(S) @ jnp.abs(N)
    least = float(jnp.finfo(dtype).eps) ** (5 / 8)
    inverse = regularised_inverse(jnp.where(jnp.abs(own) > least * size, own, 0.0), rcond=least)
    return alone[None] - N @ (inverse @ (N.T @ S @ alone))
