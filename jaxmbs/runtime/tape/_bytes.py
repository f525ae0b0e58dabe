"""Tapes as bytes: a head, then plain arrays.  Nothing of it is executed when it is read, and everything is checked.

Head: a mark, a digest of the machine, a digest of all that follows.  Then the lengths of the arrays, and these, whole
numbers of four or eight bytes and doubles, lowest byte first.
"""

import hashlib
import math
from pathlib import Path
from typing import Any

import numpy as np

from ._flatten import DTYPES
from ._opcodes import FIELDS
from ._parts import Parts, Place
from ._rows import TapeError
from ._tape import Tape

_MARK = b"jaxmbs tape 4\n\0\0"
_DIGEST = 16
_SHORT, _WHOLE, _DOUBLE = np.dtype("<i4"), np.dtype("<i8"), np.dtype("<f8")
#: Type of each array: instructions, starts, tables, sizes, places and lengths of constants, their numbers, inputs,
#: results, and what is shown.
_TYPES: tuple[np.dtype[Any], ...] = (_SHORT, _SHORT, _SHORT, _WHOLE, _WHOLE, _DOUBLE, _WHOLE, _WHOLE, _WHOLE)
#: Types of inputs and results.
_PLACE_TYPES = (*DTYPES, np.dtype(np.complex128))
#: Most numbers of an arena or array, a GiB of them, and most axes of an array.
_MOST_NUMBERS, _MOST_AXES = 2**27, 32


def _digest(*parts: bytes) -> bytes:
    return hashlib.blake2b(b"".join(parts), digest_size=_DIGEST).digest()


#: Tapes of another machine mean something else: its sources are part of each.
_MACHINE = _digest(
    *(
        Path(__file__).with_name(name).read_bytes()
        for name in ("opcodes.h", "machine.c", "_host.py", "_host_functions.py")
    )
)


def write_tape(tape: Tape) -> bytes:
    """A tape as bytes, the same for the same tape, for `read_tape`."""
    parts = tape.parts
    constants = np.array([(place, numbers.size) for place, numbers in parts.constants], _WHOLE)
    numbers = np.concatenate([np.zeros(0), *(numbers for _, numbers in parts.constants)])
    arrays: list[Any] = [parts.code, parts.starts, parts.tables, parts.size, constants, numbers]
    arrays += [_numbers_of(parts.inputs), _numbers_of(parts.outputs), _numbers_of(parts.shown)]
    flat = [np.asarray(array, kind).reshape(-1) for array, kind in zip(arrays, _TYPES, strict=True)]
    body = b"".join(
        [np.array([array.size for array in flat], _WHOLE).tobytes(), *(array.tobytes() for array in flat)]
    )
    return b"".join([_MARK, _MACHINE, _digest(body), body])


def _numbers_of(places):
    """Inputs or results as whole numbers, one after another: start, splat, type, number of axes, their lengths."""
    rows = [(p.start, p.is_splat, _PLACE_TYPES.index(p.dtype), len(p.shape), *p.shape) for p in places]
    return [number for row in rows for number in row]


def read_tape(data: bytes) -> Tape:
    """The tape that `write_tape` wrote.

    Raises: TapeError for bytes that are damaged, of another machine, or of a tape that would read or write outside of
    its arena.
    """
    head = len(_MARK)
    if data[:head] != _MARK:
        raise TapeError("these bytes are no tape")
    if data[head : head + _DIGEST] != _MACHINE:
        raise TapeError("the tape was written by another release of the machine")
    body = data[head + 2 * _DIGEST :]
    if data[head + _DIGEST : head + 2 * _DIGEST] != _digest(body):
        raise TapeError("the bytes of the tape are damaged")
    return Tape(_parts(_split(body)))


def _split(body):
    """The arrays in the bytes after the head."""
    count = len(_TYPES)
    if len(body) < 8 * count:
        raise TapeError("the bytes of the tape end in its head")
    lengths = [int(length) for length in np.frombuffer(body, _WHOLE, count)]
    sizes = [length * kind.itemsize for length, kind in zip(lengths, _TYPES, strict=True)]
    if min(lengths) < 0 or 8 * count + sum(sizes) != len(body):
        raise TapeError("the lengths of the arrays of the tape are not those of its bytes")
    places = np.cumsum([8 * count, *sizes[:-1]])
    return [
        np.frombuffer(body, kind, length, int(place)).astype(kind.newbyteorder("="))
        for kind, length, place in zip(_TYPES, lengths, places, strict=True)
    ]


def _parts(arrays):
    code, starts, tables, sizes, constants, numbers, inputs, outputs, shown = arrays
    fields = len(FIELDS)
    if sizes.size != 1 or not 0 <= sizes[0] <= _MOST_NUMBERS:
        raise TapeError("the arena of the tape is of no possible size")
    if code.size % fields or constants.size % 2:
        raise TapeError("the instructions or constants of the tape are cut off")
    return Parts(
        code=code.reshape(-1, fields),
        starts=starts,
        tables=tables,
        size=int(sizes[0]),
        constants=_constants(constants.reshape(-1, 2), numbers),
        inputs=_places(inputs),
        outputs=_places(outputs),
        shown=_places(shown),
    )


def _constants(places, numbers):
    found, at = [], 0
    for place, length in places.tolist():
        if not 0 <= length <= numbers.size - at:
            raise TapeError("a constant of the tape has numbers that are not there")
        found.append((place, numbers[at : at + length]))
        at += length
    return found


def _places(numbers):
    """Inputs or results of what `_numbers_of` made."""
    found, rest = [], numbers.tolist()
    at = 0
    while at < len(rest):
        if len(rest) - at < 4:
            raise TapeError("an input or result of the tape is cut off")
        start, is_splat, kind, axes = rest[at : at + 4]
        shape = tuple(rest[at + 4 : at + 4 + axes]) if 0 <= axes <= _MOST_AXES else ()
        if (
            len(shape) != axes
            or min(shape, default=0) < 0
            or is_splat not in (0, 1)
            or not 0 <= kind < len(_PLACE_TYPES)
        ):
            raise TapeError("an input or result of the tape has no possible shape or type")
        if math.prod(shape) > _MOST_NUMBERS:
            raise TapeError("an input or result of the tape is too large")
        found.append(Place(start, bool(is_splat), shape, _PLACE_TYPES[kind]))
        at += 4 + axes
    return found
