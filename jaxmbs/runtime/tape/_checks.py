"""Checks of instructions, by which none reads or writes outside of the arena and the tables.

Indices that are found while a tape runs are clamped by the machine.
"""

from collections.abc import Callable

import numpy as np

from ._host import check_host
from ._rows import Rows

#: The check of each kind of operands in `opcodes.h`.
CHECKS: dict[str, Callable[[Rows], None]] = {}


def check(kind: str) -> Callable[[Callable], Callable]:
    """Register a check."""

    def register(function):
        CHECKS[kind] = function
        return function

    return register


@check("UNARY")
def _unary(rows):
    rows.result()
    rows.operands("a")


@check("BINARY")
def _binary(rows):
    rows.result()
    rows.operands("a", "b")


@check("TERNARY")
def _ternary(rows):
    rows.result()
    rows.operands("a", "b", "c")


@check("TAKE")
def _take(rows):
    rows.result()
    rows.table(rows["n"])
    rows.within(rows["a"], 1 + rows.largest(rows["table"], rows["n"]))


@check("PAD")
def _pad(rows):
    rows.result()
    rows.table(rows["n"])
    high = rows.largest(rows["table"], rows["n"], least=-1)
    rows.within(rows["a"], 1 + high)
    rows.within(rows["b"], 1)


@check("JOIN")
def _join(rows):
    rows.result()
    rows.lengths("x0")
    rows.table(6 * rows["x0"])
    parts, (place, is_splat, number, length, start, stride) = rows.lines(rows["x0"], rows["table"], 6)
    for size in (number, length, start, stride):
        parts.claim(size >= 0, "a part of negative size")
    parts.within(place, np.where(is_splat != 0, 1.0, number * length))
    parts.claim((number == 0) | (start + (number - 1) * stride + length <= parts["n"]), "a part beyond its result")


def _slice_end(rows, number):
    """The largest place of a slice of so many numbers, counted from the first of its array."""
    rows.lengths("x0")
    places = np.where(rows["mode"] != 0, 0.0, number)
    rows.table(3 * rows["x0"] + places)
    cuts, (stride, largest, index) = rows.lines(rows["x0"], rows["table"], 3)
    cuts.claim((stride >= 0) & (largest >= 0), "a negative stride or index")
    cuts.within(index, 1)
    high = rows.largest(rows["table"] + 3 * rows["x0"], places)
    return np.where(rows["mode"] != 0, number - 1, high) + _sums(rows["x0"], stride * largest)


def _sums(number, terms):
    """Sums of so many terms each, one after another."""
    owner = np.repeat(np.arange(len(number)), number.astype(np.int64))
    return np.bincount(owner, terms, len(number))


@check("SLICE")
def _slice(rows):
    rows.result()
    rows.within(rows["a"], 1 + _slice_end(rows, rows["n"]))


@check("UPDATE")
def _update(rows):
    rows.result()
    rows.within(rows["a"], rows["n"])
    rows.lengths("x1")
    rows.claim(1 + _slice_end(rows, rows["x1"]) <= rows["n"], "a part beyond its result")
    rows.operands("b", length=rows["x1"])


def _windows(rows):
    """The largest place of a gather or scatter in its array, and in what is gathered or scattered."""
    number, dims, width = rows["x0"], rows["x1"], rows["x2"]
    rows.lengths("x0", "x1", "x2")
    rows.table(2 * dims + 2 * number + 2 * width)
    slots, (stride, largest) = rows.lines(dims, rows["table"], 2)
    slots.claim((stride >= 0) & (largest >= 0), "a negative stride or index")
    base = rows["table"] + 2 * dims
    window = base + 2 * number
    rows.within(rows["b"], number * dims)
    far = rows.largest(base, number) + rows.largest(window, width) + _sums(dims, stride * largest)
    near = rows.largest(base + number, number) + rows.largest(window + width, width)
    is_some = (number > 0) & (width > 0)
    return np.where(is_some, far, -1.0), np.where(is_some, near, -1.0)


@check("GATHER")
def _gather(rows):
    far, near = _windows(rows)
    rows.result()
    rows.within(rows["a"], 1 + far)
    rows.claim(1 + near <= rows["n"], "a row beyond its result")
    rows.within(rows["c"], 1)


@check("SCATTER")
def _scatter(rows):
    far, near = _windows(rows)
    rows.result()
    rows.within(rows["a"], rows["n"])
    rows.claim(1 + far <= rows["n"], "a row beyond its result")
    rows.operands("c", length=1 + near)


def _reduction(rows, least):
    rows.result()
    rows.lengths("x0", least=least)
    rows.lengths("x1", least=1)
    rows.claim(np.mod(rows["n"], rows["x1"]) == 0, "an axis that does not fit its result")
    rows.within(rows["a"], rows["n"] * rows["x0"])


CHECKS |= {"REDUCTION": lambda rows: _reduction(rows, 0), "ARGUMENT": lambda rows: _reduction(rows, 1)}


