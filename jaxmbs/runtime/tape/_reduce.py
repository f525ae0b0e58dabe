"""Rules of sums and other reductions, of cumulative ones, and of sorting."""

from typing import Any

import numpy as np

from ._extremes import extreme
from ._flatten import Operation, UnsupportedError
from ._memory import Value
from ._rearrange import join, places_of, take
from ._writer import Writer, rule

_REDUCTIONS = {
    "reduce_sum": ("SUM", 0),
    "reduce_prod": ("PROD", 1),
    "reduce_max": ("RMAX", None),
    "reduce_min": ("RMIN", None),
    "reduce_and": ("ALL", 1),
    "reduce_or": ("ANY", 0),
    "argmax": ("ARGMAX", 0),
    "argmin": ("ARGMIN", 0),
}
_UNVMAPPED = {"unvmap_any": "ANY", "unvmap_all": "ALL", "unvmap_max": "RMAX"}
_CUMULATIVE = {"cumsum": "CUMSUM", "cumprod": "CUMPROD", "cummax": "CUMMAX", "cummin": "CUMMIN"}


@rule(*_REDUCTIONS)
def _reduction(writer, operation, values):
    (op, start), (array,), out = _REDUCTIONS[operation.name], operation.inputs, operation.outputs[0]
    if operation.name in ("reduce_and", "reduce_or") and array.dtype != bool:
        raise UnsupportedError("bits of whole numbers")
    if array.size == 0:
        start = extreme(out.dtype, operation.name == "reduce_min") if start is None else start
        return [writer.arena.constant(np.full(out.shape, start, out.dtype))]
    place, length, inner = _along(writer, values[0], array.shape, tuple(operation.params["axes"]))
    if op == "SUM" and _is_long(array):
        total = writer.temporary(out.size).place
        writer.emit(op, out.size, out=total, a=sizes(writer, place, array.size), x0=length, x1=inner)
        exact(writer, total, out.size)
    result = writer.new(out.size)
    writer.emit(op, out.size, out=result.place, a=place, x0=length, x1=inner)
    return [_wrapped(writer, operation, result)]


def _along(writer: Writer, value: Value, shape: Any, axes: Any) -> tuple[int, int, int]:
    """Numbers as (outer, axes together, inner): their place, and the lengths of the last two."""
    axes, size = sorted(axes), int(np.prod(shape, dtype=np.int64))
    length = int(np.prod([shape[axis] for axis in axes], dtype=np.int64))
    if axes and axes != list(range(axes[0], axes[-1] + 1)):
        kept = [axis for axis in range(len(shape)) if axis not in axes]
        moved = take(writer, value, places_of(shape).transpose(*kept, *axes), is_temporary=not value.is_splat)
        return writer.dense(moved, size), length, 1
    inner = int(np.prod(shape[axes[-1] + 1 :], dtype=np.int64)) if axes else 1
    return writer.dense(value, size), length, inner


def exact(writer: Writer, place: int, size: int) -> None:
    """Leave the program to the compiler where a whole number is beyond 2^53: adding nothing looks at it."""
    nothing = writer.arena.constant(np.zeros((), np.int64))
    writer.emit("IADD", size, out=place, a=place, b=nothing.place, splat=2, x0=64)


def sizes(writer: Writer, place: int, size: int) -> int:
    """Place of the sizes of numbers: where a sum of these is exact, so are all on the way to that of the numbers."""
    found = writer.temporary(size).place
    writer.emit("ABS", size, out=found, a=place)
    return found


def _is_long(array):
    """True for whole numbers whose sums may be beyond 2^53 on the way."""
    return array.dtype == np.int64 or array.dtype.kind in "iu" and array.size >= 2**21


_WHOLE_SUMS = ("reduce_sum", "reduce_prod", "cumsum", "cumprod", "dot_general")


def _wrapped(writer: Writer, operation: Operation, result: Value) -> Value:
    """Sums and products of whole numbers are theirs within 2^53; those of 32 bits wrap round."""
    out = operation.outputs[0]
    if out.dtype in (np.int32, np.uint32, np.int64) and operation.name in _WHOLE_SUMS:
        exact(writer, result.place, out.size)
        if out.dtype != np.int64:
            writer.emit(f"WRAP_{out.dtype.name.upper()}", out.size, out=result.place, a=result.place)
    return result


@rule(*_UNVMAPPED)
def _unvmapped(writer, operation, values):
    size = operation.inputs[0].size
    result, place = writer.new(1), writer.dense(values[0], size)
    writer.emit(_UNVMAPPED[operation.name], 1, out=result.place, a=place, x0=size, x1=1)
    return [result]


@rule(*_CUMULATIVE)
def _cumulative(writer, operation, values):
    (array,), params = operation.inputs, operation.params
    place, length, inner = _along(writer, values[0], array.shape, (params["axis"],))
    result = writer.new(array.size)
    op = _CUMULATIVE[operation.name]
    writer.emit(op, array.size, out=result.place, a=place, x0=length, x1=inner, mode=params["reverse"])
    return [_wrapped(writer, operation, result)]


@rule("sort")
def _sort(writer, operation, values):
    array, count = operation.inputs[0], len(values)
    length, inner = array.shape[operation.params["dimension"]], 1
    inner = int(np.prod(array.shape[operation.params["dimension"] + 1 :], dtype=np.int64))
    if operation.params["num_keys"] > count:
        raise UnsupportedError("sort of fewer arrays than keys")
    given = join(writer, (count, *array.shape), 0, operation.inputs, values)
    found, work = writer.temporary(count * array.size), writer.temporary(3 * length)
    fields = {"x0": count, "x1": length, "x2": inner, "x3": operation.params["num_keys"]}
    writer.emit("SORT", array.size, out=found.place, a=given.place, c=work.place, **fields)
    results = [writer.new(array.size) for _ in values]
    for k, result in enumerate(results):
        writer.emit("COPY", array.size, out=result.place, a=found.place + k * array.size)
    writer.arena.release(given.buffer)
    return results
