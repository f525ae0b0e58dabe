"""Craig-Bampton reduction: constraint modes and fixed-interface modes (Craig and Bampton 1968)."""

import equinox as eqx
import jax.numpy as jnp
import scipy.sparse

from ..blocksparse import BlockMatrix
from ..linear._condensation import interface_basis, partition
from ..linear._system import LinearSystem
from ..vibration._modes import Modes, natural_modes
from ._base import AbstractReduction, Reduced, check_num_modes, project, reduced_labels, symmetric_partition
from ._craig_bampton_blocks import craig_bampton_blocks
from ._craig_bampton_scipy import craig_bampton_scipy


class CraigBampton(AbstractReduction):
    """Craig-Bampton reduction: interface displacements and lowest fixed-interface modes, `x_N = S x_i + Phi_N q`.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, each scaled to unit modal mass; signs of modes are arbitrary.

    The stiffness has no coupling between the two; frequencies are approximated from above.  The storage of the
    matrices determines the algorithm: dense arrays; block matrices for components whose dense ones would be too
    large, with derivatives of first order; SciPy sparse matrices on the host, once, without derivatives and without
    compilation.  The number of interface coordinates determines the cost of the last two: `rigid_node` reduces them
    to six.

    Attributes:
        num_modes: number of fixed-interface modes kept; they should not cut a group of equal frequencies.
        chunk: of block matrices, constraint modes solved together; memory beside the results grows with this.

    Raises: ValueError for more modes than there are and an interface that is the whole component; if concrete, for
    unsymmetric matrices (under tracing NaN) and a mechanism with the interface fixed (under tracing not finite).
    Source: S1 (4)-(8).
    """

    num_modes: int = eqx.field(static=True)
    chunk: int = eqx.field(static=True, default=64)

    def of(self, system: LinearSystem) -> Reduced:
        if isinstance(system.stiffness, BlockMatrix):
            return craig_bampton_blocks(system, self.num_modes, self.chunk)
        if scipy.sparse.issparse(system.stiffness):
            return craig_bampton_scipy(system, self.num_modes)
        inner, _, K, M = symmetric_partition(system)
        if len(inner) == 0:
            raise ValueError("the interface is the whole component, nothing is left to reduce: use Unreduced()")
        system = system.replace(stiffness=K, mass=M)
        T = interface_basis(K, system.interface)
        normal = jnp.zeros((len(K), self.num_modes), T.dtype)
        normal = normal.at[inner].set(fixed_interface_modes(system, self.num_modes).shapes)
        labels = reduced_labels(system, normal=self.num_modes)
        return project(system, jnp.concatenate([T, normal], axis=1), labels)


def fixed_interface_modes(system: LinearSystem, num_modes: int) -> Modes:
    """Lowest modes of the interior with the interface fixed; shapes are (interior, num_modes)."""
    system = system.to_dense()
    inner, _ = partition(system.num_rows, system.interface)
    check_num_modes(num_modes, len(inner))
    K, M = (A[inner][:, inner] for A in (system.stiffness, system.mass))
    return natural_modes(K=K, M=M, num=num_modes, num_rigid=0)
