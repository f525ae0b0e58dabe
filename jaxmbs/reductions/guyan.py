"""Static condensation (Guyan) and the constraint modes that most reductions share."""

from collections.abc import Sequence

import jax.numpy as jnp

from ..linear.condensation import interface_basis
from .base import Reduced, admitted, numbered, project


def guyan(stiffness, mass, interface: Sequence[int], damping=None) -> Reduced:
    """The component on its interface alone: exact in statics, stiff in motion.

    Raises: ValueError for matrices of different shapes and, if concrete, unsymmetric ones (under tracing these give
    NaN) and an interface that leaves the interior a mechanism.  Source: S1 (5)-(8).
    """
    *_, stiffness, mass = admitted(interface, stiffness, mass, damping)
    T = interface_basis(stiffness, interface)
    b = len(interface)
    return project(T, stiffness, mass, damping, jnp.eye(b, dtype=T.dtype), numbered("interface", b))
