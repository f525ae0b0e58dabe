"""Mixed reduction: modes with part of the interface fixed, part free and optionally loaded by mass."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..elements._base import as_optional_real
from ..linear._condensation import check_nonsingular
from ..linear._system import LinearSystem
from ..math import _square as square
from ..vibration._modes import stable_modes
from ._base import AbstractReduction, Reduced, check_num_modes, project, reduced_labels, symmetric_partition


class Mixed(AbstractReduction):
    """Mixed reduction: interface displacements, and modes with `fixed` coordinates fixed and the others free.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, whose scale and signs are arbitrary.

    With the whole interface fixed the space is that of Craig and Bampton, with none of it fixed that of Rubin.

    Attributes:
        num_modes: number of modes, the rigid ones included; it should not cut a group of equal frequencies.
        fixed: names or numbers of the fixed interface coordinates; choose those where the neighbour is stiff or
            heavy.
        load: (c, c) mass on the free interface coordinates while the modes are found ("loaded interface").
        num_rigid: number of rigid motions with `fixed` fixed; by default counted, which is not possible under
            tracing.

    Raises: ValueError, if concrete, for unsymmetric matrices and negative stiffness; under tracing these give NaN.
    Source: S1 (4)-(8).
    """

    num_modes: int = eqx.field(static=True)
    fixed: tuple = eqx.field(static=True, default=())
    load: Float[Array, "c c"] | None = eqx.field(converter=as_optional_real, default=None)
    num_rigid: int | None = eqx.field(static=True, default=None)

    def of(self, system: LinearSystem) -> Reduced:
        system = system.to_dense()
        inner, outer, stiffness, mass = symmetric_partition(system)
        system = system.replace(stiffness=stiffness, mass=mass)
        held = np.asarray(system.rows(*self.fixed), int)
        if not np.all(np.isin(held, outer)):
            stray = ", ".join(system.label(i) for i in np.setdiff1d(held, outer))
            raise ValueError(f"fixed coordinates {stray} are not in the interface")
        loose = outer[~np.isin(outer, held)]
        rest = np.concatenate([loose, inner])
        K, M = stiffness[rest][:, rest], mass[rest][:, rest]
        if self.load is not None:
            M = M.at[: len(loose), : len(loose)].add(self.load)
        rigid = count_rigid(K, M) if self.num_rigid is None else self.num_rigid
        check_num_modes(self.num_modes, len(inner))
        if self.num_modes < rigid:
            raise ValueError(f"num_modes = {self.num_modes} must be at least {rigid}: all rigid motions must be kept")
        modes = stable_modes(K=K, M=M, num=self.num_modes, num_rigid=rigid).shapes
        loads = jnp.eye(len(rest), dtype=K.dtype)[:, : len(loose)]
        loads = jnp.concatenate([loads, -stiffness[rest][:, held]], axis=1)
        static = attachment_modes(K, M, loads, modes[:, :rigid])
        moved, shapes = make_interface_explicit(static[:, : len(loose)], (static[:, len(loose) :], modes), len(loose))
        basis = _assemble_basis(len(stiffness), outer, held, rest, moved, *shapes)
        return project(system, basis, reduced_labels(system, rigid=rigid, normal=self.num_modes - rigid))


def _assemble_basis(n, outer, held, rest, moved, at_held, modes):
    """Basis (n, b + modes): columns of the interface in its order, then the modes."""
    b, fixed = len(outer), np.array([int(np.flatnonzero(outer == c)[0]) for c in held], int)
    loose = np.flatnonzero(~np.isin(outer, held))
    basis = jnp.zeros((n, b + modes.shape[1]), moved.dtype)
    basis = basis.at[np.ix_(rest, loose)].set(moved).at[np.ix_(rest, fixed)].set(at_held).at[held, fixed].set(1.0)
    return basis.at[np.ix_(rest, b + np.arange(modes.shape[1]))].set(modes)


def attachment_modes(stiffness, mass, loads, rigid):
    """Attachment modes: static displacements (n, c) under loads (n, c), by inertia relief where rigid motions are
    free.

    With rigid motions (n, d) the inertia of the motion that they cause balances the loads, and the displacements
    contain no rigid motion: `rigid^T M x = 0`.
    """
    n, d = rigid.shape
    carried = mass @ rigid
    saddle = jnp.block([[stiffness, carried], [carried.T, jnp.zeros((d, d), stiffness.dtype)]])
    solution = square.solve(saddle, jnp.concatenate([loads, jnp.zeros((d, loads.shape[1]), loads.dtype)]))[:n]
    check_nonsingular(solution, "the fixed interface")
    return solution


def make_interface_explicit(attachment, others, c):
    """Combine attachment modes and other columns so that their first c rows become the identity and zero."""
    moved = square.solve(attachment[:c].T, attachment.T).T
    return moved, [shapes - moved @ shapes[:c] for shapes in others]


def count_rigid(stiffness, mass) -> int:
    """Number of rigid motions, on the host.  Raises: ValueError under tracing, and for negative stiffness."""
    if not is_concrete(stiffness, mass):
        raise ValueError("rigid motions cannot be counted under tracing: give num_rigid")
    with jax.ensure_compile_time_eval():
        return stable_modes(K=stiffness, M=mass).num_rigid
