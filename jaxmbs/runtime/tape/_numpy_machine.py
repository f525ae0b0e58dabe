"""The machine in NumPy, for installations that were made without a C compiler: the same tapes, slower."""

import time
from collections.abc import Callable

import numpy as np

from .. import _tuning as tuning
from . import _numpy_algebra, _numpy_arrays, _numpy_elementwise  # noqa: F401  (they register bindings)
from ._host import call_host
from ._numpy_memory import BINDINGS, Action, Instruction, Memory
from ._opcodes import NAMES
from ._overtime import LIMITED, OvertimeError
from ._parts import Parts

#: Turns of loops between two looks at the clock, which is slow to answer.
_TURNS = 64


class NumpyRun:
    """A tape bound to an arena: each instruction is a function and its arguments."""

    def __init__(self, parts: Parts, arena: np.ndarray):
        self._parts, self._arena, self._end = parts, arena, float("inf")
        self._turns = 0
        memory = Memory(arena, parts.tables)
        rows = [Instruction(*row) for row in parts.code.tolist()]
        actions = [self._action(k, row, memory) for k, row in enumerate(rows)]
        self._tapes = [actions[low:high] for low, high in zip(parts.starts[:-1], parts.starts[1:], strict=True)]

    def __call__(self) -> None:
        """Run the tape.  Raises: OvertimeError where time is limited, when it has cost what compiling would."""
        seconds = tuning.COMPILE_START + tuning.COMPILE_SECONDS * len(self._parts.code)
        self._end = time.thread_time() + seconds if LIMITED.get() else float("inf")
        with np.errstate(all="ignore"):
            self._run(0)

    def _run(self, tape):
        for function, arguments in self._tapes[tape]:
            function(*arguments)

    def _action(self, number: int, i: Instruction, memory: Memory) -> Action:
        name = NAMES[i.op]
        if name == "HOST":
            return call_host, (self._parts.code[number], self._parts.tables, self._arena)
        if name in _CONTROL:
            return _CONTROL[name](self, i, memory), ()
        return BINDINGS[name](i, memory)

    def _turn(self, tape):
        """Run the body of a loop, while there is time."""
        self._turns += 1
        if self._turns % _TURNS == 0 and time.thread_time() > self._end:
            raise OvertimeError
        self._run(tape)

    def _while(self, i: Instruction, memory: Memory) -> Callable[[], None]:
        condition = memory.doubles[i.a : i.a + 1]

        def loop():
            self._run(i.x0)
            while condition[0] != 0.0:
                self._turn(i.x1)
                self._run(i.x0)

        return loop

    def _scan(self, i: Instruction, memory: Memory) -> Callable[[], None]:
        table = memory.table(i.table, i.x1 + i.x2, 4).tolist()
        stacks = [memory.rows(stack, i.n, length, length) for stack, _, length, _ in table]
        rows = [memory.rows(row, 1, length, length, bool(is_splat))[0] for _, row, length, is_splat in table]
        given = list(zip(rows[: i.x1], stacks[: i.x1], strict=True))
        taken = list(zip(stacks[i.x1 :], rows[i.x1 :], strict=True))

        def loop():
            for k in reversed(range(i.n)) if i.mode else range(i.n):
                for row, stack in given:
                    row[...] = stack[k]
                self._turn(i.x0)
                for stack, row in taken:
                    stack[k] = row

        return loop

    def _cond(self, i: Instruction, memory: Memory) -> Callable[[], None]:
        tapes = memory.table(i.table, i.x0).tolist()
        doubles, last = memory.doubles, i.x0 - 1

        def branch():
            index = doubles.item(i.a)
            self._run(tapes[0 if not index > 0.0 else int(index) if index < last else last])

        return branch


_CONTROL = {"WHILE": NumpyRun._while, "SCAN": NumpyRun._scan, "COND": NumpyRun._cond}
