"""Characteristic constraint modes: few coordinates for a fine interface (Castanier, Tan and Pierre 2001)."""

import equinox as eqx
import jax
import jax.numpy as jnp

from ..linear._system import LinearSystem
from ..vibration._modes import Modes, stable_modes
from ._base import AbstractReduction, Reduced, check_num_modes, interface_first, numbered_labels, project


def characteristic_modes(system: LinearSystem, num: int) -> Modes:
    """The lowest modes of the interface coordinates alone, of a component or of an assembled structure.

    Raises: ValueError for negative stiffness, if concrete; under tracing that gives NaN.
    """
    check_num_modes(num, system.num_interface)
    at = jnp.array(system.interface, int)
    K, M = (A[at][:, at] for A in (system.stiffness, system.mass))
    return stable_modes(K=K, M=M, num=num)


class Characteristic(AbstractReduction):
    """The interface moving in its characteristic modes only; their amplitudes are what couples now.

    Coordinates: amplitudes "characteristic 0", ... of the modes, lowest first, whose signs are free, then all others
    of the component as they were [m, rad].

    All of them change nothing.  Components that meet must share one set: reduce after coupling, or carry the
    modes of one over.

    Attributes:
        num_modes: of the interface.

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
