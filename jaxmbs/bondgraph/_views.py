"""The three views of a mechanism's bond graph, built from its topology and the names of bodies, forces and drives.

detailed     every body's inertias behind transformers, S2 Fig. 2
inertia      the equivalent inertia field I* and the gyristor GR at the junction of phi_dot, ports in full, S2 Fig. 3
hamiltonian  the same with all ports summed to Q, S2 Fig. 4
"""

import dataclasses
import functools

from ..checks import may_be_nonzero
from ..constraints._kic import dependent_columns
from ..errors import ModelError
from ..forces._element_bonds import PORT
from ..model._system import System
from ..named_arrays import element_of
from ..signal_flow._signals import with_idle_blocks
from ._circuits import circuit_bonds, joined_ports
from ._elastic import NUM_RIGID, num_flows, strain_one_ports
from ._elements import Element, PowerBond
from ._graph import BondGraph
from ._inner_causality import inner_strokes
from ._inner_graph import from_port, inner_bonds, inner_name

VIEWS = ("detailed", "inertia", "hamiltonian")


def drive_rows(system: System) -> list[int]:
    """Constraint rows that may prescribe a rate: drives, functions of time, the user's rows of velocity."""
    names = {name for group in system.rows if group.law.may_depend_on_time for name in group.names}
    names |= set(system.paths)
    return [i for i, name in enumerate(system.topology.row_joint) if name in names]


def root_sizes(system: System) -> dict[str, int]:
    """Components of the flows at the roots; roots without any are left out."""
    sizes = {"phi_dot": system.topology.mobility, "drives": len(drive_rows(system))}
    return {root: size for root, size in sizes.items() if size}


def build_view(system: System, view: str) -> BondGraph:
    """The graph of a view without causal strokes.

    Raises: ValueError for an unknown view, ModelError when nothing moves.
    Source: S2 (28)-(44), (56)-(76), Figs 2-4.
    """
    if view not in VIEWS:
        raise ValueError(f"view must be one of {', '.join(VIEWS)}, not {view!r}")
    sketch = _GraphBuilder(with_idle_blocks(system), circuit_bonds(system), joined_ports(system))
    if not sketch.roots:
        raise ModelError(["the bond graph is empty: the mechanism has no freedom and no drive"])
    if len(dependent_columns(system)):
        sketch.junction("q_dot", "q̇", len(dependent_columns(system)), "Gi", "B_q")
    if view == "detailed":
        sketch.bodies()
        sketch.elastic_bodies()
    else:
        sketch.field("I", "I*", "[I*]")
        sketch.field("GR", "GR", "")
    if view == "hamiltonian":
        sketch.field("Se", "Q", "Q")
    else:
        if view == "inertia" and may_be_nonzero(system.gravity):
            sketch.field("Se", "gravity", "gravity")
        sketch.forces()
        sketch.friction()
        sketch.hydraulics()
        sketch.strains()
    return BondGraph(view, tuple(sketch.elements), tuple(sketch.bonds))


