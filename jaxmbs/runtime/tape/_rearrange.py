"""Rules of primitives that move numbers: shapes, slices, transposes, joins."""

from typing import Any

import numpy as np

from ._flatten import Operation, UnsupportedError
from ._fold import iota, reshape_order, spread_axes
from ._memory import Value
from ._tape import SHOWN
from ._writer import Writer, rule


def take(writer: Writer, value: Value, places: np.ndarray, is_temporary: bool = False) -> Value:
    """The numbers of a value at constant places: where they lie if they are neighbours, else a copy."""
    places = np.ascontiguousarray(places).reshape(-1)
    if value.is_splat or not places.size:
        return Value(value.buffer, value.place, True)
    first = int(places[0])
    if np.array_equal(places, np.arange(first, first + places.size)):
        return Value(value.buffer, value.place + first, places.size == 1)
    result = (writer.temporary if is_temporary else writer.new)(places.size)
    writer.emit("TAKE", places.size, out=result.place, a=value.place, table=writer.arena.table(places))
    return result


def places_of(shape: tuple[int, ...]) -> np.ndarray:
    """The place of each number of an array in its memory."""
    return np.arange(int(np.prod(shape, dtype=np.int64))).reshape(shape)


@rule(
    *("reverse_only", "copy", "copy_p", "optimization_barrier", "stop_gradient", "pvary"),
    *("xla_metadata_value", "device_put"),
    *("nontraceable", "nonbatchable", "nondifferentiable_backward"),
)
def _same(writer, operation, values):
    return [v.with_constant(v.constant) for v in values]


@rule("reduce_precision")
def _reduce_precision(writer, operation, values):
    if operation.params["exponent_bits"] < 11 or operation.params["mantissa_bits"] < 52:
        raise UnsupportedError("numbers of fewer bits than a double has")
    return _same(writer, operation, values)


@rule("name")
def _name(writer, operation, values):
    """A value with the name `SHOWN` is kept where nothing else is written, for those who look while the tape runs."""
    if operation.params["name"] == SHOWN and not writer.shown:
        (value,), size = values, operation.inputs[0].size
        place = writer.lasting(size).place
        writer.copy(value, size, place)
        writer.shown.append((place, size))
    return _same(writer, operation, values)


@rule("reshape", "squeeze", "expand_dims")
def _reshape(writer, operation, values):
    if (order := reshape_order(operation)) is not None and not values[0].is_splat:
        return [take(writer, values[0], np.transpose(places_of(operation.inputs[0].shape), order))]
    constant = values[0].constant
    return [values[0].with_constant(None if constant is None else constant.reshape(operation.outputs[0].shape))]


@rule("broadcast_in_dim", "transpose", "slice", "rev")
def _move(writer, operation, values):
    if values[0].is_splat:
        return [Value(values[0].buffer, values[0].place, True)]
    return [take(writer, values[0], _places_after(operation))]


def _places_after(operation: Operation) -> np.ndarray:
    name, params, out = operation.name, operation.params, operation.outputs[0]
    places = places_of(operation.inputs[0].shape)
    if name == "broadcast_in_dim":
        return np.broadcast_to(spread_axes(places, params["broadcast_dimensions"], len(out.shape)), out.shape)
    if name == "transpose":
        return np.transpose(places, params["permutation"])
    if name == "rev":
        return np.flip(places, params["dimensions"])
    strides = params["strides"] or (1,) * places.ndim
    return places[tuple(map(slice, params["start_indices"], params["limit_indices"], strides))]


@rule("iota")
def _iota(writer, operation, values):
    out = operation.outputs[0]
    return [writer.arena.constant(iota(operation.params["dimension"], out.shape).astype(out.dtype))]


@rule("empty", "empty2")
def _empty(writer, operation, values):
    return [writer.arena.constant(np.zeros(operation.outputs[0].shape, operation.outputs[0].dtype))]


@rule("split")
def _split(writer, operation, values):
    ends = np.cumsum(operation.params["sizes"])[:-1]
    parts = np.split(places_of(operation.inputs[0].shape), ends, operation.params["axis"])
    return [take(writer, values[0], part) for part in parts]


@rule("unstack")
def _unstack(writer, operation, values):
    parts = np.moveaxis(places_of(operation.inputs[0].shape), operation.params["axis"], 0)
    return [take(writer, values[0], np.asarray(part)) for part in parts]


@rule("tile")
def _tile(writer, operation, values):
    params = operation.params
    repeats = params["reps"] if "reps" in params else params["repeats"]
    return [take(writer, values[0], np.tile(places_of(operation.inputs[0].shape), repeats))]


@rule("pad")
def _pad(writer, operation, values):
    (array, _), out = operation.inputs, operation.outputs[0]
    places, source, target = np.full(out.shape, -1), [], []
    for (low, _, inside), length, room in zip(
        operation.params["padding_config"], array.shape, out.shape, strict=True
    ):
        at = low + np.arange(length) * (inside + 1)
        is_inside = (at >= 0) & (at < room)
        source.append(np.flatnonzero(is_inside))
        target.append(at[is_inside])
    places[np.ix_(*target)] = places_of(array.shape)[np.ix_(*source)]
    result, numbers = writer.new(out.size), writer.dense(values[0], array.size)
    table = writer.arena.table(places)
    writer.emit("PAD", out.size, out=result.place, a=numbers, b=values[1].place, table=table)
    return [result]


@rule("concatenate")
def _concatenate(writer, operation, values):
    return [join(writer, operation.outputs[0].shape, operation.params["dimension"], operation.inputs, values)]


@rule("stack")
def _stack(writer, operation, values):
    return [join(writer, operation.outputs[0].shape, operation.params["axis"], operation.inputs, values)]


def join(writer: Writer, shape: Any, axis: Any, atoms: Any, values: list[Value]) -> Value:
    """Arrays side by side along an axis of the result."""
    rows = int(np.prod(shape[:axis], dtype=np.int64))
    length = int(np.prod(shape[axis:], dtype=np.int64))
    result, start, parts = writer.new(rows * length), 0, []
    for atom, value in zip(atoms, values, strict=True):
        part = atom.size // max(rows, 1)
        if part:
            parts.append((value.place, value.is_splat, rows, part, start, length))
        start += part
    writer.emit("JOIN", rows * length, out=result.place, x0=len(parts), table=writer.arena.table(np.array(parts)))
    return result
