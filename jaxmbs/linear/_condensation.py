"""Static condensation on an interface: constraint modes, and the coupling modes made of them."""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..runtime import jit, lapack
from ..typing import AnyArray, RowsLike


def partition(size: int, interface: RowsLike) -> tuple[np.ndarray, np.ndarray]:
    """Interior and interface coordinates, S1 (4).

    Raises: ValueError for a coordinate that is not there or named twice.
    """
    outer = np.asarray(interface, int).reshape(-1)
    if len(set(outer.tolist())) < len(outer) or np.any((outer < 0) | (outer >= size)):
        raise ValueError(f"interface {outer.tolist()} must be different coordinates of 0 ... {size - 1}")
    return np.setdiff1d(np.arange(size), outer), outer


def constraint_modes(stiffness: AnyArray, interface: RowsLike, what: str = "the interface") -> Float[Array, "i b"]:
    """`S = -K_NN^-1 K_Ni` (interior, interface): the interior's static motion with each interface coordinate.

    Raises: ValueError for a matrix that is not square and, if concrete, where the held interface leaves the interior
    a mechanism; `what` it calls it.
    Source: S1 (5)-(6).
    """
    if stiffness.ndim != 2 or stiffness.shape[0] != stiffness.shape[1]:
        raise ValueError(f"the stiffness must be square, not of shape {tuple(stiffness.shape)}")
    S, pivots = _solve_constraint_modes(stiffness, *partition(stiffness.shape[0], interface))
    check_nonsingular(S, what, pivots)
    return S


@jit
def _solve_constraint_modes(stiffness, inner, outer):
    """The constraint modes, and the squared pivots of the interior over its diagonal."""
    K_NN = stiffness[inner][:, inner]
    K = (K_NN + K_NN.T) / 2
    L = lapack.cholesky(lax.stop_gradient(K))
    S = -lapack.solve_positive(K, stiffness[inner][:, outer], L)
    return S, jnp.diagonal(L) ** 2 / jnp.diagonal(K_NN)


def interface_basis(stiffness: AnyArray, interface: RowsLike) -> Float[Array, "n b"]:
    """The coupling modes `T = [S; 1]` (n, interface), rows in the component's own order.  Source: S1 (7)-(8)."""
    return _stack_interface(constraint_modes(stiffness, interface), *partition(stiffness.shape[0], interface))


@jit
def _stack_interface(S, inner, outer):
    T = jnp.zeros((len(inner) + len(outer), len(outer)), S.dtype)
    return T.at[outer].set(jnp.eye(len(outer), dtype=T.dtype)).at[inner].set(S)


def check_nonsingular(solution, what: str, pivots=None) -> None:
    """Raises: ValueError for a static solution, if concrete, of a singular stiffness: a mechanism is left.

    Args: pivots: squared pivots of the Cholesky factor over the diagonal: rounding, where the matrix is singular.
    """
    if not is_concrete(solution):
        return
    singular = not np.all(np.isfinite(np.asarray(solution)))
    if pivots is not None and np.size(pivots):
        singular = singular or np.min(np.asarray(pivots)) < 30 * np.finfo(pivots.dtype).eps
    if singular:
        raise ValueError(f"the stiffness is singular with {what} held: a mechanism inside, or rigid motions left")
