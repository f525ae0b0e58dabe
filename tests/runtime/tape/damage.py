"""Tapes that were damaged at random."""

import numpy as np

from jaxmbs.runtime.tape._opcodes import FIELDS

#: Numbers that stand in for those of constants and inputs: indices far out and none at all.
WILD = np.array([np.nan, np.inf, -np.inf, -0.0, -1.0, 0.5, 3.0, 1e3, 2.0**31, -(2.0**63), 2.0**63, 1e300, 5e-324])


def damaged(parts, rng):
    """The parts of a tape with one to three faults."""
    for _ in range(rng.integers(1, 4)):
        if all(map(len, (parts.code, parts.tables, parts.starts))):
            parts = FAULTS[rng.integers(len(FAULTS))](parts, rng)
    return parts


def arena_of(parts, rng):
    """Doubles with the constants of a tape in them, and numbers about one or wild ones elsewhere."""
    arena = np.where(rng.random(parts.size) < 0.1, rng.choice(WILD, parts.size), rng.normal(size=parts.size))
    for place, numbers in parts.constants:
        arena[place : place + numbers.size] = numbers
    return arena


def _other(value, size, rng):
    """A number in place of another: beside it, in range, of one bit more or less, or any."""
    choices = (value + rng.integers(-3, 4), rng.integers(0, max(size, 1) + 2), value ^ (1 << rng.integers(31)))
    found = rng.choice([*choices, rng.integers(-(2**30), 2**30), -1, 2**30, 0, 1, 2 * value % 2**30])
    return np.clip(found, -(2**31), 2**31 - 1)


def _field(parts, rng):
    code = parts.code.copy()
    row, column = rng.integers(len(code)), rng.integers(len(FIELDS))
    code[row, column] = _other(int(code[row, column]), parts.size, rng)
    return parts._replace(code=code)


def _exchanged(parts, rng):
    """A field of another instruction."""
    code = parts.code.copy()
    rows, column = rng.integers(len(code), size=2), rng.integers(len(FIELDS))
    code[rows, column] = code[rows[::-1], column]
    return parts._replace(code=code)


def _swapped(parts, rng):
    code = parts.code.copy()
    rows = rng.integers(len(code), size=2)
    code[rows] = code[rows[::-1]]
    return parts._replace(code=code)


def _entry(parts, rng):
    tables = parts.tables.copy()
    place = rng.integers(len(tables))
    tables[place] = _other(int(tables[place]), parts.size, rng)
    return parts._replace(tables=tables)


def _start(parts, rng):
    starts = parts.starts.copy()
    place = rng.integers(len(starts))
    starts[place] = _other(int(starts[place]), len(parts.code), rng)
    return parts._replace(starts=starts)


def _shortened(parts, rng):
    name = ("code", "tables", "starts")[rng.integers(3)]
    array = getattr(parts, name)
    return parts._replace(**{name: array[: rng.integers(len(array) + 1)].copy()})


def _smaller(parts, rng):
    return parts._replace(size=int(rng.integers(1, parts.size + 1)))


def _constant(parts, rng):
    if not parts.constants:
        return parts
    constants = list(parts.constants)
    k = rng.integers(len(constants))
    constants[k] = constants[k][0], rng.choice(WILD, constants[k][1].size)
    return parts._replace(constants=constants)


FAULTS = (*[_field] * 6, *[_entry] * 6, _exchanged, _exchanged, _swapped, _start, _shortened, _smaller, _constant)
