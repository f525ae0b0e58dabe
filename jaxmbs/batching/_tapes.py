"""Few designs on tapes: one after another on each core, with nothing compiled before."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from jaxtyping import PyTree

from ..runtime import UnsupportedError, tuning
from ._program import BatchedFunction
from ._table import num_designs


class DesignsOnTape:
    """The program of one design on a tape; called with columns (1, ...)."""

    def __init__(self, program: Any):
        self._program = program

    def __call__(self, *columns: Any) -> list:
        return [np.asarray(part)[None] for part in self._program.run(*(np.asarray(x)[0] for x in columns))]

    def compile_beside(self, compile: Callable[[], Any]) -> None:
        """Compile in a thread once the tape has cost as much; the batch after that is the compiled program's."""
        if self._program.tier.is_worth_compiling():
            self._program.tier.compile(compile)


def designs_on_tape(
    batched: BatchedFunction, designs: PyTree, total: int, is_named: bool = False
) -> DesignsOnTape | None:
    """The program for designs on tapes; None where they are to be compiled: many of them, or ones that take longer on
    tapes than the compiler does, or are compiled by now.

    Args: total: number of designs that the choice is for; is_named: the caller asks for tapes, whatever they cost.
    """
    if (total > tuning.TAPE_DESIGNS and not is_named) or not num_designs(designs):
        return None
    first = [np.asarray(x[0]) for x in jax.tree.leaves(designs)]
    program = batched.traced.on_tape(*first)
    if program is None or program.tier.is_compiled or program.is_refused:
        return None
    if not program.tier.has_run:
        try:
            program.run(*first)
        except UnsupportedError:
            return None
    return None if program.tier.is_dear(total) and not is_named else DesignsOnTape(program)
