"""Faults of the measures and blocks of a declared model."""

import numpy as np

from ..blocks import AbstractBlock
from ..blocks._readings import AXES, OF_FORCE, OF_FRAME, OF_FRAMES, OF_JOINT, REFUSED
from ..checks import any_concrete, faults_if, no_such
from ..forces._fields import as_function
from ..forces._internal_state import internal_layout
from ..forces._signals import Constant
from ._block_connections import drives_of, field_of, is_real, reads_of, rhythms
from ._declarations import Model
from ._evaluation_order import evaluation_order
from ._law_faults import declared_state_faults

_MOST_PERIODS = 8  # each adds its own samples, at which steps end


def measure_faults(item, model: Model, reference_faults) -> list[str]:
    """Faults of one measure.  Args: reference_faults: those of a reference to a frame, of (where, reference)."""
    where = f"measure {item.name!r}"
    given = [name for name in ("function", "joint", "force", "between", "on") if getattr(item, name) is not None]
    if len(given) != 1:
        return [f"{where}: give one of a function, joint=, force=, between=, on=, got {', '.join(given) or 'none'}"]
    if item.function is not None:
        return _function_faults(where, item)
    wanted = {"joint": OF_JOINT, "force": OF_FORCE, "on": OF_FRAME, "between": OF_FRAMES}[given[0]]
    found = []
    if item.of in REFUSED and item.force is None:
        found.append(f"{where}: {_refusal(item.of)}")
    elif item.of not in wanted:
        found.append(f"{where}: of a measure {given[0]}= is {' or '.join(map(repr, wanted))}, got {item.of!r}")
    if item.force is not None:
        found += _force_faults(where, item.force, model)
    is_vector = given[0] != "joint" and item.of not in ("distance", "distance rate")
    if item.axis is not None and (not is_vector or item.axis not in AXES):
        found.append(f"{where}: axis is 'x', 'y' or 'z' of a vector between or on frames, got {item.axis!r}")
    if item.joint is not None and item.joint not in model.joints:
        found.append(f"{where}: {no_such('joint', item.joint, model.joints)}")
    if item.between is not None and (not isinstance(item.between, tuple | list) or len(item.between) != 2):
        return [*found, f"{where}: between= takes two frames, got {item.between!r}"]
    ends = item.between if item.between is not None else () if item.on is None else (item.on,)
    return found + [fault for end in ends for fault in reference_faults(where, end)]


def _force_faults(where, name, model):
    """Faults of the force element of a measure."""
    if name not in model.forces:
        return [f"{where}: {no_such('force element', name, model.forces)}"]
    driven = [item.name for item in model.blocks.values() for field in drives_of(item) if field.split(".")[0] == name]
    return [
        f"{where}: block {block!r} drives {name!r}, whose effort follows from it at the same instant (an algebraic "
        "loop): measure another element in line with it"
        for block in driven
    ]


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
        found += [f"{where}: {fault}" for fault in item.block.faults() + declared_state_faults(item.block)]
        for read in reads_of(item):
            found += [f"{where}: {fault}" for fault in _read_faults(item, read, names, states, model)]
        for name in drives_of(item):
            field, fault = field_of(name, model)
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
    if not is_real(item.every):
        return [f"every= takes a period in seconds, got {item.every!r}"]
    if any_concrete(lambda x: ~(np.isfinite(x) & (x > 0.0)), item.every):
        return [f"every= must be a positive period in seconds, got {item.every}"]
    kind, states = type(item.block).__name__, [name for name, *_ in internal_layout(item.block)]
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


def _rhythm_faults(model):
    different = len(set(rhythms(model).values()))
    listed = ", ".join(str(item.every) for item in model.blocks.values() if item.every is not None)
    return faults_if(
        (
            different > _MOST_PERIODS,
            f"blocks are sampled with {different} different periods ({listed}), and a motion takes "
            f"{_MOST_PERIODS}: give blocks the same period",
        )
    )


def _name_faults(where, item, model):
    tables = {"force": model.forces, "measure": model.measures}
    found = [f"{where}: a {what} has this name" for what, table in tables.items() if item.name in table]
    return found + faults_if(("." in item.name, f"{where}: a name with a dot is that of a state or field"))


def _state_names(model):
    for item in (*model.forces.values(), *model.blocks.values()):
        part = item.law if hasattr(item, "law") else item.block
        try:
            layout = internal_layout(part)
        except Exception:  # noqa: BLE001 - reported with the part itself
            continue
        yield from ((item.name, name) for name, *_ in layout)


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


def _loop_faults(model):
    left = evaluation_order(model)[1]
    if not left:
        return []
    return [
        f"blocks {', '.join(map(repr, left))}: their outputs depend on each other at the same instant (an algebraic "
        "loop): put a block with a state on the way, FirstOrder(time_constant), sample one, or join them in one"
    ]
