"""The tape of a traced program."""

import numpy as np
from jax.extend.core import ClosedJaxpr

from . import _control, _elementwise, _index, _linalg, _rearrange, _reduce  # noqa: F401  (they register rules)
from ._flatten import Atom
from ._memory import Value
from ._opcodes import FIELDS
from ._parts import Parts, Place
from ._writer import Writer


def written(program: ClosedJaxpr) -> Parts:
    """The parts of a tape that runs a program.  Raises: UnsupportedError."""
    writer = Writer()
    shapes = [Atom(variable.aval) for variable in program.jaxpr.invars]
    inputs = []
    for shape in shapes:
        buffer = writer.arena.buffer(shape.size, is_lasting=True)
        inputs.append(Value(buffer, buffer.place, shape.size == 1))
    outputs, results = writer.body(program, inputs, shapes)
    return Parts(
        code=np.array([row for tape in writer.tapes for row in tape], np.int64).reshape(-1, len(FIELDS)),
        starts=np.cumsum([0, *map(len, writer.tapes)]),
        tables=writer.arena.all_tables(),
        size=writer.arena.size,
        constants=writer.arena.constants,
        inputs=[Place(v.place, False, a.shape, a.dtype) for v, a in zip(inputs, shapes, strict=True)],
        outputs=[Place(v.place, bool(v.is_splat), a.shape, a.dtype) for v, a in zip(outputs, results, strict=True)],
        largest_work=writer.largest_work,
    )
