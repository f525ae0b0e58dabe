"""Shapes of signals, found by one abstract evaluation of measures and blocks in order, with the faults it shows."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp

from ..forces import AbstractSystemLaw
from ..forces._ports import JointPort, LinePort, SystemPort, port_of
from ..forces._signals import DrivenValue
from ..friction._joint_friction import bristle_groups
from ..kinematics._configuration import configuration, with_velocities
from ..kinematics._poses import neutral_coordinates, node_parameters
from ..model._internal_states import internal_records, replace_field
from ..model._signals import drivers_of, drives_by_field
from ..model._system import System
from ..runtime import explain_error
from ..signal_flow._instant import Instant
from ._block_groups import BlockItem, block_groups
from ._law_faults import law_call_faults, named_faults


def with_blocks(system: System, items: list[BlockItem], forces) -> tuple[System, list[str]]:
    """The system with its blocks, which know the shapes of their outputs and the sizes of their inputs, and with
    measures that know the internal states that they read; faults of measures, of blocks, and of laws at the values
    that drive them."""
    shapes, drivers = {}, {}
    for item in items:
        drivers |= drives_by_field(item.name, item.drives)
    records = internal_records((*system.forces, *bristle_groups(system.friction), *map(_layout, items)))
    system, faults = _with_read_states(system, records, shapes)
    for item in items:
        if item.is_early:  # the output does not depend on the inputs
            shapes[item.name] = _shape_of_output(item, None, shapes, drivers)[0]
    found = {}
    for item in sorted(items, key=lambda item: item.is_early):  # what these read comes after them
        found[item.name], wrong = _with_shapes(item, shapes, drivers)
        faults += [f"block {item.name!r}: {fault}" for fault in wrong]
    groups = block_groups([found[item.name] for item in items])
    records = internal_records((*system.forces, *bristle_groups(system.friction), *groups))
    topology = dataclasses.replace(system.topology, internal=records)
    system = replace_field(replace_field(system, "blocks", groups), "topology", topology)
    return system, faults or _driven_law_faults(system, forces, shapes)


class _Layout(NamedTuple):
    """Names and (name, shape, unit) of internal states."""

    names: tuple[str, ...]
    internal: tuple


def _layout(item):
    return _Layout((item.name,), item.internal)


def _with_read_states(system, records, shapes):
    """The system whose measures know the internal states that they read, and their faults; adds shapes of both."""
    top, faults, measures = system.topology, [], []

    def evaluate():
        psi = jnp.asarray(neutral_coordinates(top), float)
        at = configuration(system, node_parameters(system), psi, jnp.zeros(()), inertias=False)
        at = with_velocities(system, at, jnp.zeros(top.num_velocities))
        instant = Instant(system, at)
        states = {record.name: jnp.zeros(record.shape) for record in records}
        shapes.update({name: value.shape for name, value in states.items()})
        for group in system.measures:
            instant.internal = reads = _ReadStates(states)
            shape, wrong = shape_of_signal(lambda group=group: group.reading.values(instant, group.places)[0])
            faults.extend(f"measure {name!r}: {fault}" for name in group.names for fault in wrong)
            shapes.update(dict.fromkeys(group.names, shape))
            measures.append(replace_field(group, "internal", tuple(sorted(reads.names))))
        return jnp.zeros(())

    jax.eval_shape(evaluate)
    return replace_field(system, "measures", tuple(measures)), faults


class _ReadStates(Mapping):
    """Internal states by name that keeps the names of those that were read."""

    def __init__(self, states):
        self._states, self.names = states, set()

    def __getitem__(self, name):
        self.names.add(name)
        return self._states[name]

    def __iter__(self):
        return iter(self._states)

    def __len__(self):
        return len(self._states)


def shape_of_signal(call, most=1):
    """(shape, faults) of a signal: one number or (n,)."""
    try:
        found = jax.eval_shape(lambda: jnp.asarray(call(), float)).shape
    except Exception as error:  # noqa: BLE001 - the user's own code
        return (), [f"it cannot be evaluated: {explain_error(error)}"]
    if len(found) > most:
        return (), [f"it has shape {found}; a signal is one number or (n,)"]
    return found, []


def _shape_of_output(item, size, shapes, drivers):
    block = _with_zeros(item, shapes, drivers)
    u, s, t = jnp.zeros(() if size is None else size), _zeros(item), jnp.zeros(())
    return shape_of_signal(lambda: block.output(u, s, t))


def _with_shapes(item, shapes, drivers):
    """(the item with its sizes, its faults)."""
    sizes = []
    for read in item.reads:
        shape, wrong = (
            (shapes.get(read, ()), [])
            if isinstance(read, str)
            else shape_of_signal(lambda read=read: item.functions[read](jnp.zeros(())))
        )
        if wrong:
            return item, [f"a function of time that it reads: {fault}" for fault in wrong]
        sizes.append(shape)
    alone = len(sizes) == 1 and sizes[0] == ()
    size = None if alone else sum(shape[0] if shape else 1 for shape in sizes)
    if item.mix is not None:
        size = None if len(item.mix) == 1 else len(item.mix)
    shape, faults = _shape_of_output(item, size, shapes, drivers)
    shapes[item.name] = shape
    item = item._replace(shape=shape, size=size)
    faults = [f"its output: {fault}" for fault in faults] + _state_faults(item, size, shapes, drivers)
    if len(item.drives) > 1 and not faults and shape != (len(item.drives),):
        faults.append(f"its output has shape {shape}; it drives {len(item.drives)} fields, one entry each")
    return _with_output_shape(item), faults


def _with_output_shape(item):
    """The item with the shape of the output that a sampled block holds among its states."""
    if item.period is None:
        return item
    return item._replace(internal=(*item.internal[:-1], ("output", item.shape, "")))


def _state_faults(item, size, shapes, drivers):
    """Faults of start and rate of a block."""
    block, declared = _with_zeros(item, shapes, drivers), item.block.internal_states
    u, s, t = jnp.zeros(() if size is None else size), _zeros(item), jnp.zeros(())
    found = named_faults("start", lambda: block.start(u, t), declared, False)
    if item.period is None:
        return named_faults("rate", lambda: block.rate(u, s, t), declared, True) + found
    found += named_faults("sample", lambda: block.sample(u, s, t, item.period)[1], declared, True)
    shape, wrong = shape_of_signal(lambda: block.sample(u, s, t, item.period)[0])
    if not wrong and shape != item.shape:
        wrong = [f"it has shape {shape}, that of `output` has {item.shape}"]
    return found + [f"the output of its sample: {fault}" for fault in wrong]


def _zeros(item):
    return {name: jnp.zeros(shape) for name, shape, _ in item.internal}


def _with_zeros(item, shapes, drivers):
    """The block whose driven fields are zero."""
    block = item.block
    for field in block.inputs:
        source = drivers.get(f"{item.name}.{field}")
        if source is not None:
            block = replace_field(block, field, DrivenValue(_zero_of(source, shapes)))
    return block


def _zero_of(source, shapes):
    name, k = source
    shape = shapes.get(name, ())
    return jnp.zeros(shape if k is None else shape[1:])


def _driven_law_faults(system, forces, shapes):
    """Faults of the laws at values of the shapes that drive them."""
    drivers, top, found = drivers_of(system.blocks), system.topology, []
    for item in forces.values():
        law = item.law
        fields = [field for field in law.inputs if f"{item.name}.{field}" in drivers]
        for field in fields:
            law = replace_field(law, field, DrivenValue(_zero_of(drivers[f"{item.name}.{field}"], shapes)))
        if fields:
            port, place, size = _port(law, item.joint is not None, top)
            found += [f"force {item.name!r}: driven by a block, {f}" for f in law_call_faults(law, port, place, size)]
    return found


def _port(law, on_joint, top):
    """(port, displacement, number of flows) for an abstract call of a law."""
    if isinstance(law, AbstractSystemLaw):
        return SystemPort(), (jnp.zeros(top.num_coordinates),), top.num_velocities
    port, place = JointPort() if on_joint else port_of(law), (jnp.eye(3), jnp.zeros(3))
    displacement = {LinePort: place[1:], JointPort: (jnp.zeros(()),)}.get(type(port), place)
    return port, displacement, port.num_flows
