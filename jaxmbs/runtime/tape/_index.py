"""Rules of slices and updates at places that are known when the tape runs, of gathers and scatters."""

import numpy as np

from ._flatten import Atom, UnsupportedError
from ._memory import Value
from ._rearrange import places_of, take
from ._reduce import exact, sizes
from ._writer import Writer, rule

_SCATTERS = {
    "scatter": 0,
    "scatter-add": 1,
    "scatter_add": 1,
    "scatter-sub": 1,
    "scatter_sub": 1,
    "scatter-mul": 2,
    "scatter_mul": 2,
}
_SCATTERS |= {"scatter-min": 3, "scatter_min": 3, "scatter-max": 4, "scatter_max": 4}


def _strides(shape):
    return [int(np.prod(shape[axis + 1 :], dtype=np.int64)) for axis in range(len(shape))]


def _window(array: Atom, lengths, indices: list[Value]):
    """Table of a slice: (stride, largest index, place of the index) of each axis that is cut, then its places."""
    axes = [axis for axis, length in enumerate(lengths) if array.shape[axis] > length]
    strides = _strides(array.shape)
    cuts = [(strides[axis], array.shape[axis] - lengths[axis], indices[axis].place) for axis in axes]
    places = places_of(array.shape)[tuple(slice(0, length) for length in lengths)].reshape(-1)
    is_contiguous = np.array_equal(places, np.arange(places.size))
    return len(cuts), is_contiguous, [np.array(cuts), [] if is_contiguous else places]


@rule("dynamic_slice")
def _dynamic_slice(writer, operation, values):
    value, (array, *_), out = values[0], operation.inputs, operation.outputs[0]
    if value.is_splat:
        return [Value(value.buffer, value.place, True)]
    cuts, is_contiguous, table = _window(array, operation.params["slice_sizes"], values[1:])
    result = writer.new(out.size)
    fields = {"x0": cuts, "mode": is_contiguous, "table": writer.arena.table(*table)}
    writer.emit("SLICE", out.size, out=result.place, a=value.place, **fields)
    return [result]


@rule("dynamic_update_slice")
def _dynamic_update_slice(writer, operation, values):
    (value, update, *indices), (array, part, *_) = values, operation.inputs
    if part.size == 0:
        return [Value(value.buffer, value.place, value.is_splat)]
    cuts, is_contiguous, table = _window(array, part.shape, indices)
    result, place = _changed(writer, value, array, values[1:])
    is_splat = update.is_splat and part.size > 1
    fields = {"x0": cuts, "x1": part.size, "mode": is_contiguous, "table": writer.arena.table(*table)}
    writer.emit("UPDATE", array.size, out=result.place, a=place, b=update.place, splat=2 * is_splat, **fields)
    return [result]


def _negative(writer, value, atom):
    """The numbers that a scatter takes away, as those that it adds."""
    result = writer.temporary(1 if value.is_splat else atom.size)
    writer.emit("NEG", 1 if value.is_splat else atom.size, out=result.place, a=value.place, splat=value.is_splat)
    return Value(result.buffer, result.place, value.is_splat)


def _changed(writer: Writer, value: Value, array: Atom, others: list[Value]) -> tuple[Value, int]:
    """The value of a changed array and the place of the old one: the same where nothing else needs the old."""
    if writer.may_overwrite(value, others):
        return Value(value.buffer, value.place), value.place
    return writer.new(array.size), writer.dense(value, array.size)


class _Rows:
    """Places of the windows of a gather or scatter: `rows` starts that indices move, `window` places about them.

    Args:
        array, index, block: shapes of the array, of its indices, and of what is gathered or scattered.
        window_axes: axes of the block that are a window, in the order of `axes` of the array.
    """

    def __init__(self, array, index, block, window_axes, axes, batching, moved_axes):
        strides, lead = _strides(array), index[:-1]
        self.num_rows, self.num_indices = int(np.prod(lead, dtype=np.int64)), index[-1]
        lengths = {axis: block[place] for place, axis in zip(window_axes, axes, strict=True)}
        self.slots = [(strides[axis], array[axis] - lengths.get(axis, 1)) for axis in moved_axes]
        places = places_of(block)
        row_axes = [axis for axis in range(len(block)) if axis not in window_axes]
        self.row_place = places[tuple(slice(None) if axis in row_axes else 0 for axis in range(len(block)))]
        self.row_place = self.row_place.reshape(-1)
        inside = places[tuple(slice(None) if axis in window_axes else 0 for axis in range(len(block)))]
        self.window_place = inside.reshape(-1)
        self.window = self._sum(inside.shape, [strides[axis] for axis in axes])
        self.base = np.zeros(lead, np.int64)
        for axis, of_index in batching:
            self.base = self.base + self._sum(
                lead, [strides[axis] * (d == of_index) for d in range(len(lead))]
            ).reshape(lead)
        self.base = self.base.reshape(-1)

    @staticmethod
    def _sum(shape, strides):
        found = np.zeros(shape, np.int64)
        for axis, stride in enumerate(strides):
            found = found + stride * np.arange(shape[axis]).reshape(
                [-1 if d == axis else 1 for d in range(len(shape))]
            )
        return found.reshape(-1)

    def table(self, writer):
        parts = np.array(self.slots), self.base, self.row_place, self.window, self.window_place
        return writer.arena.table(*parts)

    @property
    def fields(self):
        return {"x0": self.num_rows, "x1": self.num_indices, "x2": self.window.size}


