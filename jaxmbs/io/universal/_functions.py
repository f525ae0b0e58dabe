"""Data set 58, a function at a node: its header and its values, text or binary."""

import re
from typing import NamedTuple

import numpy as np

from .._numbers import reals, whole
from ._data_sets import DataSet

#: Function types by number, as the format names them.
FUNCTIONS = (
    *("unknown function", "time response", "auto spectrum", "cross spectrum", "frequency response function"),
    *("transmissibility", "coherence", "auto correlation", "cross correlation", "power spectral density"),
    *("energy spectral density", "probability density", "spectrum", "cumulative distribution", "peaks and valleys"),
    *("stress cycles", "strain cycles", "orbit", "mode indicator function", "force pattern", "partial power"),
    *("partial coherence", "eigenvalue", "eigenvector", "shock response spectrum", "finite impulse response"),
    *("multiple coherence", "order function"),
)
TRANSFER = 4
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EDed][+-]?\d+|[+-]\d+)?")
_PRECISIONS = {2: (False, "f4"), 4: (False, "f8"), 5: (True, "f4"), 6: (True, "f8")}
_ROW = {(2, 0): 6, (2, 1): 6, (5, 0): 6, (5, 1): 6, (4, 1): 4, (6, 1): 4, (4, 0): 4, (6, 0): 3}  # numbers to a line


class AxisRecord(NamedTuple):
    """An axis: its type by the format's number, its units as they are labelled, "" where they are not."""

    type: int
    units: str


class FunctionRecord(NamedTuple):
    """A function: where it stands, its type, identification lines, (node, direction) of response and reference,
    axes (abscissa, ordinate, denominator), and its points; `is_complex` says how its values stand in the file."""

    place: str
    type: int
    lines: list[str]
    response: tuple[int, int]
    reference: tuple[int, int]
    axes: tuple[AxisRecord, AxisRecord, AxisRecord]
    x: np.ndarray
    values: np.ndarray
    is_complex: bool


class FunctionError(ValueError):
    """A data set that is no function, in words."""


def function_type(data: DataSet) -> int:
    """The type alone.  Raises: FunctionError."""
    if len(data.lines) < 11:
        raise FunctionError(f"{data.place}: its header of 11 lines is cut off")
    return _integers(data, 5, ((0, 5),))[0]


def parse_function(data: DataSet) -> FunctionRecord:
    """All of it.  Raises: FunctionError for a header or values that cannot be read."""
    kind = function_type(data)
    columns = ((41, 51), (51, 55), (66, 76), (76, 80))
    response, reference = np.reshape(_integers(data, 5, columns, words=(5, 6, 8, 9)), (2, 2)).tolist()
    precision, count, spacing = _integers(data, 6, ((0, 10), (10, 20), (20, 30)))
    if precision not in _PRECISIONS or spacing not in (0, 1) or count < 1:
        raise FunctionError(f"{data.place}: its data form {data.lines[6].strip()!r} is none of the format's")
    axes = tuple(_axis(data, k) for k in (7, 8, 9))
    is_complex = _PRECISIONS[precision][0]
    width = 1 + is_complex + (spacing == 0)
    flat = _values(data, precision, spacing, count * width)
    table = flat.reshape(count, width)
    if spacing:
        start, step = [*_reals(data.lines[6], data)[3:], 0.0, 0.0][:2]
        x, y = start + step * np.arange(count), table
    else:
        x, y = table[:, 0], table[:, 1:]
    values = y[:, 0] + 1j * y[:, 1] if is_complex else y[:, 0].astype(complex)
    places = (response[0], response[1]), (reference[0], reference[1])
    return FunctionRecord(data.place, kind, data.lines[:5], *places, axes, x, values, is_complex)


def _values(data, precision, spacing, size) -> np.ndarray:
    """So many numbers as the header says; a last row filled up with zeros may hold more."""
    if data.content is not None:
        found = _read_binary(data, precision, spacing, size)
    else:
        found = _reals(" ".join(data.lines[11:]), data)
    if len(found) < size:
        raise FunctionError(f"{data.place}: its header says {size} numbers, it has {len(found)}: it is cut off")
    rest = found[size:]
    if len(rest) >= _ROW[precision, spacing] or np.any(rest):
        raise FunctionError(f"{data.place}: its header says {size} numbers, it has {len(found)}")
    if not np.all(np.isfinite(found)):
        raise FunctionError(f"{data.place}: {np.sum(~np.isfinite(found))} of its numbers are not finite")
    return found[:size]


def _read_binary(data, precision, spacing, size):
    """Ordinates of the precision that the header says; abscissae of single precision, or of the ordinates'."""
    is_complex, word = _PRECISIONS[precision]
    word = (">" if data.big else "<") + word
    width = 2 if is_complex else 1
    count = size // (width + (spacing == 0))
    mixed = np.dtype([("x", word[0] + "f4"), ("y", word, (width,))])
    if spacing == 0 and word[1:] == "f8" and 0 <= len(data.content) - count * mixed.itemsize < 3:
        rows = np.frombuffer(data.content, mixed, count)  # an end of line may follow
        return np.column_stack([rows["x"], rows["y"]]).astype(float).ravel()
    whole = len(data.content) // int(word[-1]) * int(word[-1])
    return np.frombuffer(data.content[:whole], word).astype(float)


def _reals(text, data) -> np.ndarray:
    """Numbers of fixed or free fields."""
    try:
        return reals(text)
    except ValueError:
        pass
    rest = _NUMBER.sub(" ", text).split()
    if rest:
        raise FunctionError(f"{data.place}: {rest[0][:32]!r} is not a number")
    words = (word.upper().replace("D", "E") for word in _NUMBER.findall(text))
    return np.array([float(re.sub(r"(?<=[\d.])([+-])", r"E\1", word)) for word in words])


def _integers(data, row, columns, words=None) -> list[int]:
    """Whole numbers of fixed columns, or by their place among the words of a line that does not keep them."""
    text = data.lines[row]
    split = text.split()
    for pieces in (
        lambda: [text[a:b] for a, b in columns],
        lambda: [split[k] for k in words or range(len(columns))],
    ):
        try:
            return [whole(piece) for piece in pieces()]
        except (ValueError, IndexError):
            continue
    raise FunctionError(f"{data.place}: line {row + 1} of its header cannot be read: {text.strip()[:60]!r}")


def _axis(data, row):
    text = data.lines[row]
    kind = _integers(data, row, ((0, 10),))[0]
    units = text[46:67].strip() if len(text) > 46 else ""
    return AxisRecord(kind, "" if units.upper() in ("", "NONE") else units)
