"""Files are there as a whole or not at all, whatever ends the writing; what was there before stays."""

import os
import signal
import threading

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import atomic_write as whole_file
from jaxmbs import viz
from jaxmbs.atomic_write import atomic_path, write_atomic
from jaxmbs.bondgraph._drawing import draw_bond_graph


def swinging():
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    b.body("bob", mass=1.0, com=(0.0, -1.0, 0.0))
    b.joint("pin", mbs.Revolute("z"), "ground", "bob")
    return b


def scene(path):
    system = swinging().build()
    viz.scene(system, mbs.State.at(system), path)


def graph(path):
    system = swinging().build()
    draw_bond_graph(mbs.bondgraph.bond_graph(system), path)


WRITERS = {
    "scene": scene,
    "graph": graph,
    "model": lambda path: mbs.save_model(swinging(), path),
    "program": lambda path: mbs.runtime.export(jnp.sin, (jnp.zeros(2),), path),
    "whole": lambda path: write_atomic(path, "all of it"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_writer_that_fails_keeps_the_good_file(name, tmp_path, monkeypatch):
    """The disk is full at the end: the old file stays, no half one beside it."""
    path = tmp_path / "file.json"
    path.write_text("good")

    def full(*args):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(whole_file.os, "fsync", full)
        with pytest.raises(OSError, match="No space left"):
            WRITERS[name](path)
    assert path.read_text() == "good" and os.listdir(tmp_path) == ["file.json"]
    WRITERS[name](path)
    assert path.read_bytes() != b"good" and os.listdir(tmp_path) == ["file.json"]


@pytest.fixture
def interruptible():
    """Interrupts raise, in a process too that was started in the background, where shells have them ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signals_leave_no_half_file(number, tmp_path, interruptible):
    path = tmp_path / "file"
    with pytest.raises((SystemExit, KeyboardInterrupt)), atomic_path(path) as part:
        part.write_text("half")
        os.kill(os.getpid(), number)
        threading.Event().wait(5.0)  # until the signal is there
    assert os.listdir(tmp_path) == [] and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_other_threads_write_too(tmp_path):
    """Where Python takes no handlers of signals."""
    thread = threading.Thread(target=write_atomic, args=(tmp_path / "file", b"all"))
    thread.start()
    thread.join()
    assert (tmp_path / "file").read_bytes() == b"all"


def test_links_modes_and_what_is_no_file(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    write_atomic(link, "new")
    assert link.is_symlink() and target.read_text() == "new" and target.stat().st_mode & 0o777 == 0o640
    write_atomic("/dev/null", "gone")
    assert not os.path.isfile("/dev/null")
    with pytest.raises(FileNotFoundError, match="nowhere/file"):
        write_atomic(tmp_path / "nowhere" / "file", "x")
    write_atomic(tmp_path / ("n" * 250), "x")
    assert np.all([entry.stat().st_size for entry in tmp_path.iterdir()])