@check("CUMULATIVE")
def _cumulative(rows):
    rows.result()
    rows.within(rows["a"], rows["n"])
    rows.lengths("x0", "x1", least=1)
    rows.claim(rows["x0"] * rows["x1"] <= rows["n"], "an axis longer than its array")


@check("SORT")
def _sort(rows):
    """The numbers to work in are an order of places for a while: no result may be written over it."""
    rows.lengths("x0", "x1", "x2", least=1)
    rows.claim(rows["x1"] * rows["x2"] <= rows["n"], "an axis longer than its array")
    rows.claim((rows["x3"] >= 0) & (rows["x3"] <= rows["x0"]), "more keys than arrays")
    out, work, size = rows["out"], rows["c"], rows["x0"] * rows["n"]
    rows.within(rows["a"], size)
    rows.within(out, size)
    rows.within(work, 3 * rows["x1"])
    rows.claim((out + size <= work) | (work + 3 * rows["x1"] <= out), "a result where it works")


@check("DOT")
def _dot(rows):
    rows.result()
    rows.lengths("x0")
    rows.table(7 + 2 * rows["x0"])
    m, n, k, *strides = (rows.entry(place) for place in range(7))
    for number in (m, n, k, *strides):
        rows.claim((number >= 0) & (number <= rows.space.size), "a length or stride out of range")
    rows.claim(rows["x0"] * m * n <= rows["n"], "a product beyond its result")
    for name, place, length, (own, along) in (("a", 0, m, strides[:2]), ("b", 1, n, strides[2:])):
        start = rows.largest(rows["table"] + 7 + place * rows["x0"], rows["x0"])
        last = start + np.maximum(length - 1, 0) * own + np.maximum(k - 1, 0) * along
        rows.within(rows[name], 1 + last)


@check("DOT_TABLE")
def _dot_table(rows):
    rows.result()
    rows.lengths("x0", "x1", "x2", "x3")
    rows.claim(rows["x0"] * rows["x1"] * rows["x2"] <= rows["n"], "a product beyond its result")
    parts = [rows[field] for field in ("x0", "x0", "x1", "x2", "x3", "x3")]
    ends = np.cumsum([rows["table"], *parts], 0)
    rows.table(ends[-1] - ends[0])
    in_a, in_b, own_a, own_b, along_a, along_b = map(rows.largest, ends, parts)
    rows.within(rows["a"], 1 + np.maximum(in_a, 0) + np.maximum(own_a, 0) + np.maximum(along_a, 0))
    rows.within(rows["b"], 1 + np.maximum(in_b, 0) + np.maximum(own_b, 0) + np.maximum(along_b, 0))


@check("CHOLESKY")
def _cholesky(rows):
    rows.result()
    rows.within(rows["a"], rows["n"])
    rows.lengths("x0", "x1")
    rows.claim(rows["x0"] * rows["x1"] ** 2 <= rows["n"], "matrices beyond their result")


@check("TRIANGULAR")
def _triangular(rows):
    rows.result()
    rows.within(rows["b"], rows["n"])
    rows.lengths("x0", "x1", "x2")
    rows.claim(rows["x0"] * rows["x1"] * rows["x2"] <= rows["n"], "right sides beyond their result")
    rows.within(rows["a"], rows["x0"] * rows["x1"] ** 2)


@check("LU")
def _lu(rows):
    rows.result()
    rows.within(rows["a"], rows["n"])
    rows.lengths("x0", "x1", "x2")
    rows.claim(rows["x0"] * rows["x1"] * rows["x2"] <= rows["n"], "matrices beyond their result")
    rows.within(rows["b"], rows["x0"] * np.minimum(rows["x1"], rows["x2"]))
    rows.within(rows["c"], rows["x0"] * rows["x1"])


@check("WHILE")
def _while(rows):
    rows.within(rows["a"], 1)
    rows.inner(rows["x0"])
    rows.inner(rows["x1"])


@check("SCAN")
def _scan(rows):
    rows.inner(rows["x0"])
    rows.lengths("x1", "x2")
    number = rows["x1"] + rows["x2"]
    rows.table(4 * number)
    stacks, (stack, row, length, is_splat) = rows.lines(number, rows["table"], 4)
    stacks.claim(length >= 0, "a row of negative length")
    stacks.within(stack, stacks["n"] * length)
    line = np.concatenate([np.zeros(0), *(np.arange(n) for n in number.astype(np.int64))])
    is_given = line < np.repeat(rows["x1"], number.astype(np.int64))  # rows of the inputs, which are written whole
    stacks.within(row, np.where((is_splat != 0) & ~is_given, 1.0, length))


@check("COND")
def _cond(rows):
    rows.within(rows["a"], 1)
    rows.lengths("x0", least=1)
    rows.table(rows["x0"])
    branches, (tape,) = rows.lines(rows["x0"], rows["table"], 1)
    branches.inner(tape)


CHECKS["HOST"] = check_host
