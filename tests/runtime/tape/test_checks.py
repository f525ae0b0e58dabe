"""Every operand of every kind of instruction is checked."""

import numpy as np
import pytest

from jaxmbs.runtime.tape import TapeError
from jaxmbs.runtime.tape._checks import CHECKS
from jaxmbs.runtime.tape._opcodes import FIELDS, OPERANDS, WHOLE
from jaxmbs.runtime.tape._validate import _DEEPEST, validate

from .programs import PROGRAMS
from .test_tape import tape_of

#: Fields that an instruction of each kind reads beside `n`.
READ = {
    "UNARY": "out a",
    "BINARY": "out a b",
    "TERNARY": "out a b c",
    "TAKE": "out a table",
    "PAD": "out a b table",
    "JOIN": "out x0 table",
    "SLICE": "out a x0 table",
    "UPDATE": "out a b x0 x1 table",
    "GATHER": "out a b c x0 x1 x2 table",
    "SCATTER": "out a b c x0 x1 x2 table",
    "REDUCTION": "out a x0 x1",
    "ARGUMENT": "out a x0 x1",
    "CUMULATIVE": "out a x0 x1",
    "SORT": "out a c x0 x1 x2 x3",
    "DOT": "out a b x0 table",
    "DOT_TABLE": "out a b x0 x1 x2 x3 table",
    "CHOLESKY": "out a x0 x1",
    "TRIANGULAR": "out a b x0 x1 x2",
    "LU": "out a b c x0 x1 x2",
    "WHILE": "a x0 x1",
    "SCAN": "x0 x1 x2 table",
    "COND": "a x0 table",
    "HOST": "x0 x1 x2 table",
}


def test_every_kind_of_operands_has_its_check():
    assert set(OPERANDS) == set(CHECKS) == set(READ)


@pytest.mark.parametrize("kind", READ)
def test_each_field_is_checked(kind):
    """Far out, before the start and so large that sums of it wrap round."""
    parts, row = next(
        (parts, row)
        for parts in (tape_of(name).parts for name in PROGRAMS)
        for row in np.flatnonzero([OPERANDS[op] == kind for op in parts.code[:, 0]])
        if not parts.code[row, FIELDS.index("splat")]
    )
    for field in READ[kind].split():
        for value in (-1, -(2**31), 2**30, 2**31 - 1):
            code = parts.code.copy()
            code[row, FIELDS.index(field)] = value
            with pytest.raises(TapeError, match=f"instruction {row} "):
                parts._replace(code=code).validated()


def test_unknown_operations_and_forms_are_refused():
    parts = tape_of("while").parts
    code = parts.code.copy()
    code[0, 0] = len(OPERANDS)
    wrong = [
        (parts._replace(code=code), "does not have"),
        (parts._replace(code=parts.code[:, :-1].copy()), "fields"),
        (parts._replace(code=parts.code.astype(np.int64)), "32 bits"),
        (parts._replace(starts=parts.starts[::-1].copy()), "one after another"),
        (parts._replace(tables=parts.tables[:0]), "after them"),
        (parts._replace(constants=[(parts.size, np.ones(1))]), "outside of the arena"),
        (parts._replace(outputs=[parts.outputs[0]._replace(start=parts.size)]), "outside of the arena"),
    ]
    for tape, fault in wrong:
        with pytest.raises(TapeError, match=fault):
            tape.validated()


def nested(depth, inner):
    """Loops inside of each other: the body of each is the next tape."""
    code = np.zeros((depth, len(FIELDS)), WHOLE)
    code[:, 0] = OPERANDS.index("SCAN")
    code[:, FIELDS.index("x0")] = inner(np.arange(depth))
    return code, np.array([*range(depth + 1), depth], WHOLE), np.zeros(1, WHOLE), 1, []


def test_tapes_nest_and_none_runs_itself():
    validate(*nested(_DEEPEST, lambda k: k + 1))
    with pytest.raises(TapeError, match="inside of each other"):
        validate(*nested(_DEEPEST + 1, lambda k: k + 1))
    for inner in (lambda k: k, lambda k: 0 * k, lambda k: k - 1):
        with pytest.raises(TapeError, match="not inside of its own"):
            validate(*nested(3, inner))
