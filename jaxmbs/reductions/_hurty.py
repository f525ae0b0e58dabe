"""Rigid, constraint and normal modes (Hurty 1965): statically determinate and redundant bonds apart."""

from collections.abc import Iterable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.linalg
from jaxtyping import Array, Float

from ..checks import distinct_names, is_concrete
from ..linear._condensation import constraint_modes, interface_basis, partition
from ..linear._system import LinearSystem
from ..typing import CoordinateLike
from ._base import AbstractReduction, Reduced
from ._craig_bampton import CraigBampton
from ._virtual_work import VirtualMotions


def determinate_coordinates(system: LinearSystem) -> tuple[int, ...]:
    """Interface coordinates that support the component statically determinately, chosen for best conditioning.

    There are as many as rigid motions.  On the host, once for each topology.

    Raises: ValueError under tracing, for negative stiffness, and where the interface cannot support the component.
    """
    if not is_concrete(system.stiffness):
        raise ValueError("the determinate coordinates cannot be chosen under tracing: give them")
    K = np.asarray(system.stiffness)
    _, outer = partition(len(K), system.interface)
    size = np.sqrt(np.maximum(np.abs(np.diagonal(K)), 1e-300))
    values, vectors = np.linalg.eigh(K / np.outer(size, size))
    limit = 200 * np.finfo(K.dtype).eps * np.max(np.abs(values), initial=0.0)  # `rigid_flags.NEGATIVE` roundings
    if np.any(values < -limit):
        raise ValueError(f"the stiffness is negative: an eigenvalue is {np.min(values):.3g} of the diagonal")
    rigid = (vectors / size[:, None])[:, values <= limit]
    if rigid.shape[1] == 0:
        return ()
    rows = rigid[outer] * size[outer, None]
    _, R, order = scipy.linalg.qr(rows.T, pivoting=True, mode="economic")
    if len(outer) < rigid.shape[1] or abs(R[rigid.shape[1] - 1, rigid.shape[1] - 1]) < 1e-8 * abs(R[0, 0]):
        raise ValueError(f"the interface coordinates cannot support all of the {rigid.shape[1]} rigid motions")
    return tuple(int(c) for c in outer[np.sort(order[: rigid.shape[1]])])


class Hurty(AbstractReduction):
    """Hurty reduction: rigid motions, constraint modes of redundant bonds, fixed-interface modes.

    Coordinates: those of the interface [m, rad], in its order, then the amplitudes "normal 0", "normal 1", ... of the
    modes, each scaled to unit modal mass; signs of modes are arbitrary.

    The space is that of Craig and Bampton, and so are the matrices with the interface displacements as coordinates;
    `connection` gives these from the rigid and constraint motions.

    Attributes:
        num_modes: number of fixed-interface modes kept.
        determinate: names or numbers of interface coordinates that support the component statically determinately;
            default `determinate_coordinates`.

    Raises: ValueError for a determinate coordinate outside the interface and, if concrete, for ones that do not
    support the component.  Source: S1 (14)-(20).
    """

    num_modes: int = eqx.field(static=True)
    determinate: tuple | None = eqx.field(static=True, default=None)

    def of(self, system: LinearSystem) -> Reduced:
        self.connection(system)
        return CraigBampton(self.num_modes).of(system.to_dense())

    def connection(self, system: LinearSystem) -> Float[Array, "b b"]:
        """Matrix `phi = [[RR 0], [CR CC]]` (b, b) of interface displacements `u = phi (rigid, constraint)`.

        Rows are in the order of the interface.  RR = CC = 1, and CR is the rigid motion at the redundant bonds, which
        strains nothing.  Source: S1 (14), (20).
        """
        system = system.to_dense()
        rigid, outer = determinate_rows(system, self.determinate), system.interface
        redundant = tuple(c for c in outer if c not in rigid)
        d, b = len(rigid), len(outer)
        inner, _ = partition(system.num_rows, rigid)
        CR = constraint_modes(system.stiffness, rigid, "the determinate coordinates")
        CR = CR[np.searchsorted(inner, np.array(redundant, int))]
        phi = jnp.eye(b, dtype=CR.dtype).at[d:, :d].set(CR)
        order = (*rigid, *redundant)
        return phi[np.array([order.index(c) for c in outer], int)]

    def motions(self, system: LinearSystem) -> VirtualMotions:
        """Rigid, constraint and normal motions of all coordinates, as `VirtualMotions`.  Source: S1 (14)-(20)."""
        system = system.to_dense()
        b, d = system.num_interface, len(determinate_rows(system, self.determinate))
        basis = CraigBampton(self.num_modes).of(system).basis
        shapes = jnp.concatenate([basis[:, :b] @ self.connection(system), basis[:, b:]], axis=1)
        return VirtualMotions(shapes, (d, b - d, self.num_modes), system.interface)


def determinate_rows(system: LinearSystem, determinate: Iterable[CoordinateLike] | None) -> tuple[int, ...]:
    """Rows of the determinate coordinates: the given ones, or `determinate_coordinates`.  Raises: ValueError."""
    if determinate is None:
        return determinate_coordinates(system)
    rows = system.rows(*distinct_names("determinate", determinate))
    stray = [system.label(i) for i in rows if i not in system.interface]
    if stray:
        raise ValueError(f"determinate coordinates {', '.join(stray)} are not in the interface")
    return rows


def support_motions(system: LinearSystem, determinate: Iterable[CoordinateLike]) -> Float[Array, "n d"]:
    """Rigid motions (n, d) of a free component, each for a unit displacement of one determinate coordinate.

    Source: S1 (14).
    """
    return interface_basis(system.stiffness, system.rows(*distinct_names("determinate", determinate)))
