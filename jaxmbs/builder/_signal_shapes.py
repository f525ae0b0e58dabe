"""Shapes of signals, found by one abstract evaluation of measures and blocks in order, with the faults it shows."""

import dataclasses

import jax
import jax.numpy as jnp

from ..forces import AbstractSystemLaw, AbstractSystemStateLaw
from ..forces._ports import JointPort, LinePort, SystemPort, port_of
from ..forces._signals import DrivenValue
from ..kinematics._configuration import configuration, with_velocities
from ..kinematics._instant import Instant
from ..kinematics._poses import neutral_coordinates, node_parameters
from ..model._internal_states import internal_records, replace_field, with_internal
from ..model._signals import drivers_of
from ..model._system import System
from ..runtime import explain_error
from ._law_faults import law_call_faults, named_faults


def with_signal_shapes(system: System, forces) -> tuple[System, list[str]]:
    """The system whose blocks know the shapes of their outputs and the sizes of their inputs, and whose measures know
    the internal states that they read; faults of measures, of blocks, and of laws at the values that drive them."""
    top, faults, shapes, measures = system.topology, [], {}, []

    def evaluate():
        psi = jnp.asarray(neutral_coordinates(top), float)
        at = configuration(system, node_parameters(system), psi, jnp.zeros(()), inertias=False)
        at = with_velocities(system, at, jnp.zeros(top.num_velocities))
        internal = jnp.zeros(top.num_internal)
        instant = Instant(with_internal(system, internal), at)
        states = instant.internal if top.internal else {}
        shapes.update({name: value.shape for name, value in states.items()})
        for measure in system.measures:
            instant.internal = reads = _ReadStates(states)
            shape, wrong = _shape_of(lambda measure=measure: measure.function(instant))
            faults.extend(f"measure {measure.name!r}: {fault}" for fault in wrong)
            shapes[measure.name] = shape
            measures.append(replace_field(measure, "internal", tuple(sorted(reads.names))))
        return jnp.zeros(())

    jax.eval_shape(evaluate)
    drivers = drivers_of(system)
    for element in sorted(system.blocks, key=lambda element: not element.is_early):
        if element.is_early:  # the output does not depend on the inputs
            shapes[element.name] = _shape_of_output(element, None, shapes, drivers)[0]
    blocks = {}
    for element in sorted(system.blocks, key=lambda element: element.is_early):  # what these read comes after them
        blocks[element.name], wrong = _with_shapes(element, shapes, drivers)
        faults += [f"block {element.name!r}: {fault}" for fault in wrong]
    blocks = tuple(blocks[element.name] for element in system.blocks)
    system = replace_field(replace_field(system, "blocks", blocks), "measures", tuple(measures))
    system = _with_output_states(system)
    return system, faults or _driven_law_faults(system, forces, shapes)


class _ReadStates(dict):
    """Internal states by name that keeps the names of those that were read."""

    def __init__(self, states):
        super().__init__(states)
        self.names = set()

    def __getitem__(self, name):
        self.names.add(name)
        return super().__getitem__(name)

    def get(self, name, default=None):
        return self[name] if name in self else default

    def __iter__(self):
        self.names.update(self.keys())
        return super().__iter__()

    def values(self):
        self.names.update(self.keys())
        return super().values()

    def items(self):
        self.names.update(self.keys())
        return super().items()


def _with_output_states(system):
    """The system whose records of internal states have the shapes of the outputs that sampled blocks hold."""
    if all(element.period is None or element.shape == () for element in system.blocks):
        return system
    blocks = [
        element if element.period is None else replace_field(element, "internal", _with_output(element))
        for element in system.blocks
    ]
    records = internal_records((*system.forces, *blocks))
    topology = dataclasses.replace(system.topology, internal=records)
    return replace_field(replace_field(system, "blocks", tuple(blocks)), "topology", topology)


def _with_output(element):
    return (*element.internal[:-1], ("output", element.shape, ""))


def _shape_of(call, most=1):
    """(shape, faults) of a signal: one number or (n,)."""
    try:
        found = jax.eval_shape(lambda: jnp.asarray(call(), float)).shape
    except Exception as error:  # noqa: BLE001 - the user's own code
        return (), [f"it cannot be evaluated: {explain_error(error)}"]
    if len(found) > most:
        return (), [f"it has shape {found}; a signal is one number or (n,)"]
    return found, []


def _shape_of_output(element, size, shapes, drivers):
    block = _with_zeros(element, shapes, drivers)
    u, s, t = jnp.zeros(() if size is None else size), _zeros(element), jnp.zeros(())
    return _shape_of(lambda: block.output(u, s, t))


def _with_shapes(element, shapes, drivers):
    """(the element with its sizes, its faults)."""
    sizes = []
    for read in element.reads:
        shape, wrong = (
            (shapes.get(read, ()), [])
            if isinstance(read, str)
            else _shape_of(lambda read=read: element.functions[read](jnp.zeros(())))
        )
        if wrong:
            return element, [f"a function of time that it reads: {fault}" for fault in wrong]
        sizes.append(shape)
    alone = len(sizes) == 1 and sizes[0] == ()
    size = None if alone else sum(shape[0] if shape else 1 for shape in sizes)
    shape, faults = _shape_of_output(element, size, shapes, drivers)
    shapes[element.name] = shape
    element = replace_field(element, "shape", shape)
    faults = [f"its output: {fault}" for fault in faults] + _state_faults(element, size, shapes, drivers)
    if len(element.drives) > 1 and not faults and shape != (len(element.drives),):
        faults.append(f"its output has shape {shape}; it drives {len(element.drives)} fields, one entry each")
    return replace_field(element, "size", size), faults


def _state_faults(element, size, shapes, drivers):
    """Faults of start and rate of a block."""
    block, declared = _with_zeros(element, shapes, drivers), element.block.internal_states
    u, s, t = jnp.zeros(() if size is None else size), _zeros(element), jnp.zeros(())
    found = named_faults("start", lambda: block.start(u, t), declared, False)
    if element.period is None:
        return named_faults("rate", lambda: block.rate(u, s, t), declared, True) + found
    found += named_faults("sample", lambda: block.sample(u, s, t, element.period)[1], declared, True)
    shape, wrong = _shape_of(lambda: block.sample(u, s, t, element.period)[0])
    if not wrong and shape != element.shape:
        wrong = [f"it has shape {shape}, that of `output` has {element.shape}"]
    return found + [f"the output of its sample: {fault}" for fault in wrong]


def _zeros(element):
    return {name: jnp.zeros(shape) for name, shape, _ in element.internal}


def _with_zeros(element, shapes, drivers):
    """The block whose driven fields are zero."""
    block = element.block
    for field in block.inputs:
        source = drivers.get(f"{element.name}.{field}")
        if source is not None:
            block = replace_field(block, field, DrivenValue(_zero_of(source, shapes)))
    return block


def _zero_of(source, shapes):
    name, k = source
    shape = shapes.get(name, ())
    return jnp.zeros(shape if k is None else shape[1:])


def _driven_law_faults(system, forces, shapes):
    """Faults of the laws at values of the shapes that drive them."""
    drivers, top, found = drivers_of(system), system.topology, []
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
    if isinstance(law, AbstractSystemLaw | AbstractSystemStateLaw):
        return SystemPort(), (jnp.zeros(top.num_coordinates),), top.num_velocities
    port, place = JointPort() if on_joint else port_of(law), (jnp.eye(3), jnp.zeros(3))
    displacement = {LinePort: place[1:], JointPort: (jnp.zeros(()),)}.get(type(port), place)
    return port, displacement, port.num_flows
