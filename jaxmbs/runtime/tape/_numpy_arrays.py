"""Operations of the NumPy machine that move numbers, add them up and sort them."""

from typing import Any

import numpy as np

from ._extremes import larger, smaller
from ._numpy_memory import binding
from ._opcodes import NAMES


@binding("TAKE")
def _take(i, memory):
    return memory.doubles.take, (i.a + memory.table(i.table, i.n), None, memory.result(i), "clip")


@binding("PAD")
def _pad(i, memory):
    places = memory.table(i.table, i.n)
    is_inside = places >= 0
    at, source = np.flatnonzero(is_inside), i.a + places[is_inside]
    padding = memory.doubles[i.b : i.b + 1]

    def pad(out, doubles):
        out[...] = padding
        out[at] = doubles[source]

    return pad, (memory.result(i), memory.doubles)


@binding("JOIN")
def _join(i, memory):
    pairs = []
    for place, is_splat, number, length, start, stride in memory.table(i.table, i.x0, 6).tolist():
        source = memory.rows(place, number, length, length, bool(is_splat))
        pairs.append((memory.rows(i.out + start, number, length, stride), source))
    return _copy_all, (pairs,)


def _copy_all(pairs):
    for target, source in pairs:
        target[...] = source


def _start(cuts, doubles):
    """Start of a slice: (stride, largest index, place of the index) of each axis."""
    start = 0
    for stride, largest, place in cuts:
        index = doubles.item(place)
        start += stride * (0 if not index > 0.0 else int(index) if index < largest else largest)
    return start


def _cuts(i, memory):
    return memory.table(i.table, i.x0, 3).tolist()


@binding("SLICE")
def _slice(i, memory):
    cuts, doubles, out = _cuts(i, memory), memory.doubles, memory.result(i)
    places = memory.table(i.table + 3 * i.x0, 0 if i.mode else i.n)

    def contiguous():
        start = i.a + _start(cuts, doubles)
        out[...] = doubles[start : start + i.n]

    def scattered():
        out[...] = doubles[i.a + _start(cuts, doubles) + places]

    return contiguous if i.mode else scattered, ()


@binding("UPDATE")
def _update(i, memory):
    cuts, doubles, out = _cuts(i, memory), memory.doubles, memory.result(i)
    places = memory.table(i.table + 3 * i.x0, 0 if i.mode else i.x1)
    given = memory.operand(i._replace(n=i.x1), "b")
    old = memory.doubles[i.a : i.a + i.n]

    def update():
        if i.out != i.a:
            out[...] = old
        start = i.out + _start(cuts, doubles)
        if i.mode:
            doubles[start : start + i.x1] = given
        else:
            doubles[start + places] = given

    return update, ()


class _Windows:
    """The rows of a gather or scatter, by indices that move them."""

    def __init__(self, i, memory):
        slots, self.base, rows, self.window, inside = memory.parts(i.table, 2 * i.x1, i.x0, i.x0, i.x2, i.x2)
        self.strides, self.largest = slots.reshape(-1, 2).T
        self.block = rows[:, None] + inside[None]
        self.index = memory.matrices(i.b, i.x0, i.x1)

    def places(self):
        """Places (rows, window) in the array, and the rows (rows, 1) that are within it."""
        index = np.where(self.index > 0.0, np.minimum(self.index, self.largest), 0.0).astype(np.int64)
        is_good = np.all((self.index >= 0.0) & (self.index <= self.largest), 1)
        start = self.base + index @ self.strides
        return start[:, None] + self.window[None], is_good[:, None]


@binding("GATHER")
def _gather(i, memory):
    windows, doubles, out = _Windows(i, memory), memory.doubles, memory.result(i)

    def gather():
        places, is_good = windows.places()
        found = doubles[i.a + places]
        out[windows.block] = np.where(is_good, found, doubles[i.c]) if i.mode else found

    return gather, ()


#: How a scatter combines numbers, by its x3; 0 writes them.
_COMBINED: dict[int, Any] = {1: np.add, 2: np.multiply, 3: np.minimum}


