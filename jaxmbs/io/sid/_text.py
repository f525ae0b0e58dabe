"""Text of standard input data: nested sections, in which matrices are expanded to first order in the modes."""

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .._numbers import real, whole

_ENTRY = re.compile(r"(m0|m1)\s*\(([^)]*)\)\s*=\s*(\S+)", re.IGNORECASE)
_UNIT, _SYMMETRIC = 4, 2  # values of `structure`; of a symmetric matrix half of the entries suffice
_MOST = 3_000_000  # entries of a matrix


class Expansion(NamedTuple):
    """Matrix `m0 + sum_k m1[:, :, k] q_k`: (rows, columns) and (rows, columns, modes).

    Files number the entries of the first order by row, mode, column.
    """

    m0: np.ndarray
    m1: np.ndarray


class Section(dict):
    """A section: values, expansions and sections by name in small letters; `nodes` of a frame by name."""

    def __init__(self) -> None:
        super().__init__()
        self.nodes: dict[str, Section] = {}
        self.entries: list[tuple[str, str, str]] = []


def parse(text: str) -> Section:
    """Sections of a file.  Raises: ValueError with the number of the line that is not understood."""
    root = Section()
    stack, names = [root], [""]
    for number, line in enumerate(text.splitlines(), 1):
        line = line.split("!", 1)[0].strip()
        word = line.split("=", 1)[0].split()
        if not line or (len(stack) == 1 and word[:1] != ["part"]):
            continue  # titles before the part
        entry = _ENTRY.fullmatch(line)
        if entry is not None:
            stack[-1].entries.append((entry[1].lower(), entry[2], entry[3]))
        elif word[0].lower() == "end":
            name = word[1].lower() if len(word) > 1 else names[-1]
            if name != names[-1]:
                raise ValueError(f"line {number}: end of {name!r}, but {names[-1]!r} is open")
            stack.pop()
            names.pop()
        elif word[0].lower() == "new" and len(word) > 1 and word[1].lower() == "node":
            inner = stack[-1].nodes[line.split("=", 1)[-1].strip().strip("'\"")] = Section()
            stack.append(inner)
            names.append("node")
        elif "=" in line and word[0].lower() != "new":
            key, value = (part.strip() for part in line.split("=", 1))
            stack[-1][key.lower()] = value.strip("'\"")
        else:
            name = word[1 if word[0].lower() == "new" and len(word) > 1 else 0].lower()
            inner = stack[-1][name] = Section()
            stack.append(inner)
            names.append(name)
    if len(stack) > 1:
        raise ValueError(f"{names[-1]!r} has no end")
    return root


def expansion(section: Section, modes: int) -> Expansion:
    """The matrix of a section.  Raises: ValueError for entries outside of it, or sizes that are none."""
    rows, columns = (whole(section[key]) for key in ("nrow", "ncol"))
    if not 0 < rows * columns * max(modes, 1) <= _MOST:
        raise ValueError(f"a matrix of {rows} rows and {columns} columns")
    m0, m1 = np.zeros((rows, columns)), np.zeros((rows, columns, modes))
    symmetric = int(section.get("structure", 3)) == _SYMMETRIC
    if int(section.get("structure", 3)) == _UNIT:
        m0 = np.eye(rows, columns)
    for kind, places, value in section.entries:
        at = tuple(whole(part) - 1 for part in places.split(","))
        at, target = (at, m0) if kind == "m0" else (at[:1] + at[2:] + at[1:2], m1)
        if len(at) != target.ndim or any(not 0 <= i < n for i, n in zip(at, target.shape, strict=True)):
            raise ValueError(f"{kind}({places}) is outside of a matrix of {target.shape}")
        number = real(value.lower().replace("d", "e"))
        target[at] = number
        if symmetric and at[0] != at[1]:
            target[(at[1], at[0], *at[2:])] = number
    return Expansion(m0, m1)


def matrix_lines(name: str, m0: np.ndarray, m1: np.ndarray | None = None, modes: int = 0) -> Iterator[str]:
    """Lines of a matrix; entries that are zero are left out."""
    rows, columns = m0.shape
    yield name
    yield f"   order     = {0 if m1 is None else 1}"
    yield f"   nrow      = {rows}"
    yield f"   ncol      = {columns}"
    yield f"   nq        = {modes}"
    yield "   nqn       = 0"
    yield f"   structure = {3 if np.any(m0) or (m1 is not None and np.any(m1)) else 0}"
    for kind, matrix in (("m0", m0), ("m1", m1)):
        if matrix is not None:
            for at in zip(*np.nonzero(matrix), strict=True):
                row, column, *mode = (str(i + 1) for i in at)
                places = ", ".join((row, *mode, column))
                yield f"   {kind}( {places}) = {matrix[at]:.17g}"
    yield f"end {name}"
