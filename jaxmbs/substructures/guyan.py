"""Static condensation (Guyan) and the constraint modes that most reductions share."""

from collections.abc import Sequence

import jax.numpy as jnp
from jax import lax

from ..math import lapack
from .base import Reduced, admitted, check_held, numbered, partition, project


def constraint_modes(stiffness, interface: Sequence[int], what: str = "the interface"):
    """`S = -K_NN^-1 K_Ni` (interior, interface): the interior's static motion with each interface coordinate.

    Raises: ValueError, if concrete, where the held interface leaves the interior a mechanism; `what` it calls it.
    Source: S1 (6).
    """
    inner, outer = partition(stiffness.shape[0], interface)
    K_NN = stiffness[inner][:, inner]
    K = (K_NN + K_NN.T) / 2
    L = lapack.cholesky(lax.stop_gradient(K))
    S = -lapack.solve_positive(K, stiffness[inner][:, outer], L)
    check_held(S, what, jnp.diagonal(L) ** 2 / jnp.diagonal(K_NN))
    return S


def interface_basis(stiffness, interface: Sequence[int]):
    """The coupling modes `T = [S; 1]` (n, interface), rows in the component's own order.  Source: S1 (8)."""
    inner, outer = partition(stiffness.shape[0], interface)
    T = jnp.zeros((stiffness.shape[0], len(outer)), stiffness.dtype)
    return T.at[outer].set(jnp.eye(len(outer), dtype=T.dtype)).at[inner].set(constraint_modes(stiffness, interface))


def guyan(stiffness, mass, interface: Sequence[int], damping=None) -> Reduced:
    """The component on its interface alone: exact in statics, stiff in motion.

    Raises: ValueError for matrices of different shapes and, if concrete, unsymmetric ones (under tracing these give
    NaN) and an interface that leaves the interior a mechanism.  Source: S1 (5)-(8).
    """
    *_, stiffness, mass = admitted(interface, stiffness, mass, damping)
    T = interface_basis(stiffness, interface)
    b = len(interface)
    return project(T, stiffness, mass, damping, jnp.eye(b, dtype=T.dtype), numbered("interface", b))
