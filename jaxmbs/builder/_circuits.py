"""Hydraulic circuits as blocks: elements read pressures, nodes and cylinders read flows.

A node is a `Volume`, an `Accumulator` or a `Tank` by its name, or a chamber of a cylinder, "boom.p0".  A pump on a
shaft reads the speed of its joint and drives a force element there.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp

from ..checks import any_concrete, faults_if, no_such
from ..forces import Constant, HydraulicCylinder
from ..hydraulics import AbstractHydraulicElement, AbstractNode, AbstractStorage, Pump, Tank
from ..hydraulics._pump import PumpOnShaft, PumpTorque
from ..hydraulics._sum import Sum
from ..model._internal_states import replace_field
from ..model._topology import CircuitRecord
from ._declarations import Block, ForceElement, Measure, Model, has_one_coordinate
from ._signal_shapes import shape_of_signal

CHAMBERS = ("p0", "p1")
_TORQUE = ((0, 1),)  # among the outputs of a pump on a shaft


def with_circuits(model: Model) -> Model:
    """The model, whose circuits have no faults, with its hydraulic elements as blocks."""
    if not model.hydraulics:
        return model
    elements = [item for item in model.hydraulics.values() if isinstance(item.element, AbstractHydraulicElement)]
    circuits = [_record(item) for item in elements]
    elements, measures, shaft_blocks, shaft_forces = _on_shafts(elements)
    nodes = [item for item in model.hydraulics.values() if isinstance(item.element, AbstractNode)]
    blocks = [*map(_element_block, elements), *(_node_block(item, elements) for item in nodes), *shaft_blocks]
    forces = {item.name: item for item in shaft_forces}
    for name in _joined_cylinders(elements, model):
        blocks.append(_cylinder_block(name, elements))
        law = replace_field(model.forces[name].law, "inflow", Constant(0.0))
        forces[name] = dataclasses.replace(model.forces[name], law=law)
    blocks = {block.name: block for block in blocks}
    return dataclasses.replace(
        model,
        measures=model.measures | {item.name: item for item in measures},
        blocks=model.blocks | blocks,
        forces=model.forces | forces,
        hydraulics={},
        circuits=(*(CircuitRecord(item.name) for item in nodes), *circuits),
    )


def _record(item):
    shaft = "" if item.shaft is None else shaft_names(item.name)[1]
    return CircuitRecord(item.name, tuple((port, item.ports[port]) for port in item.element.ports), shaft)


def shaft_names(name: str) -> tuple[str, str, str]:
    """Names of the measure, the force element and the block that a pump on a shaft adds."""
    return f"{name} speed", f"{name} shaft", f"{name} torque"


def _on_shafts(elements):
    """(elements whose pumps on shafts read the speeds of their joints, measures, blocks, forces that these add)."""
    found, measures, blocks, forces = [], [], [], []
    for item in elements:
        if item.shaft is None:
            found.append(item)
            continue
        speed, force, torque = shaft_names(item.name)
        found.append(dataclasses.replace(item, element=PumpOnShaft(item.element), signal=speed, shaft=None))
        measures.append(Measure(speed, joint=item.shaft, of="velocity"))
        blocks.append(Block(torque, Sum(), item.name, f"{force}.torque", mix=_TORQUE))
        forces.append(ForceElement(force, PumpTorque(), None, item.shaft, None))
    return found, measures, blocks, forces


def _element_block(item):
    reads = [item.ports[port] for port in item.element.ports]
    if item.signal is not None:
        is_source = isinstance(item.signal, str) or callable(item.signal)
        reads.append(item.signal if is_source else Constant(item.signal))
    return Block(item.name, item.element, tuple(reads))


def _node_block(item, elements):
    reads, signs = _flows_into((item.name,), elements)
    return Block(item.name, item.element, reads, mix=signs)


def _cylinder_block(name, elements):
    reads, signs = _flows_into(tuple(f"{name}.{chamber}" for chamber in CHAMBERS), elements)
    return Block(f"{name} inflow", Sum(), reads, f"{name}.inflow", mix=signs)


def _flows_into(nodes, elements):
    """(names of the elements at some nodes, of each node the signs of all entries of their outputs)."""
    reads, signs = [], [[] for _ in nodes]
    for item in elements:
        if not set(item.ports.values()) & set(nodes):
            continue
        reads.append(item.name)
        for node, row in zip(nodes, signs, strict=True):
            own = [0] * item.element.num_outputs
            for port, (entry, sign) in zip(item.element.ports, item.element.port_flows, strict=True):
                own[entry] += sign if item.ports[port] == node else 0
            row += own
    return tuple(reads), tuple(map(tuple, signs))


def _joined_cylinders(elements, model):
    used = {node for item in elements for node in item.ports.values()}
    return [name for name in _cylinders(model) if any(f"{name}.{chamber}" in used for chamber in CHAMBERS)]


def _cylinders(model):
    return [name for name, force in model.forces.items() if isinstance(force.law, HydraulicCylinder)]


def _nodes(model):
    """Names of all nodes."""
    own = [name for name, item in model.hydraulics.items() if isinstance(item.element, AbstractNode)]
    return [*own, *(f"{name}.{chamber}" for name in _cylinders(model) for chamber in CHAMBERS)]


def circuit_faults(model: Model) -> list[str]:
    """Faults of the hydraulic circuits of a model."""
    found = [fault for item in model.hydraulics.values() for fault in element_faults(item, model)]
    for what, table in (("block", model.blocks), ("measure", model.measures), ("force", model.forces)):
        found += [f"hydraulic {name!r}: a {what} has this name" for name in model.hydraulics if name in table]
    elements = [
        item
        for item in model.hydraulics.values()
        if isinstance(item.element, AbstractHydraulicElement) and isinstance(item.ports, Mapping)
    ]
    used = {node for item in elements for node in item.ports.values() if isinstance(node, str)}
    for name, item in model.hydraulics.items():
        if isinstance(item.element, AbstractNode) and name not in used:
            found.append(f"hydraulic {name!r}: no port of an element is joined to it")
    for name in _cylinders(model):
        if any(f"{name}.{chamber}" in used for chamber in CHAMBERS):
            found += _cylinder_faults(name, model.forces[name].law)
    return found


def _cylinder_faults(name, law):
    if any_concrete(lambda gain: gain > 0, law.flow_gain):
        return [f"force {name!r}: a cylinder in a circuit has no valve of its own; leave valve and flow_gain out"]
    if law.inflow is not None:
        return [f"force {name!r}: the circuit gives its inflow; leave inflow out"]
    return []


def element_faults(item: Any, model: Model) -> list[str]:
    """Faults of one element or node of a circuit."""
    where, element = f"hydraulic {item.name!r}", item.element
    if not isinstance(element, AbstractHydraulicElement | AbstractNode):
        return [f"{where}: expected an element of jaxmbs.hydraulics, got {element!r}"]
    found = [f"{where}: {fault}" for fault in element.faults() or _shape_faults(element)]
    if isinstance(element, AbstractNode):
        if item.ports:
            found.append(f"{where}: it is a node and has no ports; give its name to the ports of elements")
        if item.signal is not None:
            found.append(f"{where}: a node takes no signal")
        if item.shaft is not None:
            found.append(f"{where}: a node is on no shaft")
        if not isinstance(element, AbstractStorage | Tank):
            found.append(f"{where}: a node is a Volume, an Accumulator or a Tank, or an AbstractStorage of yours")
        return found
    own = [*_port_faults(item, model), *_signal_faults(item), *_shaft_faults(item, model)]
    return [*found, *(f"{where}: {fault}" for fault in own)]


def _shape_faults(element):
    """Faults of an element whose flows, or of a node whose rates of states, are not one number each."""
    states, zero = {name: jnp.zeros(one.shape) for name, one in element.internal_states.items()}, jnp.zeros(())
    if isinstance(element, AbstractNode):
        what, num, ask = "rate", 1, lambda: sum(element.rate(zero, states, zero).values(), zero)
    else:
        given = jnp.zeros(len(element.ports) + (element.signal == "needed"))
        what, num, ask = "flows", element.num_outputs, lambda: element.output(given, states, zero)
    shape, faults = shape_of_signal(lambda: jnp.atleast_1d(ask()), most=4)
    return faults or faults_if((shape != (num,), f"its {what} have shape {shape}, not ({num},)"))


def _port_faults(item, model):
    ports, known, nodes = item.element.ports, item.ports, _nodes(model)
    if not isinstance(known, Mapping):
        return [f"ports must be a dict of nodes by port, {_example(ports)}, got {known!r}"]
    found = [no_such("port", port, ports) for port in known if port not in ports]
    found += [f"port {port!r} is open; join it to a node" for port in ports if port not in known]
    found += [f"port {p!r}: {no_such('node', node, nodes)}" for p, node in known.items() if node not in nodes]
    if found:
        return found
    joined = set(known.values())
    if len(joined) == 1:
        return [f"all its ports are joined to {joined.pop()!r}, so that nothing flows"]
    tanks = [name for name in joined if name in model.hydraulics and isinstance(model.hydraulics[name].element, Tank)]
    if len(tanks) == len(joined):
        names = ", ".join(sorted(tanks))
        return [f"it joins tanks alone ({names}), whose pressures no flow changes; put a Volume between them"]
    return []


def _signal_faults(item):
    kind, given = item.element.signal, item.signal
    if item.shaft is not None:
        return []
    if kind == "needed" and given is None:
        return [f"a {type(item.element).__name__} needs a signal: the name of one, a function of time or a number"]
    if kind == "none" and given is not None:
        return [f"a {type(item.element).__name__} takes no signal"]
    return []


def _shaft_faults(item, model):
    """Faults of the joint that a pump is on."""
    if item.shaft is None:
        return []
    if not isinstance(item.element, Pump):
        return [f"shaft= goes with a Pump, not with a {type(item.element).__name__}"]
    found = [] if item.signal is None else ["give its speed as a signal, or the joint of its shaft, not both"]
    if item.shaft not in model.joints:
        return [*found, f"shaft: {no_such('joint', item.shaft, model.joints)}"]
    if not has_one_coordinate(model.joints[item.shaft]):
        found.append(f"shaft: joint {item.shaft!r} does not have exactly one coordinate")
    tables = {**model.forces, **model.measures, **model.blocks, **model.hydraulics}
    taken = [name for name in shaft_names(item.name) if name in tables]
    return found + [f"its shaft needs the name {name!r}, which is taken; choose another there" for name in taken]


def _example(ports):
    return "{" + ", ".join(f'"{port}": "node"' for port in ports) + "}"
