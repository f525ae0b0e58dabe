"""Rules of loops and branches: tapes inside of a tape."""

from collections.abc import Sequence

import jax
import numpy as np
from jax.extend.core import jaxpr_as_fun

from ._batched_loop import batched_loop, is_batched
from ._flatten import parts_of_scan
from ._memory import Buffer, Value
from ._writer import Writer, rule


def _carried(writer: Writer, given: Sequence[Value], atoms: Sequence, others: Sequence[Value]) -> list[Value]:
    """Places for what a loop carries, filled with its start; the start's own place where nothing else needs it."""
    places, taken = [], set()
    for k, (value, atom) in enumerate(zip(given, atoms, strict=True)):
        rest = [*others, *given[:k], *given[k + 1 :]]
        if value.buffer not in taken and not value.is_splat and writer.may_overwrite(value, rest):
            taken.add(value.buffer)
            places.append(Value(value.buffer, value.place))
            continue
        own = writer.new(atom.size)
        writer.copy(value, atom.size, own.place)
        places.append(own)
    return places


def _carry_on(writer: Writer, found: Sequence[Value], carried: Sequence[Value], atoms: Sequence) -> None:
    """Write the results of a turn to where the loop carries them, all of them as if at once."""
    moves = [
        (value, place.place, atom.size)
        for value, place, atom in zip(found, carried, atoms, strict=True)
        if atom.size and (value.place != place.place or (value.is_splat and atom.size > 1))
    ]
    targets = [(place, place + size) for _, place, size in moves]
    spare: list[Buffer] = []
    safe = []
    for k, (value, place, size) in enumerate(moves):
        width = 1 if value.is_splat else size
        others = targets[:k] + targets[k + 1 :]
        if any(low < value.place + width and value.place < high for low, high in others):
            copy = writer.new(width)
            spare.append(copy.buffer)
            writer.copy(value, width, copy.place)
            value = Value(copy.buffer, copy.place, value.is_splat)
        safe.append((value, place, size))
    for value, place, size in safe:
        writer.copy(value, size, place)
    for buffer in spare:
        writer.arena.release(buffer)


def _release(writer: Writer, values: Sequence[Value]) -> None:
    """Give back the places of what an inner tape has found."""
    for buffer in {value.buffer for value in values}:
        writer.arena.release(buffer)


@rule("while")
def _while(writer, operation, values):
    params = operation.params
    if is_batched(params):
        return _while(writer, *_unbatched(operation, values))
    first, second = params["cond_nconsts"], params["cond_nconsts"] + params["body_nconsts"]
    known, start, atoms = values[:second], values[second:], operation.outputs
    carried = _carried(writer, start, atoms, known)
    condition, body = writer.new_tape(), writer.new_tape()
    shapes = operation.inputs

    def write_condition():
        given = writer.borrowed([*values[:first], *carried])
        found, _ = writer.body(params["cond_jaxpr"], given, [*shapes[:first], *atoms])
        return found[0]

    def write_body():
        given = writer.borrowed(values[first:second])
        given += writer.borrowed(carried, writable=lambda value: True)
        found, _ = writer.body(params["body_jaxpr"], given, [*shapes[first:second], *atoms])
        _carry_on(writer, found, carried, atoms)
        _release(writer, found)

    answer = writer.on_tape(condition, write_condition)
    writer.on_tape(body, write_body)
    writer.emit("WHILE", 1, a=answer.place, x0=condition, x1=body)
    _release(writer, [answer])
    return carried


def _unbatched(operation, values):
    """The loop over lanes as one with one condition, and its values: its body needs those of the condition too."""
    params = operation.params
    condition, body = params["cond_jaxpr"], params["body_jaxpr"]
    first, second = params["cond_nconsts"], params["cond_nconsts"] + params["body_nconsts"]

    def parts(known, of_body):
        goes_on = lambda carried: jaxpr_as_fun(condition)(*known, *carried)[0]
        return batched_loop(goes_on, lambda carried: jaxpr_as_fun(body)(*of_body, *carried))

    types = lambda avals: [jax.ShapeDtypeStruct(aval.shape, aval.dtype) for aval in avals]
    known, given = types(condition.in_avals[:first]), types(body.in_avals)
    of_body, carried = given[: second - first], given[second - first :]
    both = {
        "cond_jaxpr": jax.make_jaxpr(lambda known, x: [parts(known, [])[0](x)])(known, carried),
        "body_jaxpr": jax.make_jaxpr(lambda known, of_body, x: parts(known, of_body)[1](x))(known, of_body, carried),
        "body_nconsts": second,
    }
    again = lambda given: [*given[:first], *given]
    return operation._replace(params=params | both, inputs=again(operation.inputs)), again(values)


