"""The tape of a traced program."""

import numpy as np
from jax.extend.core import ClosedJaxpr

from . import _control, _elementwise, _index, _linalg, _rearrange, _reduce  # noqa: F401  (they register rules)
from ._flatten import Atom, Limits, TooLargeError, UnsupportedError
from ._memory import Value
from ._opcodes import FIELDS, WHOLE
from ._pairs import has_complex, real_program
from ._parts import Parts, Place
from ._writer import Writer


def written(program: ClosedJaxpr, limits: Limits) -> Parts:
    """The parts of a tape that runs a program.  Raises: UnsupportedError."""
    try:
        return _parts(program, program, limits)
    except TooLargeError:
        raise
    except UnsupportedError:  # only now, since few programs have complex numbers and all would be searched for them
        if not has_complex(program):
            raise
    return _parts(real_program(program), program, limits)


def _parts(program, asked, limits):
    """The parts for a program of real numbers that stands for the one asked for."""
    given, wanted = ([_described(v.aval) for v in each] for each in (asked.jaxpr.invars, asked.jaxpr.outvars))
    writer = Writer(limits)
    shapes = [Atom(variable.aval) for variable in program.jaxpr.invars]
    inputs = []
    for shape in shapes:
        buffer = writer.arena.buffer(shape.size, is_lasting=True)
        inputs.append(Value(buffer, buffer.place, shape.size == 1))
    outputs, _ = writer.body(program, inputs, shapes)
    return Parts(
        code=_whole([row for tape in writer.tapes for row in tape]).reshape(-1, len(FIELDS)),
        starts=_whole(np.cumsum([0, *map(len, writer.tapes)])),
        tables=_whole(writer.arena.all_tables()),
        size=writer.arena.size,
        constants=writer.arena.constants,
        inputs=_places(inputs, given, False),
        outputs=_places(outputs, wanted, True),
        shown=[Place(place, False, (size,), np.dtype(float)) for place, size in writer.shown],
    )


def _whole(numbers):
    found, ends = np.asarray(numbers, np.int64), np.iinfo(WHOLE)
    if np.any((found < ends.min) | (found > ends.max)):
        raise UnsupportedError("an instruction with numbers beyond 2^31")
    return found.astype(WHOLE)


def _described(aval):
    """Shape and type of an input or result, a complex one twice: of its two parts."""
    if aval.dtype == np.complex128:
        return [(tuple(aval.shape), np.dtype(np.complex128))] * 2
    atom = Atom(aval)
    return [(atom.shape, atom.dtype)]


def _places(values, described, may_be_splat):
    flat = [each for one in described for each in one]
    return [
        Place(value.place, may_be_splat and bool(value.is_splat), shape, dtype)
        for value, (shape, dtype) in zip(values, flat, strict=True)
    ]
