"""Static condensation of rows without mass, which is exact, and the expansion of results back to them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..blocksparse import BlockMatrix
from ..checks import any_concrete, is_concrete
from ..math import _square as square
from ..typing import AnyArray
from ._condensation import interface_basis
from ._system import LinearSystem

#: Damping forces on rows without mass below this share of their terms count as zero: rounding of `C @ T`.
NEGLIGIBLE_DAMPING = 1e-9


class Condensation(eqx.Module):
    """A linear system condensed to its rows with mass ("heavy"), and the expansion `x = T x_heavy` to all rows.

    Attributes:
        heavy, light: rows with and without mass (static).
        basis: T (n, heavy), None where all rows are heavy.
        stiffness: stiffness of the light rows (light, light), None where all rows are heavy.
        system: the condensed system on the heavy rows.
    """

    heavy: tuple[int, ...] = eqx.field(static=True)
    light: tuple[int, ...] = eqx.field(static=True)
    basis: Array | None
    stiffness: Array | None
    system: LinearSystem

    def load(self, forces: AnyArray) -> AnyArray:
        """Loads (..., heavy) that do the same work as forces (..., n)."""
        return forces if self.basis is None else forces @ self.basis.astype(forces.dtype)

    def heavy_part(self, x: AnyArray) -> AnyArray:
        """The heavy part (..., heavy) of displacements (..., n)."""
        return x[..., np.array(self.heavy, int)]

    def expand(self, x: Array, forces: Array | None = None) -> Array:
        """Expand displacements (..., heavy), or their rates, to all rows (..., n).

        Args: forces: (..., n), whose part on light rows adds its static displacement there.
        """
        if self.basis is None:
            return x
        found, light = x @ self.basis.T.astype(x.dtype), np.array(self.light, int)
        return found if forces is None else found.at[..., light].add(self.light_displacements(forces[..., light]))

    def light_displacements(self, forces: Array) -> Array:
        """Static displacements (..., light) under forces (..., light) on light rows with the heavy rows fixed."""
        if self.stiffness is None:
            return jnp.zeros_like(forces)
        flat = square.solve(self.stiffness.astype(forces.dtype), forces.reshape(-1, len(self.light)).T).T
        return flat.reshape(forces.shape)


def massless_rows(system: LinearSystem) -> tuple[int, ...]:
    """Rows without mass: zero rows of a concrete mass matrix; under tracing those declared as `massless`."""
    if not is_concrete(system.mass):
        return tuple(sorted(system.massless))
    if isinstance(system.mass, BlockMatrix):
        return _massless_block_rows(system)
    return tuple(np.flatnonzero(~np.any(np.asarray(system.mass), axis=1)).tolist())


def _massless_block_rows(system):
    mass, (i, j) = system.mass, system.mass.pattern.edges.T
    upper = np.asarray(mass.upper)
    lower = upper.swapaxes(1, 2) if mass.lower is None else np.asarray(mass.lower)
    used = np.any(np.asarray(mass.diagonal), axis=2) | mass.pattern.padding
    for half, rows in ((upper, i), (lower, j)):
        np.logical_or.at(used, rows, np.any(half, axis=2))
    flat = used.reshape(-1) if system.block_rows is None else used.reshape(-1)[system.block_rows.places]
    return tuple(np.flatnonzero(~flat).tolist())


def condense_massless(system: LinearSystem, only: tuple[int, ...] | None = None, damped: bool = True) -> Condensation:
    """Condense a dense linear system to its rows with mass.

    Args:
        only: rows without mass to condense, by default all.
        damped: True if the result is used with damping, which must then not act on condensed rows.

    Raises: ValueError, if concrete, for rows that have neither mass nor stiffness, or damping of their own, by name.
    """
    light = massless_rows(system)
    light = light if only is None else tuple(k for k in light if k in only)
    n = system.num_rows
    heavy = tuple(k for k in range(n) if k not in set(light))
    if not light:
        return Condensation(heavy, (), None, None, system)
    if not heavy:
        raise ValueError(f"no coordinate has mass: {_row_names(system, light)}")
    K, M, C = system.stiffness, system.mass, system.damping
    rows, place = np.array(light), {k: i for i, k in enumerate(heavy)}
    _check_stiffness(system, light)
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
        mass=M[np.ix_(heavy, heavy)],
        stiffness=T.T @ K @ T,
        damping=None if C is None else T.T @ C @ T,
        interface=[place[k] for k in system.interface if k in place],
        coordinates=[system.coordinates[k] for k in heavy],
        positions=None if system.positions is None else (system.nodes, system.positions),
        massless=[place[k] for k in system.massless if k in place],
    )
    return Condensation(heavy, light, T, K[np.ix_(rows, rows)], own)


def _check_stiffness(system, light):
    """Refuse light rows that are free while the heavy rows are fixed.  Raises: ValueError with their names."""
    if not is_concrete(system.stiffness):
        return
    K = np.asarray(system.stiffness)[np.ix_(light, light)]
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
