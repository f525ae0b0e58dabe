"""Multistart: evaluations requested by parallel searches are batched into one call of one program.

Optimisers on the host call back for one design at a time.  Each search therefore has a thread, of which one runs at a
time; when all of them wait for an evaluation, the caller's thread evaluates the requested designs as one batch.
"""

import threading
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np

from ..batching._batch import batch
from ..runtime import tuning
from ._optimum import Optimum


def run_multistart(
    searches: Sequence[Callable[[Callable], Optimum]], evaluate: Callable, compile: str = "full"
) -> list[Optimum]:
    """Run searches in parallel, each a function of an evaluator (x (n,), rows (k,)) that returns its optimum.

    Raises: the first error among them, after the others have stopped.
    """
    evaluator = _BatchedEvaluator(evaluate, compile)
    threads = [threading.Thread(target=evaluator.run_search, args=(k, search)) for k, search in enumerate(searches)]
    evaluator.run(threads)
    if evaluator.error is not None:
        raise evaluator.error
    return [evaluator.found[k] for k in range(len(searches))]


class _Cancelled(Exception):
    """Another search failed, or the caller was interrupted."""


class _BatchedEvaluator:
    """Collects the evaluations that threads request and evaluates them together."""

    def __init__(self, evaluate: Callable, compile: str) -> None:
        self._turn = threading.Condition()
        self._evaluate = lambda request: evaluate(request["x"], request["rows"])
        self._compile, self._x64 = compile, bool(jax.config.jax_enable_x64)  # type: ignore[attr-defined]
        self._requests: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._answers: dict[int, tuple] = {}
        self._running, self._cancelled = 0, False
        self.found: dict[int, Optimum] = {}
        self.error: BaseException | None = None

    def run(self, threads: list[threading.Thread]) -> None:
        """Start the threads and evaluate their requests until all searches have ended."""
        self._running = len(threads)
        for thread in threads:
            thread.start()
        try:
            with self._turn:
                while self._running:
                    if self._requests and len(self._requests) == self._running:
                        self._evaluate_requests()
                        self._turn.notify_all()
                    else:
                        self._turn.wait()
        finally:  # after an error or interrupt here too
            with self._turn:
                self._cancelled = True
                self._turn.notify_all()
            for thread in threads:
                thread.join()

    def run_search(self, k: int, search: Callable[[Callable], Optimum]) -> None:
        """Run search k in its thread; it holds the lock except while it waits for an evaluation."""
        with self._turn, jax.enable_x64(self._x64):  # settings by a context do not reach other threads
            try:
                self.found[k] = search(lambda x, rows: self._request(k, x, rows))
            except BaseException as error:  # raised again in the caller's thread
                self.error, self._cancelled = self.error or error, True  # the first is the cause of the others
            self._running -= 1
            self._turn.notify_all()

    def _request(self, k: int, x: Any, rows: Any) -> tuple:
        self._requests[k] = (np.asarray(x), np.asarray(rows))
        self._turn.notify_all()
        self._turn.wait_for(lambda: k in self._answers or self._cancelled)
        self._requests.pop(k, None)
        if self._cancelled:
            raise _Cancelled
        return self._answers.pop(k)

    def _evaluate_requests(self) -> None:
        """Evaluate one batch for all requests with equally many rows: each number of rows is a program."""
        for number in {len(rows) for _, rows in self._requests.values()}:
            waiting = [k for k, (_, rows) in self._requests.items() if len(rows) == number]
            x, rows = (np.stack(part) for part in zip(*(self._requests[k] for k in waiting), strict=True))
            columns = {"x": x, "rows": rows}
            chunk = tuning.SEARCHES_TOGETHER  # few: searches end one after another
            found = batch(self._evaluate, columns, chunk=chunk, progress=False, compile=self._compile).values
            self._answers |= {k: jax.tree.map(lambda leaf, j=j: leaf[j], found) for j, k in enumerate(waiting)}
        self._requests.clear()
