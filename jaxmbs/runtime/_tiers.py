"""Tiers of a program: its tape at once, and what XLA compiles of it once that is worth it."""

import contextlib
import contextvars
import os
import threading
import time
from collections.abc import Callable, Iterator

from . import _tuning as tuning

#: What the environment fixes for all programs of `compile="auto"`: "tape" or "full"; "auto" leaves it to their cost.
FIXED = os.environ.get("JAXMBS_COMPILE", "auto")
if FIXED not in ("auto", "tape", "full"):
    raise ValueError(f"JAXMBS_COMPILE={FIXED!r} must be auto, tape or full")
_compiling = threading.Lock()  # one program at a time, so that the other cores stay the user's
#: Of a search under way: for each of its programs whether it is compiled, and whether it was worth that before.
_KEPT: contextvars.ContextVar[dict["Tier", tuple[bool, bool]] | None] = contextvars.ContextVar("kept", default=None)


def may_run_on_tapes(compile: str) -> bool:
    """True for programs of a kind that tapes may have: the environment decides for who names none."""
    return compile == "tape" or (compile != "full" and FIXED != "full")


@contextlib.contextmanager
def kept_tiers() -> Iterator[None]:
    """A context in which programs do not change their tier: a search has one from its begin to its end, since tiers
    differ by rounding.  What has cost as much as compiling in it is compiled beside the next one."""
    if _KEPT.get() is not None:
        yield
        return
    token = _KEPT.set({})
    try:
        yield
    finally:
        _KEPT.reset(token)


class Tier:
    """The cost of a tape so far, and whether the compiler's program has taken its place.

    It takes it between two calls, when both have cost the same: no more than twice what the better choice from the
    start would have cost.
    """

    def __init__(self, num_instructions: int):
        self._is_compiled = False
        self._is_begun = FIXED == "tape"
        self._first: float | None = None
        self._left = self._whole = tuning.COMPILE_START + num_instructions * tuning.COMPILE_SECONDS

    @contextlib.contextmanager
    def measured(self) -> Iterator[None]:
        """Count what is done inside [CPU s of this thread]."""
        start = time.thread_time()
        yield
        cost = time.thread_time() - start
        self._first = cost if self._first is None else self._first
        self._left -= cost

    @property
    def is_compiled(self) -> bool:
        """True where the compiler's program is to run."""
        return self._is_compiled if _KEPT.get() is None else self._kept()[0]

    def _kept(self):
        kept = _KEPT.get()
        assert kept is not None
        return kept.setdefault(self, (self._is_compiled, self._left < 0))

    @property
    def has_run(self) -> bool:
        """True once a run was measured."""
        return self._first is not None

    def is_dear(self, runs: int) -> bool:
        """True if as many runs as the first one cost more than compiling."""
        return FIXED == "auto" and self._first is not None and runs * self._first > self._whole

    def is_worth_compiling(self) -> bool:
        """True once the tape has cost what compiling will."""
        is_worth = self._left < 0 if _KEPT.get() is None else self._kept()[1]
        return is_worth and not self._is_begun and not _compiling.locked()

    def compile(self, by_compiler: Callable) -> None:
        """Compile in a thread; the process waits for it at its end, since XLA cannot be interrupted."""
        self._is_begun = True

        def work():
            with _compiling, contextlib.suppress(Exception):  # the tape goes on
                by_compiler()
                self._is_compiled = True

        # in the context of the question, whose name is told
        threading.Thread(target=contextvars.copy_context().run, args=(work,), name="jaxmbs compiler").start()
