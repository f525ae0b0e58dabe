"""Hydraulic circuits in the bond graph: elements and nodes, their bonds, and the graph that joins their ports.

A node is a 0-junction, "0:supply.pressure", with what stores or supplies there; of a cylinder it is that of its
chamber, "0:boom.chamber0".  The ports of elements are joined to these, and the shaft of a pump to its joint.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..forces._element_bonds import Bonds, ends
from ..hydraulics import AbstractHydraulicElement, AbstractNode
from ..hydraulics._junction import Inflow
from ..hydraulics._pump import SHAFT, PumpOnShaft, TorqueOfPump
from ..kinematics._signals import signals_and_blocks
from ..model._signals import BlockElement
from ..model._system import System
from ._inner_graph import InnerBond, vectors


class CircuitPart(NamedTuple):
    """An element or node of a circuit.

    Attributes:
        nodes: of an element the node at each port by the port's name, empty for a node.
        shaft: the force element of a pump on a joint, empty for the others.
    """

    element: BlockElement
    nodes: dict[str, str]
    shaft: str

    @property
    def name(self) -> str:
        return self.element.name

    @property
    def is_node(self) -> bool:
        return isinstance(self.element.block, AbstractNode)


def circuit_parts(system: System) -> list[CircuitPart]:
    """Elements and nodes of all circuits, nodes first."""
    found = []
    for element in system.blocks:
        if isinstance(element.block, AbstractHydraulicElement):
            nodes = {port: str(node) for port, node in zip(element.block.ports, element.reads, strict=False)}
            shaft = _shaft_of(system, element) if isinstance(element.block, PumpOnShaft) else ""
            found.append(CircuitPart(element, nodes, shaft))
        elif isinstance(element.block, AbstractNode):
            found.append(CircuitPart(element, {}, ""))
    return sorted(found, key=lambda part: not part.is_node)


def _shaft_of(system, element):
    torques = (e for e in system.blocks if isinstance(e.block, TorqueOfPump) and e.reads == element.names)
    return next(e.drives[0].rpartition(".")[0] for e in torques)


class PartPowers(NamedTuple):
    """Bonds of a part of a circuit, and the power [W] that goes into what it stores, from its energy."""

    bonds: Bonds
    stored: Any


def circuit_powers(system: System, at) -> dict[str, PartPowers]:
    """Bonds and stored powers of all parts by name, of a system at its internal states at a `VelocityKinematics`."""
    parts = circuit_parts(system)
    if not parts:
        return {}
    values, blocks = signals_and_blocks(system, at)
    flows = _flows_into_nodes(parts, values)
    found = {}
    for part in parts:
        block, u, s = blocks[part.name]
        seen = flows.get(part.name, jnp.zeros(())) if part.is_node else u
        stored = jnp.zeros_like(at.t)
        if part.element.internal:
            stored = jax.jvp(block.stored_energy, (s,), (_rates(part, block, seen, u, s, at.t),))[1]
        found[part.name] = PartPowers(block.bonds(seen, s, at.t), stored)
    return found


def _rates(part, block, flow, u, s, t):
    """Rates of the states, of a node from the flows of the elements."""
    node = getattr(block, "node", block) if part.is_node else block
    rates = node.rate(flow if part.is_node else u, s, t)
    return {name: jnp.asarray(rates[name], value.dtype).reshape(value.shape) for name, value in s.items()}


def _flows_into_nodes(parts, values):
    """Flows by node from the outputs of the elements."""
    found: dict = {}
    for part in parts:
        for port, node in part.nodes.items():
            entry, sign = part.element.block.port_flows[part.element.block.ports.index(port)]
            found[node] = found.get(node, 0.0) + sign * jnp.atleast_1d(values[part.name])[entry]
    return found


def joined_ports(system: System) -> frozenset[str]:
    """Ports in the graph of the mechanism in whose place the bonds of circuits are."""
    chambers = {f"port:{cylinder}.circuit{k}" for cylinder in _cylinders(system) for k in (0, 1)}
    shafts = {f"port:{part.shaft}.shaft" for part in circuit_parts(system) if part.shaft}
    return frozenset(chambers | shafts)


def circuit_bonds(system: System) -> dict[str, list[tuple[InnerBond, str]]]:
    """Of each part its bonds by the names that their ends have in the graph, with the name of the part's own bond."""
    cylinders = _cylinders(system)
    return {part.name: list(_bonds_of_part(part, cylinders)) for part in circuit_parts(system)}


def circuit_values(system: System, at) -> dict[str, tuple[Any, Any]]:
    """(effort, flow), each (1,), by bond of all circuits in the graph; the system is at its internal states."""
    powers = circuit_powers(system, at)
    return {
        f"{bond.tail} -> {bond.head}": vectors(powers[name].bonds[own].effort, powers[name].bonds[own].flow)
        for name, bonds in circuit_bonds(system).items()
        for bond, own in bonds
    }


def _bonds_of_part(part, cylinders):
    block, t = part.element.block, jnp.zeros(())
    s = {name: jnp.zeros(shape) for name, shape, _ in part.element.internal}
    seen = t if part.is_node else jnp.zeros(part.element.size)
    for name, bond in jax.eval_shape(lambda: block.bonds(seen, s, t)).items():
        if not (part.is_node and "port:" in name):  # others end at the node itself
            tail, head = (_joined(part, end, cylinders) for end in ends(name))
            yield InnerBond(tail, head, 1, bond.domain), name


def _cylinders(system):
    """Names of the cylinders whose chambers are nodes of circuits."""
    return [e.drives[0].rpartition(".")[0] for e in system.blocks if isinstance(e.block, Inflow)]


def _joined(part, end, cylinders):
    """Name in the graph of the mechanism of an element in the graph of a part."""
    kind, _, label = end.partition(":")
    if end == SHAFT:
        return f"rate:{part.shaft}"
    if kind != "port":
        return f"{kind}:{part.name}.{label}"
    node = part.nodes[label]
    element, _, chamber = node.rpartition(".")
    return f"0:{element}.chamber{chamber[1:]}" if element in cylinders else f"0:{node}.pressure"
