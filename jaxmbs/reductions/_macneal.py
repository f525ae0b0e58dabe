"""MacNeal reduction: free-interface modes with residual flexibility, whose mass is neglected (MacNeal 1971)."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..linear._system import LinearSystem
from ..math import _square as square
from ..vibration._modes import stable_modes
from ._base import AbstractReduction, Reduced, check_num_modes, project, reduced_labels, symmetric_partition
from ._mixed import attachment_modes, count_rigid, make_interface_explicit


class MacNeal(AbstractReduction):
    """MacNeal reduction: interface displacements and the lowest free modes; only the modes have mass and damping.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, each scaled to unit modal mass; signs of modes are arbitrary.

    The interface coordinates are `massless`: where no neighbour gives them mass, `modes` condenses them.
    Frequencies may be too low or too high.

    Attributes:
        num_modes: number of free modes kept, the rigid ones included.
        num_rigid: number of rigid motions; by default counted, which is not possible under tracing.

    Raises: ValueError, if concrete, for unsymmetric matrices and negative stiffness; under tracing these give NaN.
    Source: S1 (4)-(8).
    """

    num_modes: int = eqx.field(static=True)
    num_rigid: int | None = eqx.field(static=True, default=None)

    def of(self, system: LinearSystem) -> Reduced:
        system, num = system.to_dense(), self.num_modes
        inner, outer, K, M = symmetric_partition(system)
        system = system.replace(stiffness=K, mass=M)
        rigid = count_rigid(K, M) if self.num_rigid is None else self.num_rigid
        check_num_modes(num, len(inner))
        b, modes = len(outer), stable_modes(K=K, M=M, num=num, num_rigid=rigid)
        loads = jnp.eye(len(K), dtype=K.dtype)[:, outer]
        elastic = modes.shapes[:, rigid:]
        residual = attachment_modes(K, M, loads, modes.shapes[:, :rigid])
        own = elastic.T @ K @ elastic  # diagonal; its derivatives see how a group of equal values splits
        residual = residual - elastic @ square.solve(own, elastic.T @ loads)
        order = np.concatenate([outer, inner])
        moved, (shapes,) = make_interface_explicit(residual[order], (modes.shapes[order],), b)
        basis = jnp.zeros((len(order), b + num), moved.dtype)
        basis = basis.at[order].set(jnp.concatenate([moved, shapes], axis=1))
        labels = reduced_labels(system, rigid=rigid, normal=num - rigid)
        whole = project(system, basis, labels, massless=range(b))

        def of_modes(A):
            return jnp.zeros_like(whole.mass).at[b:, b:].set(modes.shapes.T @ A @ modes.shapes)

        return whole.replace(mass=of_modes(M), damping=None if system.damping is None else of_modes(system.damping))
