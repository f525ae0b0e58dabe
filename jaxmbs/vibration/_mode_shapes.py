"""Mode shapes: participation factors, effective masses, modal assurance criterion, tracking."""

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..checks import require_numbers, require_reals
from ..math._eigen import same
from ..runtime import lapack
from ..typing import AnyArray
from ._modes import Modes


def mode_ratios(modes: Modes, coordinate: int = 0) -> Float[Array, "n m"]:
    """Mode shapes (n, m) scaled to 1 at one coordinate; a mode with a node there becomes zero.

    For display only: mass-normalised shapes have no such exceptions.

    Raises: ValueError for a coordinate that does not exist.  Source: S1 (38).
    """
    if not 0 <= coordinate < len(modes.shapes):
        raise ValueError(f"coordinate {coordinate} must be one of 0 ... {len(modes.shapes) - 1}")
    at = modes.shapes[coordinate]
    node = jnp.abs(at) <= 1e3 * jnp.finfo(at.dtype).eps * jnp.max(jnp.abs(modes.shapes), axis=0)
    return jnp.where(node[None, :], 0.0, modes.shapes / jnp.where(node, 1.0, at)[None, :])


def participation(modes: Modes, M: AnyArray, rigid: AnyArray) -> Float[Array, "m directions"]:
    """Participation factors `shapes^T M rigid` (m, directions) of the modes in rigid motions (n, directions)."""
    require_numbers(M=M, rigid=rigid)
    return modes.shapes.T @ M @ rigid


def effective_masses(modes: Modes, M: AnyArray, rigid: AnyArray) -> Float[Array, "m directions"]:
    """Effective modal masses (m, directions) [kg, kg m^2]; over all modes they sum to `diag(rigid^T M rigid)`."""
    return participation(modes, M, rigid) ** 2


def mac(first: AnyArray, second: AnyArray, M: AnyArray | None = None) -> Float[Array, "m k"]:
    """Modal assurance criterion (m, k) of shapes (n, m) and (n, k): squared cosines, in the metric M (n, n)."""
    require_numbers(first=first, second=second)
    require_reals(M)
    conj = jnp.conj(first)
    other = second if M is None else M.astype(second.dtype) @ second
    own = first if M is None else M.astype(first.dtype) @ first
    sizes = jnp.sum(conj * own, axis=0).real[:, None] * jnp.sum(jnp.conj(second) * other, axis=0).real[None, :]
    return jnp.abs(conj.T @ other) ** 2 / sizes


def track_modes(reference: Modes, modes: Modes, M: AnyArray | None = None) -> Modes:
    """Modes in the order and with the signs of reference modes, paired by `mac`, best pairs first.

    Two modes whose frequencies cross keep their places.  Modes of equal frequency, whose vectors are any basis of
    their space, are rotated among themselves to lie as near to the reference as possible.  Order, signs and rotations
    are constants to differentiation.

    Args: reference: modes of a nearby structure, as many or fewer.

    Raises: ValueError for a reference with more modes.
    """
    if reference.shapes.shape[1] > modes.shapes.shape[1]:
        raise ValueError(
            f"the reference has {reference.shapes.shape[1]} modes, more than the "
            f"{modes.shapes.shape[1]} to be ordered"
        )
    moved = modes.select(best_pairs(lax.stop_gradient(mac(reference.shapes, modes.shapes, M))))
    measured = moved.shapes if M is None else M @ moved.shapes
    alike = lax.stop_gradient(jnp.where(same(moved.values), measured.T @ reference.shapes, 0.0))
    least = jnp.finfo(alike.dtype).eps ** 0.5 * jnp.eye(
        len(alike), dtype=alike.dtype
    )  # modes the reference lacks stay
    U, _, V = lapack.svd(alike + least)  # group by group the nearest rotation, a sign for a single mode
    return eqx.tree_at(lambda m: m.shapes, moved, moved.shapes @ (U @ V))


def best_pairs(likeness):
    """Column paired with each row, the largest entries first (greedy assignment)."""

    def step(_, carry):
        left, order = carry
        row, column = jnp.unravel_index(jnp.argmax(left), left.shape)
        return left.at[row, :].set(-1.0).at[:, column].set(-1.0), order.at[row].set(column)

    rows = likeness.shape[0]
    return lax.fori_loop(0, rows, step, (likeness, jnp.zeros(rows, int)))[1]
