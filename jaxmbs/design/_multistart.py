"""Searches of host engines from many first designs: what they ask meets in one program, many designs side by side.

Each search has a thread, of which one runs at a time; the caller's thread evaluates when all of them wait.
"""

import threading
from collections.abc import Callable, Sequence

import jax
import numpy as np

from ..batching._batch import batch
from ..runtime import tuning
from ._optimum import Optimum


def run_multistart(
    searches: Sequence[Callable[[Callable], Optimum]], evaluate: Callable, compile: str = "full"
) -> list[Optimum]:
    """Run searches, each a function of what evaluates (x (n,), rows (k,)) to its optimum.

    Raises: the first error among them, after the others have stopped.
    """
    meeting = _BatchedEvaluator(evaluate, compile)
    threads = [threading.Thread(target=meeting.attend, args=(k, search)) for k, search in enumerate(searches)]
    meeting.lead(threads)
    if meeting.error is not None:
        raise meeting.error
    return [meeting.found[k] for k in range(len(searches))]


class _Cancelled(Exception):
    """Another search failed, or the caller was interrupted."""


class _BatchedEvaluator:
    def __init__(self, evaluate, compile):
        self._turn = threading.Condition()
        self._evaluate = lambda asked: evaluate(asked["x"], asked["rows"])
        self._compile, self._x64 = compile, bool(jax.config.jax_enable_x64)
        self._asked: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._answers: dict[int, tuple] = {}
        self._running, self._over = 0, False
        self.found: dict[int, Optimum] = {}
        self.error: BaseException | None = None

    def lead(self, threads) -> None:
        """Answer until all searches have ended."""
        self._running = len(threads)
        for thread in threads:
            thread.start()
        try:
            with self._turn:
                while self._running:
                    if self._asked and len(self._asked) == self._running:
                        self._answer()
                        self._turn.notify_all()
                    else:
                        self._turn.wait()
        finally:  # after an error or interrupt here too
            with self._turn:
                self._over = True
                self._turn.notify_all()
            for thread in threads:
                thread.join()

    def attend(self, k, search) -> None:
        """Run a search, in its thread, whose turn it is until it asks."""
        with self._turn, jax.enable_x64(self._x64):  # settings by a context do not reach other threads
            try:
                self.found[k] = search(lambda x, rows: self._ask(k, x, rows))
            except BaseException as error:  # told in the caller's thread
                self.error, self._over = self.error or error, True  # the first is the cause of the others
            self._running -= 1
            self._turn.notify_all()

    def _ask(self, k, x, rows):
        self._asked[k] = (np.asarray(x), np.asarray(rows))
        self._turn.notify_all()
        self._turn.wait_for(lambda: k in self._answers or self._over)
        self._asked.pop(k, None)
        if self._over:
            raise _Cancelled
        return self._answers.pop(k)

    def _answer(self):
        """One batch for all who ask for as many rows."""
        for number in {len(rows) for _, rows in self._asked.values()}:
            asking = [k for k, (_, rows) in self._asked.items() if len(rows) == number]
            x, rows = (np.stack(part) for part in zip(*(self._asked[k] for k in asking), strict=True))
            columns = {"x": x, "rows": rows}
            chunk = tuning.SEARCHES_TOGETHER
            found = batch(self._evaluate, columns, chunk=chunk, progress=False, compile=self._compile).values
            self._answers |= {k: jax.tree.map(lambda leaf, j=j: leaf[j], found) for j, k in enumerate(asking)}
        self._asked.clear()