class _GraphBuilder:
    """A graph under construction; elements are added from the roots outwards."""

    def __init__(self, system, circuits, joined):
        self.system, self.roots = system, root_sizes(system)
        self.circuits, self.joined = circuits, joined
        self.elements, self.bonds = [], []
        for root, size in self.roots.items():
            self.add("1", root, {"phi_dot": "φ̇", "drives": "ṡ"}[root], size)
        if "drives" in self.roots:
            names = dict.fromkeys(system.topology.row_joint[i] for i in drive_rows(system))
            self.leaf("Sf", "drive", ", ".join(names), "drives")

    def add(self, kind, name, label, size):
        self.elements.append(Element(name, kind, label, size))
        return name

    def bond(self, inner, outer, size, outward=True):
        self.bonds.append(PowerBond(inner, outer, size) if outward else PowerBond(outer, inner, size))

    def size(self, name):
        return next(e.size for e in self.elements if e.name == name)

    def leaf(self, kind, name, label, junction):
        """A one-port at a 1-junction; sources and the gyristor point at it."""
        size = self.size(junction)
        self.add(kind, name, label, size)
        self.bond(junction, name, size, outward=kind in ("I", "C", "R"))

    def field(self, kind, name, label):
        """An element with a port at every root."""
        self.add(kind, name, label, sum(self.roots.values()))
        for root, size in self.roots.items():
            self.bond(root, name, size, outward=kind == "I")

    def junction(self, name, label, size, modulus, driven, kind="1"):
        """A junction or one-port whose flow is `modulus phi_dot + driven rates`, a 0-junction adding the two."""
        into = []
        for root, symbol in zip(("phi_dot", "drives"), (modulus, driven), strict=True):
            if root in self.roots:
                into.append(self.add("MTF", symbol, _symbol(symbol), size))
                self.bond(root, symbol, self.roots[root], outward=kind != "Se")
        if len(into) > 1:
            total = self.add("0", f"0:{name}", "", size)
            for transformer in into:
                self.bond(transformer, total, size, outward=kind != "Se")
            into = [total]
        self.bond(into[0], self.add(kind, name, label, size), size, outward=kind != "Se")
        return name

    def bodies(self):
        """Rotational and translational inertia of every body with mass, and gravity on it."""
        gravity = may_be_nonzero(self.system.gravity)
        for k, body in enumerate(self.system.topology.body_names):
            if may_be_nonzero(self.system.inertia[k]):
                self.junction(f"I:{body}", f"[I] {body}", 3, f"G_r:{body}", f"B_r:{body}", kind="I")
            if may_be_nonzero(self.system.mass[k]):
                moduli = f"G_t:{body}", f"B_t:{body}"
                if not gravity:
                    self.junction(f"m:{body}", f"m {body}", 3, *moduli, kind="I")
                    continue
                self.junction(f"v:{body}", f"v {body}", 3, *moduli)
                self.leaf("I", f"m:{body}", f"m {body}", f"v:{body}")
                self.leaf("Se", f"mg:{body}", "m g", f"v:{body}")

    def elastic_bodies(self):
        """Inertia, gyristor and weight of every elastic body on its flow."""
        for group in self.system.elastic:
            for name in group.names:
                flow = self.junction(f"y:{name}", f"y {name}", num_flows(group), f"G_y:{name}", f"B_y:{name}")
                self.leaf("I", f"I:{name}.flow", f"[I] {name}", flow)
                self.leaf("GR", f"GR:{name}.flow", name, flow)
                if may_be_nonzero(self.system.gravity):
                    self.leaf("Se", f"mg:{name}.flow", "m g", flow)

    def forces(self):
        """Every force element behind its transformer: the bonds inside it that its law declares, or what it stores
        (C), dissipates (R) or feeds in (Se)."""
        for group in self.system.forces:
            for i, name in enumerate(group.names):
                size = group.port.num_flows or self.system.topology.num_velocities
                if inner_bonds(self.system, group, i):
                    self.inner_graph(group, i, size, inner_bonds(self.system, group, i, self.joined))
                else:
                    self.one_ports(name, law_one_ports(group, i), functools.partial(self.port, group, i, size))

    def friction(self):
        """A resistor for every rubbing surface of a joint, on the twist of its child relative to its parent."""
        for name in () if self.system.friction is None else self.system.friction.names:
            self.junction(f"R:{name}", name, 6, f"G:{name}", f"B:{name}", "R")

    def inner_graph(self, group, i, size, bonds):
        """The graph inside a force element, behind the junction of its flow."""
        name = group.names[i]
        self.port(group, i, size, f"rate:{name}", f"v {name}", "1")
        if group.port.is_on_line:
            self.add("MTF", f"n:{name}", f"n {name}", 1)
            self.bond(f"rate:{name}", f"n:{name}", size)
            self.bond(f"n:{name}", self.add("1", inner_name(group, i, PORT), f"v {name}", 1), 1)
        for element in from_port(bonds)[1:]:
            kind, _, label = element.partition(":")
            own = [bond for bond in bonds if element in (bond.tail, bond.head)]
            own_name = inner_name(group, i, element)
            self.elements.append(Element(own_name, kind, f"{name} {label}", own[0].size, own[-1].domain, name))
        strokes = inner_strokes(bonds)
        for bond in bonds:
            tail, head = (inner_name(group, i, end) for end in (bond.tail, bond.head))
            self.bonds.append(PowerBond(tail, head, bond.size, strokes[bond], bond.domain))

    def hydraulics(self):
        """Parts of hydraulic circuits: the ports of elements are joined to the junctions of nodes and chambers."""
        own = [bond for bonds in self.circuits.values() for bond, _ in bonds]
        parts = {
            end: (name, bond)
            for name, bonds in self.circuits.items()
            for bond, _ in bonds
            for end in (bond.tail, bond.head)
        }
        placed = [element.name for element in self.elements if element.name in parts]
        for end in from_port(own, placed)[len(placed) :]:
            kind, _, label = end.partition(":")
            name, bond = parts[end]
            self.elements.append(Element(end, kind, label.replace(".", " "), 1, bond.domain, name))
        chambers = [dataclasses.replace(bond, stroke="") for bond in self.bonds if bond.domain == "fluid"]
        strokes = inner_strokes(own + chambers, [name for name in placed if name.startswith("rate:")])
        self.bonds += [PowerBond(bond.tail, bond.head, 1, strokes[bond], bond.domain) for bond in own]

    def strains(self):
        """One-ports of the deformations of every elastic body: stores (C) and resistors (R)."""
        for group in self.system.elastic:
            for i, name in enumerate(group.names):
                moduli = {"modulus": f"G_q:{name}", "driven": f"B_q:{name}"}
                place = functools.partial(self.junction, size=num_flows(group) - NUM_RIGID, **moduli)
                self.one_ports(f"{name}.strain", strain_one_ports(group, i), place)

    def one_ports(self, name, parts, place):
        """One part alone where `place(element, label, kind=)` puts it, several at a junction there."""
        if len(parts) == 1:
            place(f"{parts[0]}:{name}", name, kind=parts[0])
        elif parts:
            place(f"rate:{name}", f"v {name}", kind="1")
            for kind in parts:
                self.leaf(kind, f"{kind}:{name}", name, f"rate:{name}")

    def port(self, group, i, size, name, label, kind):
        """The junction or one-port of a force element; joint laws hang on their own coordinate."""
        element = group.names[i]
        if not group.port.is_on_joint:
            self.junction(name, label, size, f"{group.port.modulus}:{element}", f"B:{element}", kind)
            return
        junction = joint_junction(self.system, group.first[i])
        outward = kind != "Se"
        self.add("TF", f"e:{element}", f"e {element}", 1)
        self.bond(junction, f"e:{element}", self.size(junction), outward)
        self.add(kind, name, label, 1)
        self.bond(f"e:{element}", name, 1, outward)


def _symbol(name):
    """A modulus as the picture shows it: "G_t:crank" as Gₜ crank."""
    symbol, _, owner = name.partition(":")
    for plain, shown in (("_r", "ᵣ"), ("_t", "ₜ"), ("_q", ""), ("Gamma", "Γ")):
        symbol = symbol.replace(plain, shown)
    return f"{symbol} {owner}".rstrip()


def joint_junction(system: System, column: int) -> str:
    """The 1-junction that holds a velocity column."""
    return "q_dot" if column in dependent_columns(system) else "phi_dot"


def law_one_ports(group, i: int) -> list[str]:
    """Kinds of one-ports that law `i` of a group needs, as the law itself says.

    A law with internal states that declares no bonds is one: its effort follows from them, as that of a C does, and
    part of the energy that it takes may become heat.
    """
    law = element_of(group.law, i)
    if group.internal:
        return ["Se" if law.is_source else "C" if law.stores else "R"]
    return ["C"] * law.stores + ["Se" if law.is_source else "R"] * law.dissipates
