"""Characteristic constraint modes: few coordinates for a fine interface (Castanier, Tan and Pierre 2001)."""

import equinox as eqx
import jax
import jax.numpy as jnp

from ..linear._system import LinearSystem
from ..vibration._modes import Modes, stable_modes
from ._base import AbstractReduction, Reduced, check_num_modes, interface_first, numbered_labels, project


def characteristic_modes(system: LinearSystem, num: int) -> Modes:
    """Lowest modes (num of them) of the interface partition of K and M, of a component or of a coupled structure.

    Raises: ValueError for negative stiffness, if concrete; under tracing that gives NaN.
    """
    check_num_modes(num, system.num_interface)
    at = jnp.array(system.interface, int)
    K, M = (A[at][:, at] for A in (system.stiffness, system.mass))
    return stable_modes(K=K, M=M, num=num)


class Characteristic(AbstractReduction):
    """Reduction of an interface to its characteristic modes, whose amplitudes become the interface coordinates.

    Coordinates: amplitudes "characteristic 0", ... of the modes, lowest first, with arbitrary signs, then all others
    of the component unchanged [m, rad].

    All modes together are exact.  Components that are joined must share one set of modes: reduce after coupling, or
    use the modes of one component for the other.

    Attributes:
        num_modes: number of interface modes.

    Source: S1 (9), (12).
    """

    keeps_all = True
    num_modes: int = eqx.field(static=True)

    def of(self, system: LinearSystem) -> Reduced:
        system, b = interface_first(system), system.num_interface
        shapes = characteristic_modes(system, self.num_modes).shapes
        E = jax.scipy.linalg.block_diag(shapes, jnp.eye(system.num_rows - b, dtype=shapes.dtype))
        labels = (*numbered_labels("characteristic", self.num_modes), *system.coordinates[b:])
        return project(system, E, labels, self.num_modes)
