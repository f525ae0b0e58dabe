"""Constraint modes and fixed-interface modes (Craig and Bampton 1968)."""

from collections.abc import Sequence

import jax.numpy as jnp

from ..linear.condensation import interface_basis, partition
from ..linear.modes import Modes, natural_modes
from .base import Reduced, admitted, check_num_modes, numbered, project


def fixed_interface_modes(stiffness, mass, interface: Sequence[int], num_modes: int) -> Modes:
    """The lowest modes of the interior with the interface held, shapes (interior, num_modes)."""
    inner, _ = partition(stiffness.shape[0], interface)
    check_num_modes(num_modes, len(inner))
    return natural_modes(stiffness[inner][:, inner], mass[inner][:, inner], num_modes, num_rigid=0)


def craig_bampton(stiffness, mass, interface: Sequence[int], num_modes: int, damping=None) -> Reduced:
    """Interface displacements and the lowest fixed-interface modes, `x_N = S x_i + Phi_N q`.

    Stiffness is block diagonal between the two; frequencies come from above.  Beyond some thousand coordinates
    `large_craig_bampton` and `craig_bampton_sparse` do the same.

    Raises: ValueError for an interface that is all of the component, and as `guyan`.  Source: S1 (4)-(8).
    """
    inner, outer, stiffness, mass = admitted(interface, stiffness, mass, damping)
    if len(inner) == 0:
        raise ValueError("the interface is all of the component and leaves nothing to reduce: take `physical`")
    T = interface_basis(stiffness, interface)
    shapes = fixed_interface_modes(stiffness, mass, interface, num_modes).shapes
    normal = jnp.zeros((len(stiffness), num_modes), T.dtype).at[inner].set(shapes)
    basis = jnp.concatenate([T, normal], axis=1)
    labels = numbered("interface", len(outer)) + numbered("normal", num_modes)
    return project(basis, stiffness, mass, damping, basis[outer], labels)
