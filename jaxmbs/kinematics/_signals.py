"""Signals at a configuration: measures, outputs of blocks in the order of the build, and what they drive.

Every function that asks the laws of a system for efforts or rates begins with `with_signals`; a system without blocks
is returned as it is.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
from jax import Array

from ..forces._signals import DrivenValue, Input
from ..model._internal_states import group_size, replace_field
from ..model._signals import BlockElement, drivers_of, law_of, with_law_field
from ..model._system import System
from ._configuration import Configuration, VelocityKinematics, at_rest
from ._instant import Instant


class BlockAt(NamedTuple):
    """A block whose driven fields have their values, its inputs u and states s by name."""

    block: Any
    u: Array
    s: dict[str, Array]


def signals_at(system: System, at: VelocityKinematics) -> dict[str, Array]:
    """Values by name: measures, outputs of blocks, internal states; the system is at its internal states."""
    return signals_and_blocks(system, at)[0]


def measured_at(system: System, at: VelocityKinematics) -> dict[str, Array]:
    """Measures and internal states by name."""
    instant = Instant(system, at)
    values = dict(instant.internal)
    for measure in system.measures:
        values[measure.name] = jnp.asarray(measure.function(instant), at.psi.dtype)
    return values


def signals_and_blocks(
    system: System, at: VelocityKinematics, starts: bool = False
) -> tuple[dict[str, Array], dict[str, BlockAt]]:
    """Values of all signals, and blocks with inputs and states, by name.

    Args: starts: at the states that the blocks start with.
    """
    values, drivers, blocks = measured_at(system, at), drivers_of(system), {}
    for element in system.blocks:
        block = with_driven_fields(element, drivers, values)
        u = block_inputs(element, values, at) if not element.is_early else no_inputs(element, at)
        s = _start(element, block, u, at) if starts else element.s or {}
        values |= {f"{element.name}.{name}": value for name, value in s.items()}
        values[element.name] = block_output(element, block, u, s, at)
        blocks[element.name] = BlockAt(block, u, s)
    for element in system.blocks:
        if element.is_early:
            found = blocks[element.name]
            block = with_driven_fields(element, drivers, values)
            blocks[element.name] = found._replace(block=block, u=block_inputs(element, values, at))
    return values, blocks


def block_output(element: BlockElement, block, u, s, at) -> Array:
    """Output of a block; that of a sampled one is held."""
    if element.period is not None:
        return s["output"]
    return jnp.asarray(block.output(u, s, at.t), at.psi.dtype).reshape(element.shape)


def with_driven_fields(element: BlockElement, drivers, values):
    """The block of an element with the values of those of its fields that other blocks drive; zero where they are not
    known yet, as its output does not depend on them."""
    block = element.block
    for field in block.inputs:
        source = drivers.get(f"{element.name}.{field}")
        if source is not None:
            value = _entry(values, source) if source[0] in values else jnp.zeros(())
            block = replace_field(block, field, DrivenValue(value))
    return block


def _entry(values, source):
    name, k = source
    return values[name] if k is None else values[name][k]


def block_inputs(element: BlockElement, values, at):
    """Inputs (n,) of a block, () for one scalar signal."""
    given = [
        jnp.asarray(element.functions[read](at.t), at.psi.dtype) if isinstance(read, int) else values[read]
        for read in element.reads
    ]
    if element.size is None:
        return given[0]
    return jnp.concatenate([jnp.zeros(0, at.psi.dtype), *(jnp.reshape(one, -1) for one in given)])


def no_inputs(element, at):
    """Zeros in place of the inputs of a block."""
    return jnp.zeros(() if element.size is None else element.size, at.psi.dtype)


def _start(element, block, u, at):
    given = block.start(u, at.t)
    found = {
        name: jnp.broadcast_to(jnp.asarray(given.get(name, 0.0), at.psi.dtype), shape)
        for name, shape, _ in element.internal
    }
    if element.period is not None:
        output = block.sample(u, found, at.t, element.period)[0]
        found["output"] = jnp.asarray(output, at.psi.dtype).reshape(element.shape)
    return found


def with_signals(system: System, at: Configuration) -> System:
    """The system whose driven fields have their values at a configuration, at rest where it has no velocities.

    The blocks are gone from it: what they drive has been found.
    """
    if not system.blocks:
        return system
    at = at if isinstance(at, VelocityKinematics) else at_rest(system, at)
    return with_driven(system, signals_at(system, at))


def with_driven(system: System, values: Mapping[str, Array]) -> System:
    """The system whose laws have the values of their driven fields, without its blocks."""
    drivers = drivers_of(system)
    groups = tuple(_with_driven_law(group, drivers, values) for group in system.forces)
    return replace_field(replace_field(system, "forces", groups), "blocks", ())


def _with_driven_law(group, drivers, values):
    law = group.law
    for field in law_of(law).inputs:
        sources = [drivers.get(f"{name}.{field}") for name in group.names]
        if all(source is not None for source in sources):
            law = with_law_field(law, field, DrivenValue(jnp.stack([_entry(values, source) for source in sources])))
    return group if law is group.law else replace_field(group, "law", law)


def block_rates(system: System, at: VelocityKinematics) -> list[Array]:
    """Rates of the states of each block that has some, in one vector each, in the order of the records."""
    return _rates(system, signals_and_blocks(system, at)[1], at)


def signals_and_rates(system: System, at: VelocityKinematics) -> tuple[dict[str, Array], list[Array]]:
    """Values of all signals, and the rates of the states of each block."""
    values, blocks = signals_and_blocks(system, at)
    return values, _rates(system, blocks, at)


def _rates(system, blocks, at):
    found = []
    for element in system.blocks:
        if element.period is not None:
            found.append(jnp.zeros(group_size(element), at.psi.dtype))
        elif element.internal:
            block, u, s = blocks[element.name]
            rates = block.rate(u, s, at.t)
            found += [jnp.asarray(rates[name], at.psi.dtype).reshape(-1) for name, *_ in element.internal]
    return found


def block_starts(system: System, at: VelocityKinematics) -> list[Array]:
    """Initial values of the states of the blocks; the laws of the system are at theirs."""
    blocks = signals_and_blocks(system, at, starts=True)[1]
    return [blocks[e.name].s[name].reshape(-1) for e in system.blocks for name, *_ in e.internal]


def with_inputs(system: System, values: Mapping[str, Any], replace: bool) -> System:
    """The system with values () of fields of force elements and blocks, "motor.voltage": in place of what is there,
    or added to it."""
    groups, blocks = list(system.forces), list(system.blocks)
    for name, value in values.items():
        element, _, field = name.rpartition(".")
        for k, group in enumerate(groups):
            if element in group.names:
                groups[k] = _with_input(group, group.names.index(element), field, value, replace)
        for k, block in enumerate(blocks):
            if block.name == element:
                given = Input(getattr(block.block, field), jnp.asarray(value), jnp.asarray(replace))
                blocks[k] = replace_field(block, "block", replace_field(block.block, field, given))
    return replace_field(replace_field(system, "forces", tuple(groups)), "blocks", tuple(blocks))


def _with_input(group, k, field, value, replace):
    here = jnp.arange(len(group.names)) == k
    given = Input(getattr(law_of(group.law), field), jnp.where(here, value, 0.0), here & replace)
    return replace_field(group, "law", with_law_field(group.law, field, given))