@binding("SCATTER")
def _scatter(i, memory):
    windows, out, is_splat = _Windows(i, memory), memory.result(i), i.splat & 4
    old, doubles = memory.doubles[i.a : i.a + i.n], memory.doubles

    def scatter():
        if i.out != i.a:
            out[...] = old
        places, is_good = windows.places()
        given = np.broadcast_to(doubles[i.c], places.shape) if is_splat else doubles[i.c + windows.block]
        if i.mode:
            kept = is_good[:, 0]
            places, given = places[kept], given[kept]
        if i.x3 == 0:
            out[places.reshape(-1)] = given.reshape(-1)
        else:
            _COMBINED.get(i.x3, np.maximum).at(out, places.reshape(-1), given.reshape(-1))

    return scatter, ()


#: Function of each reduction, and where it starts.
_REDUCED: dict[str, Any] = {
    "SUM": (np.add, 0.0),
    "PROD": (np.multiply, 1.0),
    "ALL": (np.logical_and, True),
    "ANY": (np.logical_or, False),
}


@binding(*_REDUCED)
def _reduce(i, memory):
    function, start = _REDUCED[NAMES[i.op]]
    given = memory.matrices(i.a, i.n // i.x1, i.x0, i.x1)
    out = memory.result(i).reshape(-1, i.x1)

    def reduce():
        out[...] = function.reduce(given, axis=1, initial=start)

    return reduce, ()


_EXTREMES: dict[str, Any] = {"RMAX": larger, "RMIN": smaller, "CUMMAX": larger, "CUMMIN": smaller}


@binding("RMAX", "RMIN")
def _reduce_to_extreme(i, memory):
    """Row by row, since NumPy's reductions take either zero of two."""
    function = _EXTREMES[NAMES[i.op]]
    given = memory.matrices(i.a, i.n // i.x1, i.x0, i.x1)
    out = memory.result(i).reshape(-1, i.x1)

    def reduce():
        rows = given
        while (number := rows.shape[1]) > 1:
            halves = function(rows[:, : number // 2], rows[:, number // 2 : 2 * (number // 2)])
            rows = np.concatenate([halves, rows[:, 2 * (number // 2) :]], 1)
        out[...] = rows[:, 0] if rows.shape[1] else {"RMAX": -np.inf, "RMIN": np.inf}[NAMES[i.op]]

    return reduce, ()


@binding("ARGMAX", "ARGMIN")
def _argument(i, memory):
    function = np.argmax if NAMES[i.op] == "ARGMAX" else np.argmin
    given = memory.matrices(i.a, i.n // i.x1, i.x0, i.x1)
    out = memory.result(i).reshape(-1, i.x1)

    def argument():
        out[...] = function(given, axis=1)

    return argument, ()


_CUMULATIVE: dict[str, Any] = {
    "CUMSUM": np.add,
    "CUMPROD": np.multiply,
}


@binding("CUMMAX", "CUMMIN")
def _cumulative_extreme(i, memory):
    function, shape = _EXTREMES[NAMES[i.op]], (i.n // (i.x0 * i.x1), i.x0, i.x1)
    given, out = memory.matrices(i.a, *shape), memory.matrices(i.out, *shape)
    turns = range(i.x0)[:: -1 if i.mode else 1]

    def accumulate():
        so_far = out[:, turns[0]] = given[:, turns[0]]
        for k in turns[1:]:
            so_far = out[:, k] = function(so_far, given[:, k])

    return accumulate, ()


@binding(*_CUMULATIVE)
def _cumulative(i, memory):
    shape = i.n // (i.x0 * i.x1), i.x0, i.x1
    given, out = memory.matrices(i.a, *shape), memory.matrices(i.out, *shape)
    if i.mode:
        given, out = given[:, ::-1], out[:, ::-1]
    return _CUMULATIVE[NAMES[i.op]].accumulate, (given, 1, None, out)


@binding("SORT")
def _sort(i, memory):
    shape = i.x0, i.n // (i.x1 * i.x2), i.x1, i.x2
    given, out = memory.rows(i.a, i.x0, i.n, i.n), memory.rows(i.out, i.x0, i.n, i.n)
    size = shape[1] * i.x1 * i.x2

    def sort():
        arrays = given[:, :size].reshape(shape)
        order = np.lexsort(arrays[: i.x3][::-1], axis=1) if i.x3 else np.arange(i.x1)[None, :, None]
        found = np.take_along_axis(arrays, np.broadcast_to(order, shape[1:])[None], 2)
        out[:, :size] = found.reshape(i.x0, size)

    return sort, ()
