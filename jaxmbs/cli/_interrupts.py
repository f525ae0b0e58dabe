"""Interrupts that are not lost in code that swallows exceptions.

Python drops an exception raised inside a callback of its garbage collector.  JAX has such a callback, and after long
compiled work it is often the first Python that runs, so the interrupt is remembered as well as raised.
"""

import signal
from contextlib import contextmanager

_asked = False


@contextmanager
def interrupts_remembered():
    """Remember interrupts, and raise one that was dropped at the end."""
    global _asked
    _asked = False

    def ask(number, frame):
        global _asked
        _asked = True
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield
        raise_dropped()
    finally:
        signal.signal(signal.SIGINT, before)


def raise_dropped() -> None:
    """Raise KeyboardInterrupt if one was asked for."""
    if _asked:
        raise KeyboardInterrupt
