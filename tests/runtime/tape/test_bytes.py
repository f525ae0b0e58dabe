"""Tapes as bytes: the same tape comes back; what is no tape of this machine is refused."""

import numpy as np
import pytest

from jaxmbs.runtime.tape import TapeError, is_available
from jaxmbs.runtime.tape._bytes import read_tape, write_tape

from .programs import PROGRAMS
from .test_tape import tape_of


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_tape_comes_back(name):
    tape = tape_of(name)
    data = write_tape(tape)
    again = read_tape(data)
    assert write_tape(again) == data
    assert again.parts.inputs == tape.parts.inputs and again.parts.outputs == tape.parts.outputs
    assert again.num_doubles == tape.num_doubles
    if is_available():
        for found, want in zip(again(*PROGRAMS[name][1]), tape(*PROGRAMS[name][1]), strict=True):
            np.testing.assert_array_equal(found, want)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda data: b"", "no tape"),
        (lambda data: data[:40], "damaged"),
        (lambda data: data[:-1], "damaged"),
        (lambda data: data + b"\0", "damaged"),
        (lambda data: b"pickle" + data, "no tape"),
        (lambda data: data[:20] + bytes([data[20] ^ 1]) + data[21:], "another release"),
        (lambda data: data[:500] + bytes([data[500] ^ 128]) + data[501:], "damaged"),
    ],
)
def test_other_bytes_are_refused(change, fault):
    with pytest.raises(TapeError, match=fault):
        read_tape(change(write_tape(tape_of("scan"))))
