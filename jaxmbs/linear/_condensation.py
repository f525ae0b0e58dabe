"""Static condensation on an interface: constraint modes, and the coupling modes made of them."""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..runtime import jit, lapack
from ..typing import AnyArray, RowsLike


def partition(size: int, interface: RowsLike) -> tuple[np.ndarray, np.ndarray]:
    """Split coordinates 0 ... size - 1 into interior and interface rows.

    Returns: (interior, interface), arrays of row numbers, the interior ascending, the interface in the given order.

    Raises: ValueError for a coordinate that does not exist or is given twice.  Source: S1 (4).
    """
    outer = np.asarray(interface, int).reshape(-1)
    if len(set(outer.tolist())) < len(outer) or np.any((outer < 0) | (outer >= size)):
        raise ValueError(f"interface {outer.tolist()} must consist of distinct coordinates among 0 ... {size - 1}")
    return np.setdiff1d(np.arange(size), outer), outer


def constraint_modes(stiffness: AnyArray, interface: RowsLike, what: str = "the interface") -> Float[Array, "i b"]:
    """Constraint modes `S = -K_NN^-1 K_Ni` (interior, interface): static motion for unit interface displacements.

    Args:
        stiffness: (n, n).
        interface: rows of the interface; S has its columns in this order.
        what: the name of the interface in messages.

    Raises: ValueError for a matrix that is not square and, if concrete, where the interior is a mechanism while the
    interface is fixed.
    Source: S1 (5)-(6).
    """
    if stiffness.ndim != 2 or stiffness.shape[0] != stiffness.shape[1]:
        raise ValueError(f"the stiffness must be square, not of shape {tuple(stiffness.shape)}")
    S, pivots = _solve_constraint_modes(stiffness, *partition(stiffness.shape[0], interface))
    check_nonsingular(S, what, pivots)
    return S


@jit
def _solve_constraint_modes(stiffness, inner, outer):
    """Constraint modes, and the squared Cholesky pivots of the interior relative to its diagonal."""
    K_NN = stiffness[inner][:, inner]
    K = (K_NN + K_NN.T) / 2
    L = lapack.cholesky(lax.stop_gradient(K))
    S = -lapack.solve_positive(K, stiffness[inner][:, outer], L)
    return S, jnp.diagonal(L) ** 2 / jnp.diagonal(K_NN)


def interface_basis(stiffness: AnyArray, interface: RowsLike) -> Float[Array, "n b"]:
    """Coupling modes `T = [S; 1]` (n, interface): constraint modes with rows in the component's own order.

    Source: S1 (7)-(8).
    """
    return _stack_interface(constraint_modes(stiffness, interface), *partition(stiffness.shape[0], interface))


@jit
def _stack_interface(S, inner, outer):
    T = jnp.zeros((len(inner) + len(outer), len(outer)), S.dtype)
    return T.at[outer].set(jnp.eye(len(outer), dtype=T.dtype)).at[inner].set(S)


def check_nonsingular(solution, what: str, pivots=None) -> None:
    """Refuse a static solution of a singular stiffness, if concrete.

    Args: pivots: squared pivots of the Cholesky factor relative to the diagonal; where the matrix is singular, the
        last one is rounding: 30 units of it are taken for zero.

    Raises: ValueError.
    """
    if not is_concrete(solution):
        return
    singular = not np.all(np.isfinite(np.asarray(solution)))
    if pivots is not None and np.size(pivots):
        singular = singular or np.min(np.asarray(pivots)) < 30 * np.finfo(pivots.dtype).eps
    if singular:
        raise ValueError(
            f"the stiffness is singular with {what} fixed: there is a mechanism inside, or a free rigid motion"
        )
