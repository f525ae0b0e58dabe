"""Signals at a configuration: measures, outputs of blocks in the order of the build, and what they drive.

Every function that asks the laws of a system for efforts or rates begins with `with_signals`; without blocks, or
where they are known, the configuration is returned as it is.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..forces._signals import DrivenValue, Input
from ..kinematics._configuration import At, Configuration, VelocityKinematics, at_rest
from ..model._internal_states import group_size, join_states, replace_field
from ..model._signals import BlockGroup, BlocksAt, Signals, drivers_of
from ..model._system import System
from ..runtime import constant_product
from ._instant import Instant
from ._signal_values import SignalValues


def signals_at(system: System, at: VelocityKinematics) -> SignalValues:
    """Values by name: measures, outputs of blocks, internal states."""
    return signals_and_blocks(system, at)[0]


def measured_at(system: System, at: VelocityKinematics) -> SignalValues:
    """Measures and internal states by name."""
    instant = Instant(system, at)
    values = SignalValues(instant.internal, at.psi.dtype)
    for group in system.measures:
        values.add(group.names, group.reading.values(instant, group.places))
    return values


def signals_and_blocks(
    system: System, at: VelocityKinematics, starts: bool = False
) -> tuple[SignalValues, list[BlocksAt]]:
    """Values of all signals, and the groups of blocks with inputs and states.

    Args: starts: at the states that the blocks start with.
    """
    values, drivers, blocks = measured_at(system, at), drivers_of(system.blocks), []
    for k, group in enumerate(system.blocks):
        block = driven_block(group, drivers, values)
        u = block_inputs(group, values, at.t) if not group.is_early else no_inputs(group, at)
        s = _start(group, block, u, at) if starts else block_states(at, k)
        if starts:
            for name, value in s.items():
                values.add([f"{block_name}.{name}" for block_name in group.names], value)
        values.add(group.names, block_outputs(group, block, u, s, at))
        blocks.append(BlocksAt(group, block, u, s))
    for k, (group, *_) in enumerate(blocks):
        if group.is_early:
            block = driven_block(group, drivers, values)
            blocks[k] = blocks[k]._replace(block=block, u=block_inputs(group, values, at.t))
    return values, blocks


def block_states(at: Configuration, k: int) -> dict[str, Array]:
    """States (n, *shape) by name of the k-th group of blocks, none where they are not given."""
    return {} if at.s is None else at.s.blocks[k]


def block_outputs(group: BlockGroup, block, u, s, at) -> Array:
    """Outputs (n, ...) of a group of blocks; those of sampled ones are held."""
    if group.period is not None:
        return s["output"]
    return of_each(group, lambda *x: jnp.reshape(x[0].output(*x[1:], at.t), group.shape), block, u, s)


def of_each(group: BlockGroup, call, *args):
    """A function of every block of a group."""
    return jax.vmap(call, axis_size=len(group.names))(*args)


def with_driven_fields(law: Any, driven: Mapping[str, Array]) -> Any:
    """The laws or blocks of a group with values (n, ...) of fields by name."""
    for field, values in driven.items():
        law = replace_field(law, field, DrivenValue(values))
    return law


def driven_block(group: BlockGroup, drivers, values: SignalValues) -> Any:
    """The blocks of a group with the values of those of their fields that other blocks drive; zero where they are not
    known yet, as the outputs do not depend on them."""
    return with_driven_fields(group.block, _driven_fields(group.names, group.block, drivers, values))


def _driven_fields(names, law, drivers, values):
    """Values (n, ...) by name of the fields of laws or blocks that other blocks drive."""
    fields = {}
    for field in law.inputs:
        sources = [drivers.get(f"{name}.{field}") for name in names]
        if all(source is not None for source in sources):
            known = all(source[0] in values for source in sources)
            fields[field] = _values_of(values, sources) if known else jnp.zeros(len(sources))
    return fields


def _values_of(values, sources):
    """Values (n, ...) of (block, entry of its output) for each element of a group."""
    shape = values.shape(sources[0][0]) if sources[0][1] is None else ()
    return values.take(np.concatenate([values.entries(*source) for source in sources])).reshape(-1, *shape)


def block_inputs(group: BlockGroup, values: SignalValues, t) -> Array:
    """Inputs (n, k) of a group of blocks, (n,) where each is one scalar signal."""
    for k, function in enumerate(group.functions):
        given = of_each(group, lambda function: jnp.asarray(function(t)), function)
        values.add([_function_name(name, k) for name in group.names], given)
    places = [
        np.concatenate([np.zeros(0, int), *(_entries(values, name, read) for read in reads)])
        for name, reads in zip(group.names, group.reads, strict=True)
    ]
    inputs = values.take(np.concatenate(places))
    if group.mix is not None:
        inputs = constant_product(_mixing(group.mix), inputs)
    return inputs.reshape(len(group.names), *(() if group.size is None else (group.size,)))


def _function_name(name, k):
    """Of a function of time among the signals; no declared signal has this name."""
    return f"{name}.{k} of time"


def _entries(values, name, read):
    return values.entries(_function_name(name, read) if isinstance(read, int) else read)


def _mixing(mix):
    """Matrix (inputs of all blocks, all that they read) of the factors of each block."""
    rows, columns = sum(len(factors) for factors in mix), sum(len(factors[0]) for factors in mix)
    matrix, row, column = np.zeros((rows, columns)), 0, 0
    for factors in mix:
        matrix[row : row + len(factors), column : column + len(factors[0])] = factors
        row, column = row + len(factors), column + len(factors[0])
    return matrix


def no_inputs(group: BlockGroup, at):
    """Zeros in place of the inputs of a group of blocks."""
    return jnp.zeros((len(group.names), *(() if group.size is None else (group.size,))), at.psi.dtype)


def _start(group, block, u, at):
    def of_one(block, u, period):
        given = block.start(u, at.t)
        starts = {
            name: jnp.broadcast_to(jnp.asarray(given.get(name, 0.0), at.psi.dtype), shape)
            for name, shape, _ in group.internal
        }
        if period is not None:
            output = block.sample(u, starts, at.t, period)[0]
            starts["output"] = jnp.asarray(output, at.psi.dtype).reshape(group.shape)
        return starts

    return of_each(group, of_one, block, u, group.period)


def with_signals(system: System, at: At) -> At:
    """The configuration with the signals of its blocks, at rest where it has no velocities."""
    if not system.blocks or at.signals is not None:
        return at
    values, blocks = signals_and_blocks(system, at if isinstance(at, VelocityKinematics) else at_rest(system, at))
    drivers = drivers_of(system.blocks)
    driven = (_driven_fields(group.names, group.law, drivers, values) for group in system.forces)
    return dataclasses.replace(at, signals=Signals(tuple(driven), tuple(blocks)))


def with_idle_blocks(system: System) -> System:
    """The system with zeros where blocks drive its laws, for its picture as a graph."""
    values, drivers = SignalValues({}, jnp.result_type(float)), drivers_of(system.blocks)
    for group in system.blocks:
        values.add(group.names, jnp.zeros((len(group.names), *group.shape)))
    driven = (_driven_fields(group.names, group.law, drivers, values) for group in system.forces)
    laws = (with_driven_fields(group.law, fields) for group, fields in zip(system.forces, driven, strict=True))
    groups = (replace_field(group, "law", law) for group, law in zip(system.forces, laws, strict=True))
    return replace_field(replace_field(system, "forces", tuple(groups)), "blocks", ())


def block_rates(blocks: Iterable[BlocksAt], at: VelocityKinematics) -> list[Array]:
    """Rates of the states of each group of blocks that has some, in one vector each, in the order of the records."""
    rates = []
    for group, block, u, s in blocks:
        if group.period is not None:
            rates.append(jnp.zeros(len(group.names) * group_size(group), at.psi.dtype))
        elif group.internal:
            rates.append(join_states(group, _rates_of_group(group, block, u, s, at)))
    return rates


def _rates_of_group(group, block, u, s, at):
    def of_one(block, u, s):
        rates = block.rate(u, s, at.t)
        return {name: jnp.asarray(rates[name], at.psi.dtype).reshape(shape) for name, shape, _ in group.internal}

    return of_each(group, of_one, block, u, s)


def block_starts(system: System, at: VelocityKinematics) -> list[Array]:
    """Initial values of the states of each group of blocks, at a configuration with those of laws."""
    blocks = signals_and_blocks(system, at, starts=True)[1]
    return [join_states(each.group, each.s) for each in blocks if each.group.internal]


def with_inputs(system: System, values: Mapping[str, Any], replace: bool) -> System:
    """The system with values () of fields of force elements and blocks, "motor.voltage": in place of what is there,
    or added to it."""
    groups, blocks = list(system.forces), list(system.blocks)
    for name, value in values.items():
        element, _, field = name.rpartition(".")
        for k, group in enumerate(groups):
            if element in group.names:
                given = _input(group, element, getattr(group.law, field), value, replace)
                groups[k] = replace_field(group, "law", replace_field(group.law, field, given))
        for k, block in enumerate(blocks):
            if element in block.names:
                given = _input(block, element, getattr(block.block, field), value, replace)
                blocks[k] = replace_field(block, "block", replace_field(block.block, field, given))
    return replace_field(replace_field(system, "forces", tuple(groups)), "blocks", tuple(blocks))


def _input(group, element, function, value, replace):
    """A field of a group's law or block with a value for one element."""
    chosen = jnp.arange(len(group.names)) == group.names.index(element)
    return Input(function, jnp.where(chosen, value, 0.0), chosen & replace)
