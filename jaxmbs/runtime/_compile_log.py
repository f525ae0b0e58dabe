"""A line on what is being compiled when that takes long, so that nobody thinks that the program hangs."""

import functools
import sys
import threading

import jax

from ._question import current_question

_LOWERED, _COMPILED = "/jax/core/compile/jaxpr_to_mlir_module_duration", "/jax/core/compile/backend_compile_duration"
_after: float | None = 5.0
_waiting: dict[int, threading.Timer] = {}  # by thread: XLA compiles what its own thread has traced
_told: set[int] = set()


def report_compiles(after: float | None = 5.0) -> None:
    """Say on the standard error stream what is being compiled when that takes longer.

    Args: after: seconds, 5 if this is never called; None: say nothing.

    It concerns all programs of the process from the first question to this library on, the user's own as well.
    """
    global _after
    _after = after


@functools.cache
def start_listening() -> None:
    """Be told by JAX of programs compiled; it counts for the process, so it waits for the library's first program."""
    jax.monitoring.register_event_duration_secs_listener(_heard)


def _heard(event: str, duration_secs: float, **about: str | int) -> None:
    thread, question = threading.get_ident(), current_question()
    fun_name = question or about.get("fun_name", "a program")
    if event == _LOWERED and _after is not None:
        # what JAX derives or compiles outside of `mbs.jit` never runs on a tape
        advice = "mbs.cache() keeps it" if question else "mbs.jit(jax.grad(...)) in place of jax.grad answers at once"
        timer = threading.Timer(_after, _tell, (thread, f"compiling {fun_name} ... (once; {advice})"))
        timer.daemon = True
        _stop(thread)
        _waiting[thread] = timer
        timer.start()
    elif event == _COMPILED:
        _stop(thread)
        if thread in _told:
            _told.discard(thread)
            _say(f"compiled {fun_name} in {duration_secs:.0f} s")


def _tell(thread, line):
    _told.add(thread)
    _say(line)


def _stop(thread):
    timer = _waiting.pop(thread, None)
    if timer is not None:
        timer.cancel()


def _say(line):
    print(f"jaxmbs: {line}", file=sys.stderr, flush=True)