@rule("gather")
def _gather(writer, operation, values):
    (array, index), out, params = operation.inputs, operation.outputs[0], operation.params
    numbers = params["dimension_numbers"]
    away = (*numbers.collapsed_slice_dims, *numbers.operand_batching_dims)
    axes = [axis for axis in range(len(array.shape)) if axis not in away]
    batching = zip(numbers.operand_batching_dims, numbers.start_indices_batching_dims, strict=True)
    rows = _Rows(array.shape, index.shape, out.shape, numbers.offset_dims, axes, batching, numbers.start_index_map)
    is_filled = "FILL" in str(params["mode"])
    fill = params.get("fill_value")
    fill = (np.nan if out.dtype.kind == "f" else _out_of_range(out.dtype)) if fill is None else fill
    if array.size == 0:
        return [writer.arena.constant(np.full(out.shape, fill, out.dtype))]
    constant = values[1].constant
    if constant is not None:
        places, is_good = _constant_places(rows, np.asarray(constant).reshape(rows.num_rows, -1))
        if is_good or not is_filled:
            return [take(writer, values[0], places)]
    if values[0].is_splat and not is_filled:
        return [Value(values[0].buffer, values[0].place, True)]
    given, at = writer.dense(values[0], array.size), writer.dense(values[1], index.size)
    other = writer.arena.constant(np.asarray(fill, np.float64)).place if is_filled else 0
    result = writer.new(out.size)
    fields = {"mode": is_filled, "table": rows.table(writer), **rows.fields}
    writer.emit("GATHER", out.size, out=result.place, a=given, b=at, c=other, **fields)
    return [result]


def _out_of_range(dtype):
    """The number that JAX fills in for whole numbers and truth values out of range."""
    return True if dtype.kind == "b" else np.iinfo(dtype).max if dtype.kind == "u" else np.iinfo(dtype).min


def _constant_places(rows, index):
    """Places of all numbers of a gather at constant indices, and whether all are within range."""
    start, is_good = rows.base.copy(), True
    for k, (stride, largest) in enumerate(rows.slots):
        is_good = is_good and bool(np.all((index[:, k] >= 0) & (index[:, k] <= largest)))
        start += np.clip(index[:, k].astype(np.int64), 0, largest) * stride
    places = np.zeros(rows.num_rows * rows.window.size, np.int64)
    places[(rows.row_place[:, None] + rows.window_place).reshape(-1)] = (start[:, None] + rows.window).reshape(-1)
    return places, is_good


@rule(*_SCATTERS)
def _scatter(writer, operation, values):
    (array, index, update), params = operation.inputs, operation.params
    numbers = params["dimension_numbers"]
    if array.dtype.kind != "f" and _SCATTERS[operation.name] == 2:
        raise UnsupportedError("products of whole numbers by scatter")
    if operation.name == "scatter" and params["update_jaxpr"] is not None:
        raise UnsupportedError("a function of numbers at places")
    away = (*numbers.inserted_window_dims, *numbers.operand_batching_dims)
    axes = [axis for axis in range(len(array.shape)) if axis not in away]
    batching = zip(numbers.operand_batching_dims, numbers.scatter_indices_batching_dims, strict=True)
    moved, window = numbers.scatter_dims_to_operand_dims, numbers.update_window_dims
    rows = _Rows(array.shape, index.shape, update.shape, window, axes, batching, moved)
    if operation.name in ("scatter-sub", "scatter_sub"):
        values = [*values[:2], _negative(writer, values[2], update)]
    at = writer.dense(values[1], index.size)
    result, given = _changed(writer, values[0], array, values[1:])
    is_splat = values[2].is_splat and update.size > 1
    fields = {"mode": "CLIP" not in str(params["mode"]), "splat": 4 * is_splat, "table": rows.table(writer)}
    fields |= {"x3": _SCATTERS[operation.name], **rows.fields}
    if _SCATTERS[operation.name] == 1 and array.dtype.kind in "iu":
        total = writer.temporary(array.size).place
        old, new = sizes(writer, writer.dense(values[0], array.size), array.size), values[2].place
        new = sizes(writer, new, 1 if values[2].is_splat else update.size)
        writer.emit("SCATTER", array.size, out=total, a=old, b=at, c=new, **fields)
        exact(writer, total, array.size)
    writer.emit("SCATTER", array.size, out=result.place, a=given, b=at, c=values[2].place, **fields)
    if _SCATTERS[operation.name] == 1 and array.dtype in (np.int32, np.uint32):
        writer.emit(f"WRAP_{array.dtype.name.upper()}", array.size, out=result.place, a=result.place)
    return [result]
