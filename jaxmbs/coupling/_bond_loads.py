"""Loads of the bonds of a network, by name."""

import dataclasses
from collections.abc import ItemsView

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Inexact

from ..checks import no_such
from ..elements import DIRECTIONS
from ..errors import UnknownNameError
from ..math import _square as square
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, failures


class BondLoad(Reported, eqx.Module):
    """Load of one bond, in its own axes if it has any; times are the first axes.

    Attributes:
        on_first: (..., k) load of the bond on its first end, along its directions.
        on_second: on its second end; the opposite of the first except for a bushing with mass.
        labels: the directions, or the numbers of the coordinates.
    """

    on_first: Inexact[Array, "... k"]
    on_second: Inexact[Array, "... k"]
    labels: tuple[str, ...] = eqx.field(static=True)

    def report(self) -> Report:
        directions = (Axis("direction", self.labels),)
        return Report(
            [
                Quantity("load on first", self.on_first, "N or N m", directions),
                Quantity("load on second", self.on_second, "N or N m", directions),
            ]
        )

    @property
    def force(self) -> Inexact[Array, "... 3"]:
        """Force (..., 3) [N] on the first end; zero in directions that the bond does not have."""
        return self._along(DIRECTIONS[:3])

    @property
    def moment(self) -> Inexact[Array, "... 3"]:
        """Moment (..., 3) [N m] on the first end; zero in directions that the bond does not have."""
        return self._along(DIRECTIONS[3:])

    def _along(self, directions):
        f = self.on_first
        columns = [
            f[..., self.labels.index(d)] if d in self.labels else jnp.zeros_like(f[..., 0]) for d in directions
        ]
        return jnp.stack(columns, axis=-1)


class BondLoads(Reported, eqx.Module):
    """Loads of the bonds, `loads["bolts"].force`.

    Attributes:
        bonds: by name.
        residual: () largest sum of the forces at a joint, relative to the largest force: zero by S1 (25).
        rounding: () bound of the residual by rounding alone: where soft components carry stiff ones, their forces
            are small differences of large ones.
    """

    bonds: dict[str, BondLoad]
    residual: Array
    rounding: Array | float = 0.0

    def report(self) -> Report:
        found = [Quantity("relative residual", self.residual)]
        for name, load in self.items():
            directions = (Axis("direction", load.labels),)
            found.append(Quantity(name, load.on_first, "N or N m", directions))
            found.append(Quantity(f"{name} on second", load.on_second, "N or N m", directions, in_table=False))
        return Report(
            found, f"{len(self.bonds)} bonds, loads on the first ends", failures(self.ok, "the loads do not balance")
        )

    @property
    def ok(self) -> Bool[Array, ""]:
        """True if the loads are finite and balance within rounding, or 1e-6 of the largest (1e-2 in single
        precision).

        Where rounding leaves less than two digits they are not accepted.
        """
        double = self.residual.dtype.itemsize > 4
        floor, most = (1e-6, 1e-2) if double else (1e-2, 0.1)
        return self.residual < jnp.clip(self.rounding, floor, most)

    def __getitem__(self, name: str) -> BondLoad:
        if name not in self.bonds:
            raise UnknownNameError(no_such("bond", name, self.bonds))
        return self.bonds[name]

    def __iter__(self):
        return iter(self.bonds)

    def items(self) -> ItemsView[str, BondLoad]:
        """Pairs (name, load)."""
        return self.bonds.items()


@dataclasses.dataclass(frozen=True, repr=False)
class Determinacy(Reported):
    """Static determinacy of the forces of bonds between rigid components; `str` of it is a table.

    Attributes:
        redundant: number of bonds that could be cut without a new rigid motion.
        free_motions: number of rigid motions that the bonds leave free.
        determinate: by bond and direction: True if the force does not depend on stiffness.
        labels: by bond, its directions.
    """

    redundant: int
    free_motions: int
    determinate: dict[str, tuple[bool, ...]]
    labels: dict[str, tuple[str, ...]]

    def report(self) -> Report:
        marks = [
            Quantity(f"{name} is determinate", np.asarray(known, bool), "", (Axis("direction", self.labels[name]),))
            for name, known in self.determinate.items()
        ]
        counts = {"redundant bonds": self.redundant, "free motions": self.free_motions}
        return Report([*(Quantity(name, count) for name, count in counts.items()), *marks])

    def __str__(self):
        lines = [f"{self.redundant} redundant bonds, {self.free_motions} free motions"]
        width = max((len(name) for name in self.determinate), default=0)
        for name, known in self.determinate.items():
            parts = [
                f"{kind} {' '.join(label for label, k in zip(self.labels[name], known, strict=True) if k is flag)}"
                for kind, flag in (("determinate", True), ("redundant", False))
                if flag in known
            ]
            lines.append(f"{name:<{width}}  {'; '.join(parts)}")
        return "\n".join(lines)


def bond_loads(bonds, ties: Array, residual: Array, rounding: Array) -> BondLoads:
    """Loads by bond from those of all ties (ties, ...), times last.

    Args: bonds: `(name, Ties)`.
    """
    f, at, found = jnp.moveaxis(ties, 0, -1), 0, {}
    opposite = -f
    for name, bond in bonds:
        last = at + sum(map(len, bond.pairs[:-1]))
        sides = _directions(f, at, bond), _directions(opposite, last, bond)
        at = last + len(bond.pairs[-1])
        found[name] = BondLoad(*sides, bond.labels)
    return BondLoads(found, residual, rounding)


def _directions(f, at, bond):
    """Loads (..., k) in all directions of a bond, zero in those that it leaves free, from those of its ties on.

    A dynamic slice: outside of a program it is compiled once for all bonds of one size.
    """
    f = lax.dynamic_slice_in_dim(f, at, len(bond.kept), axis=-1)
    if len(bond.kept) == len(bond.labels):
        return f
    return jnp.zeros((*f.shape[:-1], len(bond.labels)), f.dtype).at[..., np.array(bond.kept, int)].set(f)


def tie_loads(rows: np.ndarray | Array, forces: Array) -> Array:
    """Loads f of the ties from the forces r on the components, `B^T f = r`; ties form no ring, so B has full rank.

    Args: rows: B (ties, interface coordinates of all components); forces: r, times last.
    """
    if isinstance(rows, np.ndarray):
        solve = jnp.asarray(np.linalg.solve(rows @ rows.T, rows)).astype(forces.dtype)
    else:  # with lever arms of rigid bodies, which have derivatives
        solve = square.solve(rows @ rows.T, rows).astype(forces.dtype)
    return jnp.tensordot(solve, forces, axes=1)
