"""Measures and blocks of a declared model: their faults, their order, and their place in the system."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..blocks import AbstractBlock
from ..blocks._base import block_layout
from ..blocks._readings import (
    AXES,
    OF_FRAME,
    OF_FRAMES,
    OF_JOINT,
    REFUSED,
    FrameReading,
    JointReading,
    RelativeReading,
)
from ..checks import any_concrete, faults_if, is_concrete, no_such
from ..forces._fields import as_function, number
from ..forces._signals import Constant, Driven, as_signal
from ..forces._state_laws import internal_layout
from ..model._internal_states import replace_field
from ..model._signals import BlockElement, Measure
from ._declarations import Model, resolve_frame
from ._law_faults import declared_state_faults

_MOST_PERIODS = 8  # each adds its own samples, at which steps end


def measure_faults(item, model: Model, reference_faults) -> list[str]:
    """Faults of one measure.  Args: reference_faults: those of a reference to a frame, of (where, reference)."""
    where = f"measure {item.name!r}"
    given = [name for name in ("function", "joint", "between", "on") if getattr(item, name) is not None]
    if len(given) != 1:
        return [f"{where}: give one of a function, joint=, between=, on=, got {', '.join(given) or 'none'}"]
    if item.function is not None:
        return _function_faults(where, item)
    wanted = {"joint": OF_JOINT, "on": OF_FRAME, "between": OF_FRAMES}[given[0]]
    found = []
    if item.of in REFUSED:
        found.append(f"{where}: {_refusal(item.of)}")
    elif item.of not in wanted:
        found.append(f"{where}: of a measure {given[0]}= is {' or '.join(map(repr, wanted))}, got {item.of!r}")
    is_vector = given[0] != "joint" and item.of not in ("distance", "distance rate")
    if item.axis is not None and (not is_vector or item.axis not in AXES):
        found.append(f"{where}: axis is 'x', 'y' or 'z' of a vector between or on frames, got {item.axis!r}")
    if item.joint is not None and item.joint not in model.joints:
        found.append(f"{where}: {no_such('joint', item.joint, model.joints)}")
    if item.between is not None and (not isinstance(item.between, tuple | list) or len(item.between) != 2):
        return [*found, f"{where}: between= takes two frames, got {item.between!r}"]
    ends = item.between if item.between is not None else () if item.on is None else (item.on,)
    return found + [fault for end in ends for fault in reference_faults(where, end)]


def _refusal(of):
    return (
        f"{of!r} is no signal, as it follows from what blocks drive at the same instant (an algebraic loop): "
        f"{REFUSED[of]}"
    )


def _function_faults(where, item):
    if item.axis is not None:
        return [f"{where}: axis= goes with frames, not with a function"]
    try:
        as_function(item.function)
    except TypeError as error:
        return [f"{where}: {error}"]
    return []


def block_faults(model: Model) -> list[str]:
    """Faults of all blocks: values, names of what they read and drive, several on one field, algebraic loops."""
    found, owners = [], {}
    names = {*model.measures, *model.blocks}
    states = {f"{name}.{s}" for name, s in _state_names(model)}
    for item in model.blocks.values():
        where = f"block {item.name!r}"
        found += _name_faults(where, item, model)
        if not isinstance(item.block, AbstractBlock):
            found.append(f"{where}: {item.block!r} is no block such as PI(...), or Function(f) of a function f(u, t)")
            continue
        found += [f"{where}: {fault}" for fault in item.block.faults() + declared_state_faults(item.block, True)]
        for read in reads_of(item):
            found += [f"{where}: {fault}" for fault in _read_faults(item, read, names, states, model)]
        for name in drives_of(item):
            field, fault = _field_of(name, model)
            if fault is None and field.rpartition(".")[0] == item.name:
                fault = f"drives its own field {field!r}; a block does not drive itself"
            if fault is None and field in owners:
                fault = f"drives {field!r}, which block {owners[field]!r} drives already: add both in a Function"
            if fault is not None:
                found.append(f"{where}: {fault}")
            else:
                owners[field] = item.name
        found += [f"{where}: {fault}" for fault in _sampling_faults(item)]
    found += _rhythm_faults(model)
    found += [fault for field in owners for fault in _given_value_faults(field, model)]
    return found or _loop_faults(model)


def _sampling_faults(item):
    """Faults of `every=` and of the sampled form of a block."""
    if item.every is None:
        return []
    if not _is_real(item.every):
        return [f"every= takes a period in seconds, got {item.every!r}"]
    if any_concrete(lambda x: ~(np.isfinite(x) & (x > 0.0)), item.every):
        return [f"every= must be a positive period in seconds, got {item.every}"]
    kind, states = type(item.block).__name__, [name for name, *_ in block_layout(item.block)]
    return [
        *item.block.sampling_faults(item.every),
        *faults_if(
            (
                not item.block.has_sampled_form,
                f"{kind} has states and no sampled form: define `sample(u, s, t, period)`",
            ),
            (
                "output" in states,
                "a sampled block holds its output as the state 'output': call its own state otherwise",
            ),
        ),
    ]


def _is_real(value):
    if isinstance(value, bool) or not isinstance(value, int | float | np.number | np.ndarray | jax.Array):
        return False
    return np.shape(value) == () and np.dtype(jnp.result_type(value)).kind in "iuf"


def _rhythm_faults(model):
    different = len(set(_rhythms(model).values()))
    listed = ", ".join(str(item.every) for item in model.blocks.values() if item.every is not None)
    return faults_if(
        (
            different > _MOST_PERIODS,
            f"blocks are sampled with {different} different periods ({listed}), and a motion takes "
            f"{_MOST_PERIODS}: give blocks the same period",
        )
    )


def _rhythms(model) -> dict[str, int]:
    """Number of its period among the different ones, of each sampled block."""
    found: dict[str, int] = {}
    keys: list[Any] = []
    for item in model.blocks.values():
        if item.every is not None and _is_real(item.every):
            key = float(item.every) if is_concrete(item.every) else id(item.every)
            keys += [] if key in keys else [key]
            found[item.name] = keys.index(key)
    return found


def _name_faults(where, item, model):
    tables = {"force": model.forces, "measure": model.measures}
    found = [f"{where}: a {what} has this name" for what, table in tables.items() if item.name in table]
    return found + faults_if(("." in item.name, f"{where}: a name with a dot is that of a state or field"))


def _state_names(model):
    for item in (*model.forces.values(), *model.blocks.values()):
        part = item.law if hasattr(item, "law") else item.block
        try:
            layout = block_layout(part) if isinstance(part, AbstractBlock) else internal_layout(part)
        except Exception:  # noqa: BLE001 - reported with the part itself
            continue
        yield from ((item.name, name) for name, *_ in layout)


def reads_of(item) -> tuple:
    """Signals that a block reads, one after another."""
    return tuple(item.reads) if isinstance(item.reads, tuple | list) else (item.reads,)


def drives_of(item) -> tuple:
    """Names of the fields that a block drives."""
    if item.drives is None:
        return ()
    return tuple(item.drives) if isinstance(item.drives, tuple | list) else (item.drives,)


def _read_faults(item, read, names, states, model):
    if callable(read) and not isinstance(read, type):
        return []
    if not isinstance(read, str):
        return [f"reads= takes names of signals and functions of time, got {read!r}"]
    if read == item.name:
        return ["reads its own output; its states belong into its `rate`"]
    if read in names or read in states:
        return []
    if read in model.joints:
        return [f"reads {read!r}, a joint: b.measure({read!r}, joint={read!r}, of='velocity') makes a signal of it"]
    if read.rpartition(".")[2] in REFUSED:
        return [_refusal(read.rpartition(".")[2])]
    return [no_such("signal", read, sorted({*names, *states}))]


def _field_of(name, model):
    """(the full name "motor.voltage" of a driven field, None), or (None, fault)."""
    if not isinstance(name, str):
        return None, f"drives= takes names of force elements and their fields, got {name!r}"
    owners = {key: item.block for key, item in model.blocks.items()}
    owners |= {key: item.law for key, item in model.forces.items()}
    element, _, field = (name, "", "") if name in owners else name.rpartition(".")
    if element not in owners:
        return None, f"drives {name!r}: {no_such('force or block', element or name, owners)}"
    inputs = getattr(owners[element], "inputs", ())
    kind = type(owners[element]).__name__
    if not inputs:
        return None, f"drives {name!r}: {kind} has no field that can be driven; those of Motor, Actuator, Force can"
    if not field and len(inputs) > 1:
        return None, f"drives {name!r}: name one of its fields, {' or '.join(f'{element}.{one}' for one in inputs)}"
    if field and field not in inputs:
        return None, f"drives {name!r}: {no_such('field to drive', field, inputs)}"
    return f"{element}.{field or inputs[0]}", None


def _given_value_faults(field, model):
    """A field that is driven has no value of its own beside it."""
    element, _, name = field.rpartition(".")
    item = model.forces.get(element)
    value = getattr(item.law if item is not None else model.blocks[element].block, name)
    what = "force" if item is not None else "block"
    is_zero = isinstance(value, Constant) and not any_concrete(lambda x: x != 0, value.value)
    return faults_if(
        (not is_zero, f"{what} {element!r}: a block drives its {name}; give 0.0 there in place of a value")
    )


def driven_fields(model: Model) -> dict[str, str]:
    """The block that drives each field."""
    return {_field_of(name, model)[0]: item.name for item in model.blocks.values() for name in drives_of(item)}


def evaluation_order(model: Model) -> tuple[list[tuple[str, bool]], list[str]]:
    """((name, True if its output is evaluated before its inputs) of all blocks in order, blocks left in a loop)."""
    drivers = driven_fields(model)
    needs = {}
    for item in model.blocks.values():
        read = {one for one in reads_of(item) if isinstance(one, str) and one in model.blocks}
        needs[item.name] = read | {
            drivers[f"{item.name}.{field}"] for field in item.block.inputs if f"{item.name}.{field}" in drivers
        }
    order: list[tuple[str, bool]] = []
    while len(order) < len(needs):
        done = {name for name, _ in order}
        left = [name for name in needs if name not in done]
        free = [name for name in left if needs[name] <= done]
        early = [name for name in left if not _feeds_through(model.blocks[name])]
        if not free and not early:
            return order, left
        order.append((free[0], False) if free else (early[0], True))
    return order, []


def _feeds_through(item):
    return item.every is None and item.block.is_feedthrough


def _loop_faults(model):
    left = evaluation_order(model)[1]
    if not left:
        return []
    return [
        f"blocks {', '.join(map(repr, left))}: their outputs depend on each other at the same instant (an algebraic "
        "loop): put a block with a state on the way, FirstOrder(time_constant), sample one, or join them in one"
    ]


def with_driven_fields(model: Model) -> Model:
    """The model whose driven fields are placeholders."""
    forces, blocks = dict(model.forces), dict(model.blocks)
    for field in driven_fields(model):
        element, _, name = field.rpartition(".")
        if element in forces:
            law = replace_field(forces[element].law, name, Driven())
            forces[element] = dataclasses.replace(forces[element], law=law)
        else:
            block = replace_field(blocks[element].block, name, Driven())
            blocks[element] = dataclasses.replace(blocks[element], block=block)
    return dataclasses.replace(model, forces=forces, blocks=blocks)


def make_measures(model: Model, add_frame) -> tuple[Measure, ...]:
    """Measures of a model.  Args: add_frame: adds a frame of (name, reference) to those of the system."""
    found = []
    for item in model.measures.values():
        if item.function is not None:
            read = as_function(item.function)
        elif item.joint is not None:
            read = JointReading(item.joint, item.of)
        else:
            ends = item.between if item.between is not None else (item.on,)
            names = [f"{item.name}.{side}" for side in "ab"[: len(ends)]]
            for name, end in zip(names, ends, strict=True):
                add_frame(name, *resolve_frame(end, model.bodies, model.frames))
            read = _reading(names, item)
        found.append(Measure(item.name, read))
    return tuple(found)


def _reading(names, item):
    if len(names) == 1:
        return FrameReading(names[0], item.of, item.axis)
    return RelativeReading(names[0], names[1], item.of, item.axis)


def make_blocks(model: Model) -> tuple[BlockElement, ...]:
    """Blocks of a model in the order of their evaluation, their shapes not yet known."""
    found, rhythms = [], _rhythms(model)
    for name, is_early in evaluation_order(model)[0]:
        item, reads, functions = model.blocks[name], [], []
        for read in reads_of(item):
            reads.append(read if isinstance(read, str) else len(functions))
            functions += [] if isinstance(read, str) else [as_signal(read)]
        drives = tuple(_field_of(one, model)[0] for one in drives_of(item))
        block = item.block if item.every is None else item.block.sampled(item.every)
        layout = block_layout(block)
        sampling: dict[str, Any] = {}
        if item.every is not None:
            layout += (("output", (), ""),)
            sampling = {"period": number(item.every), "rhythm": rhythms[name]}
        connections = tuple(reads), tuple(functions), drives
        found.append(BlockElement(name, block, *connections, layout, is_early=is_early, **sampling))
    return tuple(found)