@rule("scan")
def _scan(writer, operation, values):
    params, body = operation.params, writer.new_tape()
    num_known, num_carried = parts_of_scan(params)
    known, start, stacks = values[:num_known], values[num_known:][:num_carried], values[num_known + num_carried :]
    shapes = operation.inputs
    atoms, outputs = operation.outputs[:num_carried], operation.outputs[num_carried:]
    rows = [_RowAtom(atom) for atom in shapes[num_known + num_carried :]]
    carried = _carried(writer, start, atoms, [*known, *stacks])
    slots = [value if value.is_splat else writer.new(row.size) for value, row in zip(stacks, rows, strict=True)]
    results = [writer.new(atom.size) for atom in outputs]

    def write_body():
        given = writer.borrowed(known) + writer.borrowed(carried, writable=lambda value: True)
        given += writer.borrowed(
            [Value(v.buffer, v.place, v.is_splat or r.size == 1) for v, r in zip(slots, rows, strict=True)]
        )
        found, _ = writer.body(params["jaxpr"], given, [*shapes[:num_known], *atoms, *rows])
        found[num_carried:] = _copied_outputs(writer, found[num_carried:], carried, outputs, params["length"])
        _carry_on(writer, found[:num_carried], carried, atoms)
        return found

    found = writer.on_tape(body, write_body)
    taken = [(v.place, s.place, r.size, 0) for v, s, r in zip(stacks, slots, rows, strict=True) if not v.is_splat]
    length = max(params["length"], 1)
    given = [
        (result.place, value.place, atom.size // length, value.is_splat and atom.size > length)
        for result, value, atom in zip(results, found[num_carried:], outputs, strict=True)
    ]
    table = writer.arena.table(np.array(taken), np.array(given))
    fields = {"mode": params["reverse"], "x0": body, "x1": len(taken), "x2": len(given)}
    writer.emit("SCAN", params["length"], table=table, **fields)
    _release(writer, [*found, *(s for s, v in zip(slots, stacks, strict=True) if s is not v)])
    return [*carried, *results]


class _RowAtom:
    """Shape and type of a row of a stack."""

    def __init__(self, atom):
        self.shape, self.dtype = atom.shape[1:], atom.dtype
        self.size = int(np.prod(self.shape, dtype=np.int64))


def _copied_outputs(writer, found, carried, outputs, length):
    """Outputs of a turn, copied from where the loop carries something: that is written anew before they are taken."""
    buffers = {value.buffer for value in carried}
    copies = []
    for value, atom in zip(found, outputs, strict=True):
        if value.buffer.origin in buffers:
            size = 1 if value.is_splat else atom.size // max(length, 1)
            copy = writer.new(size)
            writer.copy(value, size, copy.place)
            value = Value(copy.buffer, copy.place, value.is_splat)
        copies.append(value)
    return copies


@rule("cond")
def _cond(writer, operation, values):
    branches, (index, *args) = operation.params["branches"], values
    shapes = operation.inputs[1:]
    if index.constant is not None:
        branch = branches[min(max(int(index.constant), 0), len(branches) - 1)]
        found, _ = writer.body(branch, args, shapes)
        for value in found:  # they count again as results of this operation
            value.buffer.views -= 1
        return found
    tapes = [writer.new_tape() for _ in branches]
    writable = {value.buffer: writer.may_overwrite(value, [index]) for value in args}
    found, given = [], []
    for tape, branch in zip(tapes, branches, strict=True):
        given.append(writer.borrowed(args, writable=lambda value: writable[value.buffer]))
        found.append(writer.on_tape(tape, lambda branch=branch: writer.body(branch, given[-1], shapes)[0]))
    results = [
        _joined(writer, tapes, ways, atom)
        for ways, atom in zip(zip(*found, strict=True), operation.outputs, strict=True)
    ]
    for ways in found:
        _release(writer, ways)
    writer.emit("COND", 1, a=index.place, x0=len(tapes), table=writer.arena.table(np.array(tapes)))
    return results


def _joined(writer, tapes, ways, atom):
    """The value of a result of all branches: where all of them leave it, or a place to which each copies its own."""
    first = ways[0]
    if all(way.place == first.place and not way.is_splat and way.buffer.origin for way in ways):
        return Value(first.buffer.origin, first.place)
    result = writer.new(atom.size)
    for tape, way in zip(tapes, ways, strict=True):
        writer.on_tape(tape, lambda way=way: writer.copy(way, atom.size, result.place))
    return result


@rule("platform_index")
def _platform_index(writer, operation, values):
    platforms = operation.params["platforms"]
    index = next(k for k, names in enumerate(platforms) if names is None or "cpu" in names)
    return [writer.arena.constant(np.asarray(index, np.int32))]
