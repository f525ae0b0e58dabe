"""Tapes in several threads, in a process that was forked and in a new one give the same bits."""

import concurrent.futures
import hashlib
import multiprocessing
import os
import threading

import jax
import numpy as np
import pytest
from jax import lax

from jaxmbs.runtime.tape import Tape, is_available, read_tape, write_tape

from .programs import PROGRAMS
from .test_tape import tape_of

pytestmark = pytest.mark.skipif(not is_available(), reason="this installation was made without a C compiler")
NAMES = ["linear algebra", "projectors", "scan", "branches in a loop", "several axes", "loops in a loop", "scatters"]


def bits(results):
    return hashlib.sha256(b"".join(np.ascontiguousarray(x).tobytes() for x in results)).hexdigest()


def bits_of(name):
    return bits(tape_of(name)(*PROGRAMS[name][1]))


def bits_from(data, args):
    """Of a tape as bytes, for a process of its own."""
    return bits(read_tape(data)(*args))


def test_threads_at_once_have_the_bits_of_one():
    want = {name: bits_of(name) for name in NAMES}
    work = NAMES * 60
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        assert list(pool.map(bits_of, work)) == [want[name] for name in work]


def test_other_threads_go_on_while_a_tape_runs():
    turns = 200_000
    tape = Tape(jax.make_jaxpr(lambda x: lax.fori_loop(0, turns, lambda k, x: x * 0.5 + 1.0, x))(np.ones(50)))
    thread = threading.Thread(target=tape, args=(np.ones(50),))
    thread.start()
    count = 0
    while thread.is_alive():
        count += 1
    assert count > 1000


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::DeprecationWarning")
def test_a_forked_process_has_the_same_bits():
    """Forked while other threads run tapes."""
    want = "".join(map(bits_of, NAMES))
    is_over = threading.Event()

    def go_on():
        while not is_over.is_set():
            bits_of("scan")

    threads = [threading.Thread(target=go_on) for _ in range(2)]
    for thread in threads:
        thread.start()
    try:
        for _ in range(5):
            assert _of_child(lambda: "".join(map(bits_of, NAMES))) == want
    finally:
        is_over.set()
        for thread in threads:
            thread.join()


def _of_child(function):
    """The text that a function returns in a forked process."""
    receiver, sender = os.pipe()
    child = os.fork()
    if not child:
        try:
            os.write(sender, function().encode())
        finally:
            os._exit(0)
    os.close(sender)
    with open(receiver, "rb") as pipe:
        found = pipe.read().decode()
    os.waitpid(child, 0)
    return found


@pytest.mark.long
def test_a_spawned_process_has_the_same_bits():
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = pool.starmap(bits_from, [(write_tape(tape_of(name)), PROGRAMS[name][1]) for name in NAMES])
    assert found == [bits_of(name) for name in NAMES]
