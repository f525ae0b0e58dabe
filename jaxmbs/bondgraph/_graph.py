"""`BondGraph`: elements in order from the roots to the leaves, bonds, and causality of the storages."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from ..checks import no_such
from ..errors import UnknownNameError
from . import _drawing as drawing
from ._elements import Element, PowerBond, Storage


@dataclass(frozen=True)
class BondGraph:
    """Vector bond graph of a mechanism, static and hashable.

    Its roots are the 1-junctions of the independent velocities, "phi_dot", and of the prescribed rates, "drives".
    Elements stand in order from the roots outwards.  `storages` is empty until causality is assigned.
    """

    view: str
    elements: tuple[Element, ...]
    bonds: tuple[PowerBond, ...]
    storages: tuple[Storage, ...] = ()

    def __getitem__(self, name: str) -> Element:
        if name not in self.order:
            raise UnknownNameError(no_such("element", name, self.order))
        return self.elements[self.order[name]]

    @cached_property
    def order(self) -> dict[str, int]:
        """Place of every element by name; the roots come first."""
        return {element.name: i for i, element in enumerate(self.elements)}

    @property
    def roots(self) -> tuple[str, ...]:
        """The 1-junctions whose flows give all others."""
        return tuple(name for name in ("phi_dot", "drives") if name in self.order)

    @property
    def dependent(self) -> tuple[str, ...]:
        """Inertias in derivative causality: the dependent inertial elements of the paper."""
        own = {s.name for s in self.storages if s.independent}
        return tuple(dict.fromkeys(s.name for s in self.storages if s.dependent and s.name not in own))

    def bonds_of(self, name: str) -> Iterator[tuple[PowerBond, str, int]]:
        """Bonds of an element, the element at the other end, and +1 where power leaves by it, -1 where it enters."""
        for bond in self.bonds:
            if bond.tail == name:
                yield bond, bond.head, 1
            elif bond.head == name:
                yield bond, bond.tail, -1

    def inward(self, name: str) -> list[tuple[PowerBond, str, int]]:
        """The bonds of an element on the side of the roots."""
        return [row for row in self.bonds_of(name) if self.order[row[1]] < self.order[name]]

    def outward(self, name: str) -> list[tuple[PowerBond, str, int]]:
        """The bonds of an element away from the roots."""
        return [row for row in self.bonds_of(name) if self.order[row[1]] > self.order[name]]

    def describe(self) -> str:
        """Elements, bonds and dependent inertias as text."""
        kinds = {kind: sum(e.kind == kind for e in self.elements) for kind in dict.fromkeys(self._kinds())}
        lines = [f"bond graph, {self.view} view: " + ", ".join(f"{n} {kind}" for kind, n in kinds.items())]
        domains = {b.name: "" if b.domain == "mechanical" else f", {b.domain}" for b in self.bonds}
        lines += [f"  {b.name}  ({b.size}{domains[b.name]})" for b in self.bonds]
        for s in self.storages:
            parts = [f"{n} {what}" for what in ("independent", "dependent", "idle") if (n := getattr(s, what))]
            lines.append(f"  {s.name} at {s.junction}: {', '.join(parts) or 'no components'}")
        return "\n".join(lines)

    def _kinds(self):
        return [e.kind for e in self.elements]

    def to_networkx(self):
        """The graph as `networkx.MultiDiGraph` along the half arrows, attributes of elements and bonds included.

        Raises: ModuleNotFoundError without networkx; it is in the extra `viz`.
        """
        return drawing.to_networkx(self)

    def _repr_svg_(self) -> str:
        return drawing.draw_bond_graph(self)
