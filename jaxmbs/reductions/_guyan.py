"""Static condensation (Guyan) on the interface."""

from ..linear._condensation import interface_basis
from ..linear._system import LinearSystem
from ._base import AbstractReduction, Reduced, project, reduced_labels, symmetric_partition


class Guyan(AbstractReduction):
    """The component on its interface alone: exact in statics, stiff in motion.

    Coordinates: those of the interface [m, rad], in its order, with their signs.

    Raises: ValueError, if concrete, for unsymmetric matrices (under tracing these give NaN) and an interface that
    leaves the interior a mechanism.  Source: S1 (5)-(8).
    """

    def of(self, system: LinearSystem) -> Reduced:
        system = system.to_dense()
        *_, K, M = symmetric_partition(system)
        system = system.replace(stiffness=K, mass=M)
        return project(system, interface_basis(K, system.interface), reduced_labels(system))
