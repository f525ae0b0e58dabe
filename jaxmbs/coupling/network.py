"""Components joined by named bonds: what each bond carries, whether it balances, and whether statics determine it."""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..errors import ModelError
from ..linear.modes import Modes
from ..reductions.base import explicit
from .bonds import Bond, resolved_in
from .dual import dual_response, self_stresses
from .primal import Assembly, Reactions, interface_reactions, join
from .ties import Ties, joint_numbers, ties


class BondForces(eqx.Module):
    """Forces of the bonds, by name; (k, ...) along a bond's directions, in its own axes if it has such.

    Attributes:
        on_first: force that the bond puts on its first end.
        on_second: on its second end; the opposite of the first but for a bushing with mass.
        residual: largest sum of the forces at a joint, relative to the largest: zero by S1 (25).
    """

    on_first: dict[str, Array]
    on_second: dict[str, Array]
    residual: Array


@dataclasses.dataclass(frozen=True)
class Determinacy:
    """Which forces of the bonds the equilibrium of rigid components determines; `str` of it is a table.

    Attributes:
        redundant: how many bonds could be cut and leave no new rigid motion.
        free_motions: how many rigid motions the bonds leave.
        determinate: by bond, by direction: whether its force is independent of stiffness.
        labels: by bond, its directions.
    """

    redundant: int
    free_motions: int
    determinate: dict[str, tuple[bool, ...]]
    labels: dict[str, tuple[str, ...]]

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


class Network(eqx.Module):
    """Components and bushings joined by bonds, as `connect` makes it.

    Attributes:
        assembly: mass, stiffness and damping over the joined coordinates xi; its components are those given, then the
            bushings, in the order of `names`.
    """

    assembly: Assembly
    names: tuple[str, ...] = eqx.field(static=True)
    bonds: tuple[tuple[str, Ties], ...] = eqx.field(static=True)
    joints: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    def load(self, forces: Mapping) -> Array:
        """`Q` (N, ...) of forces (n_c, ...) on components by name.  Source: S1 (18), (21)-(25)."""
        return self.assembly.load(self._ordered(forces))

    def modes(self, num: int | None = None) -> Modes:
        """Natural modes, shapes in xi.  Source: S1 (33)-(37)."""
        return self.assembly.modes(num)

    def expand(self, xi) -> dict:
        """Displacements of all coordinates of every component, by name."""
        return dict(zip(self.names, self.assembly.expand(xi), strict=True))

    def reactions(self, xi, xi_ddot=None, xi_dot=None, forces: Mapping | None = None) -> BondForces:
        """Forces of the bonds in a motion xi (N, ...); rates and forces as in `interface_reactions`, by name.

        Source: S1 (3), (19)-(25).
        """
        xi_ddot = jnp.zeros_like(xi) if xi_ddot is None else xi_ddot
        given = None if forces is None else self._ordered(forces)
        return self._by_bond(interface_reactions(self.assembly, xi, xi_ddot, xi_dot, given))

    def response(self, forces: Mapping, omega=None) -> tuple[dict, BondForces]:
        """Static or harmonic displacements (n_c,) by component, and the forces of the bonds: the dual assembly.

        Source: S1 (1)-(3), (19), (25).
        """
        parts = self.assembly.components
        rhos, found = dual_response(parts, self.joints, self._ordered(forces), omega)
        moved = {name: c.expand(rho) for name, c, rho in zip(self.names, parts, rhos, strict=True)}
        return moved, self._by_bond(found)

    def determinacy(self, rigid: Mapping | None = None) -> Determinacy:
        """Redundant and statically determinate bonds; on the host.

        Args: rigid: by component, rigid motions of its interface (b, d); default as in `redundancy`.

        Source: S1 (13)-(14), (20).
        """
        rigid = None if rigid is None else [rigid[name] for name in self.names]
        stresses, free = self_stresses(self._rows(), self.assembly.components, rigid)
        unknown, known, at = np.abs(stresses).max(axis=1, initial=0.0) > 1e-6, {}, 0
        for name, bond in self.bonds:
            known[name] = tuple(not flag for flag in unknown[at : at + len(bond.kept)])
            at += sum(len(pairs) for pairs in bond.pairs)
        labels = {name: tuple(bond.labels[k] for k in bond.kept) for name, bond in self.bonds}
        return Determinacy(stresses.shape[1], free, known, labels)

    def _ordered(self, forces):
        stray = sorted(set(forces) - set(self.names))
        if stray:
            raise ValueError(f"forces on {stray}: the components are {', '.join(self.names)}")
        return [forces.get(name) for name in self.names]

    def _rows(self):
        """(ties, interface coordinates of all components in turn): first less second."""
        starts = np.cumsum([0, *(c.num_interface for c in self.assembly.components)])
        place = {name: start for name, start in zip(self.names, starts, strict=False)}
        pairs = [pair for _, bond in self.bonds for side in bond.pairs for pair in side]
        rows = np.zeros((len(pairs), starts[-1]))
        for row, pair in zip(rows, pairs, strict=True):
            for sign, coordinate in zip((1.0, -1.0), pair, strict=True):
                if coordinate is not None:
                    row[place[coordinate[0]] + coordinate[1]] = sign
        return rows

    def _by_bond(self, found: Reactions) -> BondForces:
        """Forces of the ties from those on the components, `B^T f = r`: no tie closes a ring, so B has full rank."""
        B = self._rows()
        f = jnp.concatenate(found.forces)
        solve = jnp.asarray(np.linalg.solve(B @ B.T, B)).astype(f.dtype)
        f, at, first, second = jnp.tensordot(solve, f, axes=1), 0, {}, {}
        for name, bond in self.bonds:
            sides = []
            for pairs in bond.pairs:
                zero = jnp.zeros((len(bond.labels), *f.shape[1:]), f.dtype)
                sides.append(zero.at[np.array(bond.kept, int)].set(f[at : at + len(pairs)]))
                at += len(pairs)
            first[name], second[name] = sides[0], -sides[-1]
        return BondForces(first, second, found.residual)


def connect(components: Mapping, bonds: Mapping[str, Bond]) -> Network:
    """Components joined by bonds of `rigid`, `joint` and `bushing`, all by name: the primal assembly.

    `connect({"stage": a, "payload": b}, {"bolts": rigid(("stage", "top"), "payload")})`.  What no bond ties stays
    free.

    Raises: ModelError with every fault: unknown names, ends that do not match, bonds that tie what is tied already.
    Source: S1 (1)-(3), (9)-(12), (21)-(25).
    """
    found = ties(components, bonds)
    elements = {name: bond.element for name, bond in bonds.items() if bond.element is not None}
    parts = {name: explicit(c) for name, c in (dict(components) | elements).items()}
    parts = _turned(parts, bonds, found)
    joints = joint_numbers({name: c.num_interface for name, c in parts.items()}, found)
    return Network(join(tuple(parts.values()), joints), tuple(parts), tuple(found.items()), joints)


def _turned(parts, bonds, found):
    """Components whose ends at bonds with axes are resolved in these."""
    used, faults = {}, []
    for name, bond in found.items():
        for coordinate in (c for end in bond.ends for c in end):
            used.setdefault(coordinate, []).append(name)
    for name, bond in bonds.items():
        for end in found[name].ends if bond.axes is not None else ():
            others = sorted({other for c in end for other in used[c]} - {name})
            if others:
                faults.append(f"bond {name!r} has axes: {', '.join(others)} must not join the same coordinates")
            if end:
                parts[end[0][0]] = resolved_in(parts[end[0][0]], bond.axes, [k for _, k in end])
    if faults:
        raise ModelError(faults)
    return parts
