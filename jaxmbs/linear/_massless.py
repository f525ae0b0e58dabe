"""Static condensation of motions without mass, which is exact, and the expansion of results back to them."""

from collections.abc import Iterable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..blocksparse import BlockMatrix
from ..checks import any_concrete, is_concrete
from ..math import _square as square
from ..runtime import lapack
from ..typing import AnyArray
from ._condensation import interface_basis
from ._mass_rank import dependent_rows
from ._system import LinearSystem

#: Forces on motions without mass below this share of their terms count as zero: rounding of `C @ T`.
NEGLIGIBLE_DAMPING = 1e-9


class Condensation(eqx.Module):
    """A linear system condensed to its rows with mass ("heavy"), and the expansion `x = T x_heavy` to all rows.

    A mass beside its node leaves motions without mass that are no coordinates: turns about the mass.  They are the
    columns of L, `M L = 0`, one for each light row; the heavy rows then stand for `x_heavy - L_heavy x_light`.

    Attributes:
        heavy, light: rows with and without mass of their own (static).
        basis: T (n, heavy), None where all rows are heavy.
        stiffness: of the motions without mass (light, light), None where all rows are heavy.
        motions: L (n, light), None where they are the light rows themselves.
        system: the condensed system on the heavy rows.
        diagonal: energies (heavy,) that the diagonal of the whole stiffness stores in the columns of T, of whose size
            the rounding of the condensed stiffness is; None where all rows are heavy.
    """

    heavy: tuple[int, ...] = eqx.field(static=True)
    light: tuple[int, ...] = eqx.field(static=True)
    basis: Array | None
    stiffness: Array | None
    motions: Array | None
    system: LinearSystem
    diagonal: Array | None = None

    def load(self, forces: AnyArray) -> AnyArray:
        """Loads (..., heavy) that do the same work as forces (..., n)."""
        return forces if self.basis is None else forces @ self.basis.astype(forces.dtype)

    def light_load(self, forces: AnyArray) -> AnyArray:
        """Work (..., light) of forces (..., n) in the motions without mass."""
        if self.motions is None:
            return forces[..., np.array(self.light, int)]
        return forces @ self.motions.astype(forces.dtype)

    def in_light(self, A: AnyArray) -> AnyArray:
        """A matrix (n, n) in the motions without mass (light, light)."""
        return self.light_load(self.light_load(A).T).T

    def heavy_part(self, x: AnyArray) -> AnyArray:
        """The heavy part (..., heavy) of displacements (..., n)."""
        heavy = np.array(self.heavy, int)
        if self.motions is None:
            return x[..., heavy]
        return x[..., heavy] - x[..., np.array(self.light, int)] @ self.motions[heavy].T.astype(x.dtype)

    def expand(self, x: Array, forces: Array | None = None) -> Array:
        """Expand displacements (..., heavy), or their rates, to all rows (..., n).

        Args: forces: (..., n), whose work in motions without mass adds the static displacement there.
        """
        if self.basis is None:
            return x
        found = x @ self.basis.T.astype(x.dtype)
        if forces is None:
            return found
        moved = self.light_displacements(jnp.asarray(self.light_load(forces)))
        if self.motions is None:
            return found.at[..., np.array(self.light, int)].add(moved)
        return found + moved @ self.motions.T.astype(moved.dtype)

    def light_displacements(self, forces: Array) -> Array:
        """Static displacements (..., light) under forces (..., light), the heavy rows fixed."""
        if self.stiffness is None:
            return jnp.zeros_like(forces)
        flat = square.solve(self.stiffness.astype(forces.dtype), forces.reshape(-1, len(self.light)).T).T
        return flat.reshape(forces.shape)


def massless_rows(system: LinearSystem, among: Iterable[int] | None = None) -> tuple[int, ...]:
    """Rows without mass of their own: of a concrete mass matrix those that are zero, and those whose mass follows
    from that of others (in block matrices only zero ones); under tracing those declared as `massless`.

    Args: among: rows that may be so, default all.
    """
    rows = range(system.num_rows) if among is None else sorted(among)
    if not is_concrete(system.mass):
        return tuple(sorted((set(system.massless) & set(rows)) - _padded_rows(system)))
    if isinstance(system.mass, BlockMatrix):
        return tuple(k for k in _massless_block_rows(system) if k in set(rows))
    zero = ~np.any(np.asarray(system.mass), axis=1)
    return tuple(sorted({*(k for k in rows if zero[k]), *dependent_rows(system.mass, rows)}))


def _padded_rows(system):
    """Rows of block matrices that stand for no coordinate of a node."""
    if not isinstance(system.mass, BlockMatrix) or system.block_rows is not None:
        return set()
    return set(np.flatnonzero(system.mass.pattern.padding).tolist())


