"""Free modes with inertia-relief attachment modes, from a statically determinate support (Craig and Chang 1977)."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp

from ..linear._condensation import interface_basis, partition
from ..linear._system import LinearSystem
from ..math import _square as square
from ..vibration._modes import stable_modes
from ._base import AbstractReduction, Reduced, check_num_modes, project, reduced_labels, symmetric_partition
from ._hurty import determinate_rows
from ._mixed import make_interface_explicit


class CraigChang(AbstractReduction):
    """Craig-Chang reduction: interface displacements, rigid motions and the lowest elastic free modes.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, whose scale and signs are arbitrary.

    The space is that of `Rubin`, but rigid modes need not be distinguished from elastic ones by their frequency.

    Attributes:
        num_modes: number of elastic modes kept, without the rigid ones.
        determinate: names or numbers of interface coordinates that support the component statically determinately;
            default `determinate_coordinates`.

    Raises: as `Hurty`.  Source: S1 (4)-(8).
    """

    num_modes: int = eqx.field(static=True)
    determinate: tuple | None = eqx.field(static=True, default=None)

    def of(self, system: LinearSystem) -> Reduced:
        system = system.to_dense()
        inner, outer, K, M = symmetric_partition(system)
        system = system.replace(stiffness=K, mass=M)
        held = determinate_rows(system, self.determinate)
        n, b, d = len(K), len(outer), len(held)
        check_num_modes(self.num_modes + d, len(inner))
        rigid = interface_basis(K, held)
        loads = jnp.eye(n, dtype=K.dtype)[:, outer]
        attachment = inertia_relief(K, M, loads, held, rigid)
        elastic = stable_modes(K=K, M=M, num=self.num_modes + d, num_rigid=d).shapes[:, d:]
        order = jnp.concatenate([outer, inner])
        columns = [A[order] for A in (attachment, jnp.concatenate([rigid, elastic], axis=1))]
        moved, (shapes,) = make_interface_explicit(columns[0], columns[1:], b)
        basis = jnp.zeros((n, b + d + self.num_modes), moved.dtype)
        basis = basis.at[order].set(jnp.concatenate([moved, shapes], axis=1))
        return project(system, basis, reduced_labels(system, rigid=d, normal=self.num_modes))


def inertia_relief(stiffness, mass, loads, determinate: Sequence[int], rigid):
    """Elastic displacements (n, c) of a free component under loads (n, c) that its own inertia balances.

    The component is supported at `determinate`, whose reactions vanish; the result satisfies `rigid^T M x = 0`.
    """
    inertia = rigid.T @ mass @ rigid

    def without_rigid(x):
        return x - rigid @ square.solve(inertia, rigid.T @ (mass @ x)) if len(determinate) else x

    def balanced(f):
        return f - mass @ (rigid @ square.solve(inertia, rigid.T @ f)) if len(determinate) else f

    inner, _ = partition(stiffness.shape[0], determinate)
    x = square.solve(stiffness[inner][:, inner], balanced(loads)[inner])
    return without_rigid(jnp.zeros_like(loads).at[inner].set(x))
