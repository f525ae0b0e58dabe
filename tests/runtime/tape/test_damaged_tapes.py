"""Damaged tapes are refused, or run within their arena: in the machine built with sanitisers."""

import functools
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from jaxmbs.runtime import tape as room
from jaxmbs.runtime.tape import Tape, TapeError
from jaxmbs.runtime.tape._bytes import _DIGEST, _MARK, _digest, read_tape, write_tape
from jaxmbs.runtime.tape._opcodes import CODE, FIELDS

from .damage import arena_of, damaged
from .programs import PROGRAMS
from .test_tape import tape_of

HERE = Path(__file__).parent
SANITIZERS = "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all"
#: Tapes that the machine runs in one process.
TOGETHER = 2000


@functools.cache
def driver(folder):
    """A program that runs tapes of its input, or None where the compiler or its sanitisers are missing."""
    compiler = shutil.which("cc")
    program = folder / "driver"
    machine = Path(room.__file__).parent
    command = [compiler, "-O0", "-g1", *SANITIZERS, f"-I{machine}", "-o", str(program), str(HERE / "driver.c"), "-lm"]
    return program if compiler and not subprocess.run(command, capture_output=True).returncode else None


def run_all(program, tapes):
    """Number of tapes that ran, and of those that ended; nothing was read or written outside of the arena."""
    data = b"".join(
        np.array([len(p.code), len(p.starts), len(p.tables), p.size]).tobytes()
        + b"".join(array.tobytes() for array in (p.code, p.starts, p.tables, arena))
        for p, arena in tapes
    )
    done = subprocess.run([program], input=data, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()[-4000:]
    return tuple(map(int, done.stdout.split()))


def fuzz(program, number, seed):
    """Numbers of damaged tapes that were refused, ran, and ended."""
    rng, names = np.random.default_rng(seed), list(PROGRAMS)
    sums, waiting = np.zeros(3, int), []
    for k in range(number):
        parts = damaged(tape_of(names[k % len(names)]).parts, rng)
        try:
            waiting.append((parts.validated(), arena_of(parts, rng)))
        except TapeError:
            sums[0] += 1
        if len(waiting) == TOGETHER or k == number - 1:
            sums[1:] += run_all(program, waiting)
            waiting = []
    return tuple(sums)


@pytest.fixture(scope="session")
def sanitized(tmp_path_factory):
    program = driver(tmp_path_factory.mktemp("driver"))
    return program or pytest.skip("no C compiler with sanitisers")


@pytest.mark.slow
@pytest.mark.parametrize("flag", [1, 2**8, 2**16, 2**30, -(2**31)])
def test_a_flag_is_one_whatever_bit_it_has(sanitized, flag):
    """The machine and the check read it alike: one number is written out, and no row that ends outside."""
    parts = tape_of("scan").parts
    tables, (scan,) = parts.tables.copy(), np.flatnonzero(parts.code[:, 0] == CODE["SCAN"])
    row = dict(zip(FIELDS, parts.code[scan], strict=True))
    first = row["table"] + 4 * row["x1"]
    tables[first + 1], tables[first + 3] = parts.size - 1, flag
    run_all(sanitized, [(parts._replace(tables=tables).validated(), np.zeros(parts.size))])


@pytest.mark.slow
def test_damaged_tapes_are_refused_or_stay_in_bounds(sanitized):
    refused, ran, ended = fuzz(sanitized, 2000, 0)
    assert refused + ran == 2000 and refused > 500 and ended > 500, (refused, ran, ended)


@pytest.mark.long
def test_many_damaged_tapes_are_refused_or_stay_in_bounds(sanitized):
    refused, ran, ended = fuzz(sanitized, 100_000, 1)
    print(f"{refused} refused, {ran} ran, {ended} of them to their end")
    assert refused + ran == 100_000


@pytest.mark.slow
def test_the_sanitisers_see_what_the_checks_refuse(sanitized):
    """A tape with one double less than it uses: refused by the checks, and found where nothing checks it."""
    parts = tape_of("products").parts
    short = parts._replace(size=int(np.max(parts.code[:, 3])))
    with pytest.raises(TapeError):
        short.validated()
    with pytest.raises(AssertionError, match="heap-buffer-overflow"):
        run_all(sanitized, [(short, np.zeros(short.size))])


def test_damaged_bytes_are_refused():
    """Every fault is seen by the digest; with that made anew, the rest is refused or a tape within its bounds."""
    rng, data = np.random.default_rng(3), write_tape(tape_of("scan"))
    head = len(_MARK) + 2 * _DIGEST
    kept = 0
    for _ in range(300):
        wrong = bytearray(data[: rng.integers(len(data))] if rng.random() < 0.2 else data)
        for place in rng.integers(0, max(len(wrong), 1), rng.integers(1, 4)):
            wrong[place : place + 1] = bytes(rng.integers(0, 256, rng.integers(1, 3), np.uint8))
        if wrong != data:
            with pytest.raises(TapeError):
                read_tape(bytes(wrong))
        body = bytes(wrong[head:])
        try:
            assert isinstance(read_tape(data[: head - _DIGEST] + _digest(body) + body), Tape)
            kept += 1
        except TapeError:
            pass
    assert kept < 250