def _massless_block_rows(system):
    mass, (i, j) = system.mass, system.mass.pattern.edges.T
    upper = np.asarray(mass.upper)
    lower = upper.swapaxes(1, 2) if mass.lower is None else np.asarray(mass.lower)
    used = np.any(np.asarray(mass.diagonal), axis=2) | mass.pattern.padding
    for half, rows in ((upper, i), (lower, j)):
        np.logical_or.at(used, rows, np.any(half, axis=2))
    flat = used.reshape(-1) if system.block_rows is None else used.reshape(-1)[system.block_rows.places]
    return tuple(np.flatnonzero(~flat).tolist())


def condense_massless(system: LinearSystem, among: Iterable[int] | None = None, damped: bool = True) -> Condensation:
    """Condense the motions without mass of a dense linear system.

    Args:
        among: rows that may be condensed, by default all.
        damped: True if the result is used with damping, which must then not act on motions without mass.

    Raises: ValueError, if concrete, for motions that have neither mass nor stiffness, or damping of their own, by
    the names of their rows.
    """
    n = system.num_rows
    among = range(n) if among is None else tuple(among)
    light = massless_rows(system, among)
    heavy = tuple(k for k in range(n) if k not in set(light))
    if not light:
        return Condensation(heavy, (), None, None, None, system)
    if not heavy:
        raise ValueError(f"no coordinate has mass: {_row_names(system, light)}")
    L = _motions_without_mass(system.mass, [k for k in among if k not in set(light)], light)
    whole = system if L is None else _sheared(system, L, light)
    K, C = whole.stiffness, whole.damping
    rows, place = np.array(light), {k: i for i, k in enumerate(heavy)}
    _check_stiffness(system, K, light)
    T = interface_basis(K, heavy)
    if damped and C is not None:

        def acts_on_light(C, T):
            size = np.max(np.abs(C[rows]) @ np.abs(T), initial=1e-300)
            return np.abs(C[rows] @ T) > NEGLIGIBLE_DAMPING * size

        if any_concrete(acts_on_light, C, T):
            raise ValueError(
                f"rows without mass are damped: {_row_names(system, light)}.  Give them mass, or damping "
                "proportional to their stiffness, or leave the damping out by damped=False"
            )
    own = LinearSystem(
        mass=system.mass[np.ix_(heavy, heavy)],
        stiffness=T.T @ K @ T,
        damping=None if C is None else T.T @ C @ T,
        interface=[place[k] for k in system.interface if k in place],
        coordinates=[system.coordinates[k] for k in heavy],
        positions=None if system.positions is None else (system.nodes, system.positions),
        massless=[place[k] for k in system.massless if k in place],
    )
    if L is not None:
        T = T.at[rows].set(0.0) + L @ T[rows]
    diagonal = jnp.sum(jnp.abs(jnp.diagonal(system.stiffness))[:, None] * T**2, axis=0)
    return Condensation(heavy, light, T, K[np.ix_(rows, rows)], L, own, diagonal)


def _motions_without_mass(M, heavy, light):
    """L (n, light) with `M L = 0`, one in its own light row, the rest in heavy ones; None if there is none there."""
    heavy, light = np.array(heavy, int), np.array(light, int)
    if not len(heavy) or not _couple(M, heavy, light):
        return None
    M = jnp.asarray(M)
    arms = lapack.solve_positive(M[np.ix_(heavy, heavy)], M[np.ix_(heavy, light)])
    L = jnp.zeros((len(M), len(light)), M.dtype).at[light, np.arange(len(light))].set(1.0)
    return L.at[heavy].set(-arms)


def _couple(M, heavy, light) -> bool:
    """True if rows couple, or if the matrix is traced."""
    return not is_concrete(M) or bool(np.any(np.asarray(M)[np.ix_(heavy, light)]))


def _sheared(system, L, light):
    """The system with the motions L in the place of its light rows, their mass zero."""
    rows = np.array(light)

    def change(A):
        A = A.at[:, rows].set(A @ L)
        return A.at[rows].set(L.T @ A)

    K, C = (None if A is None else change(jnp.asarray(A)) for A in (system.stiffness, system.damping))
    return system.replace(stiffness=K, damping=C)


def _check_stiffness(system, stiffness, light):
    """Refuse motions without mass that are free while the heavy rows are fixed.  Raises: ValueError with names."""
    if not is_concrete(stiffness):
        return
    K = np.asarray(stiffness)[np.ix_(light, light)]
    size = np.sqrt(np.maximum(np.abs(np.diagonal(K)), 1e-300))
    values, shapes = np.linalg.eigh((K + K.T) / 2 / np.outer(size, size))
    loose = values < 1e-12 * max(1.0, values[-1])
    if np.any(loose):
        moved = np.max(np.abs(shapes[:, loose]), axis=1) > 1e-3
        names = _row_names(system, [k for k, m in zip(light, moved, strict=True) if m])
        raise ValueError(
            f"{names} have neither mass nor stiffness: fix these coordinates, leave them out or give them mass"
        )


def _row_names(system, rows, most=6):
    """Names of the first rows, and the number of the others."""
    listed = ", ".join(system.label(k) for k in rows[:most])
    return listed + (f" and {len(rows) - most} more" if len(rows) > most else "")
