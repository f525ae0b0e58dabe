"""Coordinates that nothing holds against the loads: why a mechanism has no equilibrium."""

import jax.numpy as jnp
import numpy as np

from ..constraints._kic import independent_columns
from ..constraints._mobility import with_mobility_at
from ..model._system import System
from ..runtime import jit
from ._balance import balance, unknown_columns
from ._linearise import column_names
from ._unknowns import unknowns_of

_FREE = 1e-9  # stiffness along a motion, rows and columns scaled to one, that is none
_SHARE = 0.2  # of a free motion, from which on a coordinate is named
_MOST_NAMES = 6


def unheld_coordinates(system: System, state) -> list[str]:
    """Names of the independent coordinates with a part in motions that loads push and no stiffness holds, at a state
    with concrete numbers."""
    system = with_mobility_at(system, state)
    chosen = independent_columns(system)
    at = _balance_at(system, state)
    K, efforts = np.asarray(at.slope)[: len(chosen), : len(chosen)], np.asarray(at.efforts)[: len(chosen)]
    if not len(chosen) or not np.all(np.isfinite(K)) or not np.all(np.isfinite(efforts)):
        return []
    size = _sizes(K)
    left, values, right = np.linalg.svd(K / np.outer(size, size))
    free = values <= _FREE * max(values[0], 1e-300)
    pushed = np.abs(left[:, free].T @ (efforts / size)) > _FREE * np.max(np.abs(efforts / size), initial=0.0)
    return _named(system, right[free][pushed] / size)


def neutral_coordinates(system: System, K: np.ndarray) -> list[str]:
    """Names of the independent coordinates with a part in motions without stiffness, of K (N, N) at a state."""
    if not K.size or not np.all(np.isfinite(K)):
        return []
    size = _sizes(K)
    _, values, right = np.linalg.svd(K / np.outer(size, size))
    free = values <= _FREE * max(values[0], 1e-300)
    return _named(system, right[free] / size)


def leaves_internal_states_open(system: System, state, moving) -> bool:
    """True if some internal state may have any value at a rest with concrete numbers: what is trapped, for example.

    Args: moving: columns that keep their values.
    """
    system = with_mobility_at(system, state)
    still = ~np.isin(unknown_columns(system), moving)
    K, first = np.asarray(_balance_at(system, state).slope), len(independent_columns(system))
    K, is_internal = K[np.ix_(still, still)], (np.arange(len(K)) >= first)[still]
    if not np.any(is_internal) or not np.all(np.isfinite(K)):
        return False
    size = _sizes(K)
    _, values, right = np.linalg.svd(K / np.outer(size, size))
    free = values <= _FREE * max(values[0], 1e-300)
    return bool(np.any(np.abs(right[free][:, is_internal]) > _SHARE))


def _sizes(K):
    """Sizes (N,) of rows and columns, one of what is nothing."""
    size = np.sqrt(np.maximum(np.max(np.abs(K), axis=0), np.max(np.abs(K), axis=1)))
    return np.where(size > 0.0, size, 1.0)


def _named(system, motions):
    """Names of the independent coordinates that move most in motions (n, N), the first few."""
    parts = np.max(np.abs(motions), axis=0, initial=0.0)
    names = column_names(system.topology, independent_columns(system))
    found = [
        repr(name) for name, part in zip(names, parts, strict=True) if part > _SHARE * np.max(parts, initial=0.0)
    ]
    rest = found[_MOST_NAMES:]
    return [*found[:_MOST_NAMES], f"{len(rest)} more"] if rest else found


@jit(compile="tape")
def _balance_at(system, state):
    psi = unknowns_of(system, state)
    return balance(system, psi, state.t, jnp.zeros(len(independent_columns(system)), psi.dtype))
