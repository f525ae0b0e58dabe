"""Modes with part of the interface held, part free and perhaps loaded by mass; attachment modes for the free part."""

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
    """Interface displacements, and modes with `fixed` held and the rest of the interface free.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, of a scale of their own; signs of modes are free.

    All of the interface fixed gives Craig and Bampton's space, none of it Rubin's.

    Attributes:
        num_modes: how many, the rigid ones included; the number cuts no group of equal frequencies.
        fixed: names or numbers of the held coordinates of the interface; choose them where the neighbour is stiff or
            heavy.
        load: (c, c) mass that the free interface coordinates carry while the modes are found ("loaded interface").
        num_rigid: rigid motions left with `fixed` held; default: counted, which cannot be done under tracing.

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
            raise ValueError(f"num_modes = {self.num_modes}, of which {rigid} are rigid and must be kept")
        modes = stable_modes(K=K, M=M, num=self.num_modes, num_rigid=rigid).shapes
        loads = jnp.eye(len(rest), dtype=K.dtype)[:, : len(loose)]
        loads = jnp.concatenate([loads, -stiffness[rest][:, held]], axis=1)
        static = attachment_modes(K, M, loads, modes[:, :rigid])
        moved, shapes = make_interface_explicit(static[:, : len(loose)], (static[:, len(loose) :], modes), len(loose))
        basis = _assemble_basis(len(stiffness), outer, held, rest, moved, *shapes)
        return project(system, basis, reduced_labels(system, rigid=rigid, normal=self.num_modes - rigid))


def _assemble_basis(n, outer, held, rest, moved, at_held, modes):
    """Columns of the interface in its order, loose and held ones as they come, then the modes."""
    b, fixed = len(outer), np.array([int(np.flatnonzero(outer == c)[0]) for c in held], int)
    loose = np.flatnonzero(~np.isin(outer, held))
    basis = jnp.zeros((n, b + modes.shape[1]), moved.dtype)
    basis = basis.at[np.ix_(rest, loose)].set(moved).at[np.ix_(rest, fixed)].set(at_held).at[held, fixed].set(1.0)
    return basis.at[np.ix_(rest, b + np.arange(modes.shape[1]))].set(modes)


def attachment_modes(stiffness, mass, loads, rigid):
    """Static displacements (n, c) under loads (n, c), free rigid motions by inertia relief.

    With rigid motions (n, d) the loads are balanced by the inertia of the motion they cause and the displacements
    are free of rigid motion: `rigid^T M x = 0`.
    """
    n, d = rigid.shape
    carried = mass @ rigid
    saddle = jnp.block([[stiffness, carried], [carried.T, jnp.zeros((d, d), stiffness.dtype)]])
    solution = square.solve(saddle, jnp.concatenate([loads, jnp.zeros((d, loads.shape[1]), loads.dtype)]))[:n]
    check_nonsingular(solution, "the fixed interface")
    return solution


def make_interface_explicit(attachment, others, c):
    """Columns of attachment modes and of others, combined so that the first c rows are the identity and zero."""
    moved = square.solve(attachment[:c].T, attachment.T).T
    return moved, [shapes - moved @ shapes[:c] for shapes in others]


def count_rigid(stiffness, mass) -> int:
    """The number of rigid motions, on the host.  Raises: ValueError under tracing, and for negative stiffness."""
    if not is_concrete(stiffness, mass):
        raise ValueError("give num_rigid: rigid motions cannot be counted under tracing")
    with jax.ensure_compile_time_eval():
        return stable_modes(K=stiffness, M=mass).num_rigid
