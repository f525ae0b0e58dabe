"""What takes long to compile is named, once, and not when it is switched off."""

import threading
import time

import jax
import jax.numpy as jnp
import pytest

import jaxmbs as mbs
from jaxmbs.runtime import _compile_log as compile_notes


@pytest.fixture
def _restored():
    compile_notes.start_listening()
    yield
    mbs.runtime.report_compiles()


def program(number):
    """A function of another kind for each number, so that it is compiled."""

    @jax.jit
    def springy(x):
        for _ in range(300):
            x = jnp.sin(x) @ x + number
        return x

    return springy


@pytest.mark.long
@pytest.mark.usefixtures("_restored")
def test_a_long_compile_is_named_and_its_time_told(capsys):
    mbs.runtime.report_compiles(after=0.0)
    program(time.time())(jnp.eye(3)).block_until_ready()
    lines = [line for line in capsys.readouterr().err.splitlines() if "springy" in line]
    assert len(lines) == 2
    assert lines[0].startswith("jaxmbs: compiling jit(springy)") and lines[1].startswith(
        "jaxmbs: compiled jit(springy)"
    )


@pytest.mark.long
@pytest.mark.usefixtures("_restored")
@pytest.mark.parametrize("after", [None, 600.0])
def test_nothing_is_said_when_it_is_off_or_was_quick(capsys, after):
    mbs.runtime.report_compiles(after)
    threads = threading.active_count()
    program(time.time())(jnp.eye(3)).block_until_ready()
    assert capsys.readouterr().err == ""
    assert not compile_notes._waiting
    time.sleep(0.05)
    assert threading.active_count() <= threads + 1


def test_the_library_listens_from_its_first_program_on():
    b = mbs.SystemBuilder()
    b.body("bob", 1.0, (0.1, 0.0, 0.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.build()
    assert compile_notes.start_listening.cache_info().currsize == 1
