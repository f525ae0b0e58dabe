"""Guyan reduction: static condensation to the interface."""

from ..linear._condensation import interface_basis
from ..linear._system import LinearSystem
from ._base import AbstractReduction, Reduced, project, reduced_labels, symmetric_partition


class Guyan(AbstractReduction):
    """Guyan reduction: the component condensed to its interface, exact in statics, too stiff in motion.

    Coordinates: those of the interface [m, rad], in its order, with their signs.

    Raises: ValueError, if concrete, for unsymmetric matrices (under tracing these give NaN) and where the interior is
    a mechanism with the interface fixed.  Source: S1 (5)-(8).
    """

    def of(self, system: LinearSystem) -> Reduced:
        system = system.to_dense()
        *_, K, M = symmetric_partition(system)
        system = system.replace(stiffness=K, mass=M)
        return project(system, interface_basis(K, system.interface), reduced_labels(system))
