"""The writer of a tape: a traced program becomes instructions over an arena, by a rule for each primitive of JAX."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ._flatten import Atom, Limits, Operation, TooLargeError, UnsupportedError, flatten
from ._fold import folded
from ._memory import Arena, Buffer, Value
from ._opcodes import CODE, FIELDS

#: The rule of each primitive: writes instructions, returns the values of its outputs.
RULES: dict[str, Callable[["Writer", Operation, list[Value]], list[Value]]] = {}


def rule(*names: str) -> Callable[[Callable], Callable]:
    """Register a rule for primitives: `function(writer, operation, values)`."""

    def register(function):
        RULES.update(dict.fromkeys(names, function))
        return function

    return register


class Writer:
    """Instructions of a tape and of those inside of it, while they are written."""

    def __init__(self, limits: Limits):
        self.arena = Arena(limits.doubles)
        self.tapes: list[list[tuple[int, ...]]] = [[]]
        self._most_work = limits.work
        self.shown: list[tuple[int, int]] = []  # place and size
        self._tape = 0
        self._temporary: list[Buffer] = []
        self._dying: dict[Buffer, int] = {}

    # ------------------------------------------------------------------------------------------------- instructions
    def claim_work(self, multiplications: int) -> None:
        """Raises: TooLargeError if an instruction may not have as many."""
        if multiplications > self._most_work:
            raise TooLargeError(f"an instruction of {multiplications:,} multiplications")

    def emit(self, op: str, n: int, **fields: int) -> None:
        """Write an instruction for n numbers."""
        row = {"op": CODE[op], "n": n, **fields}
        self.tapes[self._tape].append(tuple(int(row.get(name, 0)) for name in FIELDS))

    def new(self, size: int) -> Value:
        """A place for the result of an instruction."""
        buffer = self.arena.buffer(size)
        return Value(buffer, buffer.place, size == 1)

    def lasting(self, size: int) -> Value:
        """A place in which nothing else is ever written."""
        buffer = self.arena.buffer(size, is_lasting=True)
        return Value(buffer, buffer.place, size == 1)

    def temporary(self, size: int) -> Value:
        """A place that is free again after this operation."""
        value = self.new(size)
        self._temporary.append(value.buffer)
        return value

    def dense(self, value: Value, size: int) -> int:
        """The place of all numbers of a value, one by one."""
        if not value.is_splat or size == 1:
            return value.place
        copy = self.temporary(size)
        self.emit("COPY", size, out=copy.place, a=value.place, splat=1)
        return copy.place

    def copy(self, value: Value, size: int, out: int) -> None:
        """Write the numbers of a value to a place."""
        if size and (value.is_splat and size > 1 or value.place != out):
            self.emit("COPY", size, out=out, a=value.place, splat=value.is_splat and size > 1)

    def may_overwrite(self, value: Value, others: Sequence[Value] = ()) -> bool:
        """True if this operation may change the buffer of an operand: nothing in it is needed later."""
        buffer = value.buffer
        is_whole = not value.is_splat and value.place == buffer.place
        is_last = buffer.views == self._dying.get(buffer, 0)
        return is_whole and is_last and buffer.is_writable and all(other.buffer is not buffer for other in others)

    # -------------------------------------------------------------------------------------------------------- bodies
    def body(self, program: Any, values: Sequence[Value], shapes: Sequence[Any]) -> tuple[list[Value], list[Atom]]:
        """Write a program on the tape at hand; the values of its results, which stay.

        Args: values: of its inputs; shapes: their shapes and types.
        """
        inputs = [Atom(shape, value.constant) for value, shape in zip(values, shapes, strict=True)]
        operations, results = flatten(program, inputs)
        last = {id(atom): k for k, operation in enumerate(operations) for atom in operation.inputs}
        last |= {id(atom): len(operations) for atom in results}
        env = {id(atom): value for atom, value in zip(inputs, values, strict=True)}
        for atom in inputs:
            env[id(atom)].buffer.views += id(atom) in last
        outer = self._temporary, self._dying
        for k, operation in enumerate(operations):
            self._one(operation, env, last, k)
        self._temporary, self._dying = outer
        return [self._value(atom, env) for atom in results], results

    def _value(self, atom, env):
        if id(atom) not in env:
            env[id(atom)] = self.arena.constant(atom.constant)
        return env[id(atom)]

    def _one(self, operation, env, last, k):
        values = [self._value(atom, env) for atom in operation.inputs]
        dying = {id(atom) for atom in operation.inputs if last[id(atom)] == k}
        self._temporary, self._dying = [], {}
        for key in dying:
            buffer = env[key].buffer
            self._dying[buffer] = self._dying.get(buffer, 0) + 1
        for atom, value in zip(operation.outputs, self.write(operation, values), strict=True):
            env[id(atom)] = value
            value.buffer.views += 1
        for buffer in self._temporary:
            self.arena.release(buffer)
        unused = {id(atom) for atom in operation.outputs if id(atom) not in last}
        for key in dying | unused:
            buffer = env[key].buffer
            buffer.views -= 1
            if buffer.views == 0:
                self.arena.release(buffer)

    def write(self, operation: Operation, values: list[Value]) -> list[Value]:
        """Write one operation; the values of its outputs.  Raises: UnsupportedError for one without a rule."""
        if all(value.constant is not None for value in values):
            found = folded(operation, [value.constant for value in values])
            if found is not None:
                return [self.arena.constant(found)]
        if operation.name not in RULES:
            raise UnsupportedError(operation.name)
        if all(atom.size == 0 for atom in operation.outputs):
            return [self.arena.constant(np.zeros(atom.shape, atom.dtype)) for atom in operation.outputs]
        return RULES[operation.name](self, operation, values)

    # ---------------------------------------------------------------------------------------------------- inner tapes
    def new_tape(self) -> int:
        """A tape inside of this one."""
        self.tapes.append([])
        return len(self.tapes) - 1

    def on_tape(self, tape: int, write: Callable[[], Any]) -> Any:
        """Result of `write`, whose instructions go to another tape."""
        outer, self._tape = self._tape, tape
        found = write()
        self._tape = outer
        return found

    def borrowed(
        self, values: Sequence[Value], writable: Callable[[Value], bool] = lambda value: False
    ) -> list[Value]:
        """Values for an inner tape, which neither frees their buffers nor, unless `writable`, changes them."""
        buffers = {v.buffer: Buffer(v.buffer.place, v.buffer.size, False, writable(v), v.buffer) for v in values}
        return [Value(buffers[v.buffer], v.place, v.is_splat, v.constant) for v in values]
