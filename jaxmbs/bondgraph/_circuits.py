"""Hydraulic circuits in the bond graph: elements and nodes, their bonds, and the graph that joins their ports.

A node is a 0-junction, "0:supply.pressure", with what stores or supplies there; of a cylinder it is that of its
chamber, "0:boom.chamber0".  The ports of elements are joined to these, and the shaft of a pump to its joint.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from ..forces._element_bonds import ElementBonds, ends
from ..hydraulics._pump import SHAFT
from ..model._signals import block_named
from ..model._system import System
from ..signal_flow._signals import with_signals
from ._elements import PowerBond
from ._inner_graph import vectors


class PartPowers(NamedTuple):
    """Bonds of a part of a circuit, and the power [W] that goes into what it stores, from its energy."""

    bonds: ElementBonds
    stored: Any


def circuit_powers(system: System, at) -> dict[str, PartPowers]:
    """Bonds and stored powers of all parts by name, of a system at a `VelocityKinematics`."""
    if not system.topology.circuits:
        return {}
    blocks = with_signals(system, at).signals.blocks  # type: ignore[union-attr]
    groups = {name: found for found in blocks for name in found.group.names}
    found = {}
    for record in system.topology.circuits:
        (element,) = block_named(system.blocks, record.name)
        block, u, s = groups[record.name].one(element)
        stored = jnp.zeros_like(at.t)
        if s:
            stored = jax.jvp(block.stored_energy, (s,), (_rates(block, u, s, at.t),))[1]
        found[record.name] = PartPowers(block.bonds(u, s, at.t), stored)
    return found


def _rates(block, u, s, t):
    rates = block.rate(u, s, t)
    return {name: jnp.asarray(rates[name], value.dtype).reshape(value.shape) for name, value in s.items()}


def joined_ports(system: System) -> frozenset[str]:
    """Ports in the graph of the mechanism in whose place the bonds of circuits are."""
    chambers = {f"port:{cylinder}.circuit{k}" for cylinder in _cylinders(system) for k in (0, 1)}
    shafts = {f"port:{record.shaft}.shaft" for record in system.topology.circuits if record.shaft}
    return frozenset(chambers | shafts)


def circuit_bonds(system: System) -> dict[str, list[tuple[PowerBond, str]]]:
    """Of each part its bonds by the names that their ends have in the graph, with the name of the part's own bond."""
    cylinders = _cylinders(system)
    return {record.name: list(_bonds_of_part(system, record, cylinders)) for record in system.topology.circuits}


def circuit_values(system: System, at) -> dict[str, tuple[Any, Any]]:
    """(effort, flow), each (1,), by bond of all circuits in the graph."""
    powers = circuit_powers(system, at)
    return {
        f"{bond.tail} -> {bond.head}": vectors(powers[name].bonds[own].effort, powers[name].bonds[own].flow)
        for name, bonds in circuit_bonds(system).items()
        for bond, own in bonds
    }


def _bonds_of_part(system, record, cylinders):
    (element,) = block_named(system.blocks, record.name)
    for name, bond in jax.eval_shape(lambda: _bonds_at_rest(element)).items():
        if record.nodes or "port:" not in name:  # the ports of a node are the node itself
            tail, head = (_joined(record, end, cylinders) for end in ends(name))
            yield PowerBond(tail, head, 1, domain=bond.domain), name


def _bonds_at_rest(element):
    group, t = element.group, jnp.zeros(())
    s = {name: jnp.zeros(shape) for name, shape, _ in group.internal}
    return element.block.bonds(t if group.size is None else jnp.zeros(group.size), s, t)


def _cylinders(system):
    """Names of the cylinders whose chambers are nodes of circuits."""
    names = {record.name for record in system.topology.circuits}
    nodes = dict.fromkeys(node for record in system.topology.circuits for _, node in record.nodes)
    return list(dict.fromkeys(node.rpartition(".")[0] for node in nodes if node not in names))


def _joined(record, end, cylinders):
    """Name in the graph of the mechanism of an element in the graph of a part."""
    kind, _, label = end.partition(":")
    if end == SHAFT:
        return f"rate:{record.shaft}"
    if kind != "port":
        return f"{kind}:{record.name}.{label}"
    node = dict(record.nodes)[label]
    element, _, chamber = node.rpartition(".")
    return f"0:{element}.chamber{chamber[1:]}" if element in cylinders else f"0:{node}.pressure"
