"""A check of the compiler at hand: small programs, compiled in each way that users meet, against NumPy."""

import contextlib
from collections.abc import Callable, Iterator
from typing import NamedTuple

import jax
import numpy as np

from ..batching import batch
from ..runtime import jit, without_tricks
from ._compiler_programs import COMPILER_PROGRAMS, CompilerProgram

RELATIVE_ERROR = 1e-9  # of the largest number of a result, in double precision; a wrong lane is off by per cents


class WrongProgram(NamedTuple):
    """A program that does not compute what NumPy does, how it was compiled, and how many of its numbers are off."""

    name: str
    way: str
    wrong: int
    size: int

    def __str__(self) -> str:
        return f"{self.name} ({self.way}): {self.wrong} of {self.size} numbers are wrong"


#: The ways in which a user's program is compiled; with `mbs.batch` those that have a row for each design.
WAYS: dict[str, Callable[[CompilerProgram, np.ndarray], jax.Array]] = {
    "jax.jit": lambda program, x: jax.jit(program.jax)(x),
    "mbs.jit": lambda program, x: jit(program.jax, compile="full")(x),
    "mbs.jit, quick": lambda program, x: _compiled_quickly(program, x),
    "mbs.batch": lambda program, x: batch(program.row or program.jax, x, progress=False).values,
}


def _compiled_quickly(program, x):
    with without_tricks("tape"):  # or no compiler would be asked
        return jit(program.jax, compile="quick")(x)


def wrong_programs() -> Iterator[WrongProgram]:
    """The programs that the compiler gets wrong."""
    for name in COMPILER_PROGRAMS:
        yield from wrong_ways(name)


def wrong_ways(name: str) -> Iterator[WrongProgram]:
    """The ways in which the compiler gets one program wrong, on the default device and in double precision."""
    program = COMPILER_PROGRAMS[name]
    x = np.random.default_rng(0).uniform(0.5, 2.0, program.shape)
    truth = program.numpy(x)
    for way, run in WAYS.items():
        if way == "mbs.batch" and not program.row:
            continue
        with _double_precision(), jax.numpy_rank_promotion("allow"):
            wrong = _number_wrong(np.asarray(run(program, x)), truth)
        if wrong:
            yield WrongProgram(name, way, wrong, truth.size)


@contextlib.contextmanager
def _double_precision():
    """Of the whole process for a while: `jax.enable_x64` is one of a thread, and a batch runs on several."""
    given = jax.config.values["jax_enable_x64"]
    jax.config.update("jax_enable_x64", True)
    try:
        yield
    finally:
        jax.config.update("jax_enable_x64", given)


def _number_wrong(found: np.ndarray, truth: np.ndarray) -> int:
    return int(np.sum(~(np.abs(found - truth) <= RELATIVE_ERROR * np.max(np.abs(truth)))))
