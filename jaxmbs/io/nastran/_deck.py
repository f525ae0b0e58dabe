"""`Deck`: a structure read from Nastran bulk data, its numbers as leaves."""

from collections.abc import Iterable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from ...checks import is_concrete, place_of
from ...elements import DIRECTIONS
from ...elements._base import as_real
from ...errors import ModelError
from ...fem import Group, Structure, assemble, assemble_dense
from ...linear import LinearSystem, equilibrium
from ...linear._rigid_motions import rigid_loads, rigid_rows
from ...linear._storage import as_inexact
from ...quantities import Quantity
from ...reports import Report, Reported
from ...typing import AnyArray, Convertible
from ._coordinates import DeckCoordinates
from ._groups import AbstractElementGroup, DeckParameters
from ._loads import EnforcedPlaces, LoadSet, stiffness_forces
from ._lumped import LumpedMassGroup
from ._warming import ply_stresses, recover, thermal_forces


class Deck(Reported, eqx.Module):
    """Nodes "GRID 12", materials "MAT1 3", properties "PSHELL 1", groups of elements "CQUAD4 1".

    Every number is a leaf: `eqx.tree_at(lambda d: d.properties["PSHELL 1"].thickness, deck, t).system` has
    derivatives by t.  Numbers are those of the deck; masses are multiplied by `mass`.

    Attributes:
        positions: (nodes, 3) of the GRIDs in basic axes.
        materials, properties: by name of their card.
        elements: groups of elements; each has `ids`, the numbers of its elements.
        mass: PARAM WTMASS.
        massless: rows of `system` without mass.
        held: labels that SPC and GRID hold; weak: those that PARAM AUTOSPC holds, as no element stiffens them.
        ignored: what of the deck is not used, one sentence each.
        notes: what was decided about it: masses lumped or consistent, plates without transverse shear.
        loads: sets of loads, "LOAD 3"; temperatures: (nodes,) of sets, "TEMPERATURE 3"; unread_temperatures: names
            of sets that cannot be used, and why.
        enforced: displacements of held places that the SPC cards give, None without.
        cases: number, load and temperature of each subcase, 0 where the case control has none, "" for no set.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    positions: Convertible[Float[Array, "nodes 3"]] = eqx.field(converter=as_real)
    materials: dict[str, Any]
    properties: dict[str, Any]
    elements: dict[str, AbstractElementGroup]
    mass: Convertible[Float[Array, ""]] = eqx.field(converter=as_real)
    coordinates: DeckCoordinates
    fixed: tuple[tuple[int, int], ...] = eqx.field(static=True)
    massless: tuple[int, ...] = eqx.field(static=True)
    held: tuple[str, ...] = eqx.field(static=True)
    weak: tuple[str, ...] = eqx.field(static=True)
    ignored: tuple[str, ...] = eqx.field(static=True)
    notes: tuple[str, ...] = eqx.field(static=True, default=())
    loads: dict[str, LoadSet] = eqx.field(default_factory=dict)
    temperatures: dict[str, Array | np.ndarray] = eqx.field(default_factory=dict)
    unread_temperatures: tuple[tuple[str, str], ...] = eqx.field(static=True, default=())
    enforced: EnforcedPlaces | None = None
    cases: tuple[tuple[int, str, str], ...] = eqx.field(static=True, default=((0, "", ""),))

    def report(self) -> Report:
        counts = {"nodes": len(self.names), "materials": len(self.materials), "properties": len(self.properties)}
        counts |= {f"elements {name}": len(group.ids) for name, group in self.elements.items()}
        counts |= {
            "held coordinates": len(self.held),
            "held by AUTOSPC": len(self.weak),
            "cards not used": len(self.ignored),
        }
        return Report([Quantity(name, count) for name, count in counts.items()])

    @property
    def numbers(self) -> DeckParameters:
        """Numbers that the elements are made of."""
        return DeckParameters(self.positions, self.materials, self.properties, self.mass)

    @property
    def structure(self) -> Structure:
        """The finite elements, for `fem`; what ties and turned frames hold is not in it, but in `system`."""
        made = {name: Group(own.element(self.numbers), own.nodes, False) for name, own in self.elements.items()}
        held: dict[str, list[str]] = {}
        for node, direction in self.fixed:
            held.setdefault(self.names[node], []).append(DIRECTIONS[direction])
        return Structure((self.names, self.positions), made, held)

    @property
    def system(self) -> LinearSystem:
        """Mass and stiffness over the free coordinates: `assemble()`."""
        return self.assemble()

    def assemble(self, interface: Iterable = (), blocks: bool = False) -> LinearSystem:
        """The free coordinates, ties eliminated exactly: `T^T K T` with displacements T x.

        Rows are labelled "GRID 12 x", in basic axes.  A node of which the deck holds or ties something in a frame of
        its own keeps that frame, with labels "GRID 12, 1 of frame 5".

        Args: interface: names of nodes, or labels; blocks: block matrices, where no tie and no turned frame is.

        Raises: ModelError for an interface that is not there; ValueError for blocks where there are ties.
        """
        return self._assemble(self.structure, interface, blocks)

    def _assemble(self, structure, interface=(), blocks=False):
        if self.coordinates.plain:
            found = assemble(structure, interface, blocks)
            return found if blocks else found.replace(massless=self.massless)
        if blocks:
            raise ValueError("block matrices need a deck without ties and without supports in turned frames")
        damped = any(group.element.has_damping for group in structure.groups.values())
        kinds = ("stiffness", "mass", *(["damping"] if damped else []))
        motions = self.coordinates.motions(self.positions)
        found = assemble_dense(structure, kinds)
        made: dict[str, Any] = {k: self._reduced(structure, A, motions) for k, A in zip(kinds, found, strict=True)}
        made |= dict(interface=interface, coordinates=self._labels, massless=self.massless)
        system = LinearSystem(**made, positions=(self.names, self.positions))
        return system if not self.held else system.replace(ground_inertia=self._ground(structure, motions, system))

    def _ground(self, structure, motions, system):
        """`ground_inertia` of the system: the forces of all masses in rigid accelerations, `T^T M R`, less those of
        the free coordinates."""
        whole, origin = assemble(structure), jnp.zeros(3, self.positions.dtype)
        own, other, to, T = self._parts(structure, motions)
        loads = rigid_loads(whole, origin)
        found = jnp.zeros((system.num_rows, 6), loads.dtype).at[to].add(loads[own]) + T.T @ loads[other]
        return found - system.mass @ rigid_rows(system, origin)

    def displacements(self, x: AnyArray) -> Inexact[Array, "... nodes 6"]:
        """Displacements and rotations of all nodes in basic axes, from x (..., rows) of `system`, times first.

        `fem.element_forces(deck.structure, deck.displacements(x))` has the forces of the elements.

        Raises: ValueError for x of another size.
        """
        x = as_inexact(x)
        if x.shape[-1:] != (len(self.coordinates.free),):
            raise ValueError(f"displacements have shape {x.shape}, not (..., {len(self.coordinates.free)})")
        apart = set(self.coordinates.others)
        own = [(n, d, k) for k, (n, d) in enumerate(self.coordinates.free) if n not in apart]
        nodes, directions, rows = np.array(own, int).reshape(-1, 3).T
        found = jnp.zeros((*x.shape[:-1], len(self.names), 6), x.dtype).at[..., nodes, directions].set(x[..., rows])
        if self.coordinates.plain:
            return found
        columns, motions = self.coordinates.motions_by_columns(self.positions)
        others = jnp.tensordot(x[..., columns], motions.astype(x.dtype), axes=(-1, -1))
        return found.at[..., np.array(self.coordinates.others), :].set(others)

    def load(self, load: str | None = None, temperature: str | None = None) -> Float[Array, "nodes 6"]:
        """Forces and moments on all nodes in basic axes, those of warming among them.

        Args: load, temperature: names of sets, "LOAD 3", "TEMPERATURE 5", or ""; by default those of the first case.

        Raises: UnknownNameError; ModelError for sets with cards that are not read, which it names.
        """
        load, temperature = self._sets(load, temperature)
        return self._load(self.structure, load, temperature)

    def _load(self, structure, load, temperature):
        total = jnp.zeros((len(self.names), 6))
        if load:
            total = total + self.loads[load].forces(structure, load)
        return total + thermal_forces(self, structure, self._temperature(temperature)) if temperature else total

    def statics(self, load: str | None = None, temperature: str | None = None) -> Float[Array, "nodes 6"]:
        """Displacements and rotations of all nodes in basic axes under a load, as of `load`, with enforced places."""
        load, temperature = self._sets(load, temperature)
        structure, count = self.structure, len(self.names)
        forces, system = self._load(structure, load, temperature), self._assemble(structure)
        held = jnp.zeros((count, 6)) if self.enforced is None else self.enforced.displacements(count)
        held = self.loads[load].enforced(held) if load else held
        if self.enforced is not None or (load and self.loads[load].moves):
            held = self.coordinates.follow(self.positions, held)
            forces = forces - stiffness_forces(structure, held)
        (rows,) = jax.vjp(self.displacements, jnp.zeros(system.num_rows))[1](forces)
        return self.displacements(equilibrium(system, rows).displacement) + held

    def forces(self, u: AnyArray, temperature: str = "") -> dict[str, Array]:
        """Forces (elements, labels) by group at displacements u (nodes, 6), as `fem.element_forces` has them, of
        warmed elements less what free ones have."""
        return recover(self, u, self._warm(temperature), "forces")

    def stresses(self, u: AnyArray, temperature: str = "") -> dict[str, Array]:
        """Stresses (elements, labels) by group, in the middle of plates and solids, of warmed elements less what free
        ones have."""
        return recover(self, u, self._warm(temperature), "stresses")

    def corner_stresses(self, u: AnyArray, temperature: str = "") -> dict[str, Array]:
        """Stresses (elements, corners, labels) of plates of one material and of solids, likewise."""
        return recover(self, u, self._warm(temperature), "corner_stresses")

    def ply_stresses(self, u: AnyArray, temperature: str = "") -> dict[str, Array]:
        """Stresses 11 22 12 (elements, plies, 3 heights, 3) of the plies of each PCOMP and PCOMPG, in their own axes,
        at their lower face, middle and upper face, less what free ones have."""
        return ply_stresses(self, u, self._warm(temperature))

    def _warm(self, temperature):
        if temperature:
            place_of("temperature", temperature, self.temperatures)
        return self._temperature(temperature) if temperature else None

    def _sets(self, load, temperature):
        """Names of both, those of the first case where None."""
        load = self.cases[0][1] if load is None else load
        temperature = self.cases[0][2] if temperature is None else temperature
        for what, name, among in (("load", load, self.loads), ("temperature", temperature, self.temperatures)):
            if name:
                place_of(what, name, among)
        return load, temperature

    def _temperature(self, name):
        own, faults = self.temperatures[name], dict(self.unread_temperatures)
        if name in faults:
            raise ModelError([faults[name]], f"{name} is not supported")
        if is_concrete(own) and np.any(np.isnan(own)):
            missing = self.names[int(np.argmax(np.isnan(own)))]
            raise ModelError([f"{name}: {missing} has no temperature, and there is no TEMPD"])
        return jnp.asarray(own)

    def describe(self) -> str:
        """Summary of what was read, held and ignored, in lines."""
        own = {name: own for name, own in self.elements.items() if not isinstance(own, LumpedMassGroup)}
        counts = [f"{name}: {len(cards.nodes)} elements" for name, cards in own.items()]
        lines = [f"{len(self.names)} nodes, {len(self.coordinates.free)} free coordinates", *counts]
        lines += [f"tied by {name}" for name in self.coordinates.ties]
        lines += [f"held, as no element stiffens it: {name}" for name in self.weak[:20]]
        lines += [f"and {len(self.weak) - 20} more"] if len(self.weak) > 20 else []
        lines += [f"note: {what}" for what in self.notes]
        return "\n".join([*lines, *(f"ignored: {what}" for what in self.ignored)])

    @property
    def _labels(self):
        turned = dict(self.coordinates.turned)
        return [
            (f"{self.names[n]}, {d + 1} of frame {turned[n]}", "") if n in turned else (self.names[n], DIRECTIONS[d])
            for n, d in self.coordinates.free
        ]

    def _reduced(self, structure, A, motions):
        """`T^T A T`: rows of nodes with coordinates of their own are only moved, the others multiplied."""
        own, other, to, T = self._parts(structure, motions)
        mixed = A[np.ix_(own, other)] @ T
        found = T.T @ A[np.ix_(other, other)] @ T
        return found.at[np.ix_(to, to)].add(A[np.ix_(own, own)]).at[to].add(mixed).at[:, to].add(mixed.T)

    def _parts(self, structure, motions):
        """Rows of nodes with coordinates of their own, all other rows, free coordinates of the first, T of the
        second."""
        index = structure.index
        apart = {node: k for k, node in enumerate(self.coordinates.others)}
        free = {pair: k for k, pair in enumerate(self.coordinates.free)}
        pairs = list(zip(index.nodes.tolist(), index.directions.tolist(), strict=True))
        own = np.array([row for row, (n, _) in enumerate(pairs) if n not in apart], int)
        other = np.array([row for row, (n, _) in enumerate(pairs) if n in apart], int)
        to = np.array([free[pairs[row]] for row in own], int)
        T = motions[np.array([apart[pairs[row][0]] for row in other], int), index.directions[other]]
        return own, other, to, T
