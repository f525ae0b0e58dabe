"""Executor of a batch: chunks of designs on several threads, their results gathered on the host."""

import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

import jax
import numpy as np
from jaxtyping import PyTree
from tqdm import tqdm

from ..runtime import tuning
from ..status import Status
from ._program import BatchedFunction
from ._scheduling import costliest_first, growing_parts
from ._table import num_designs, select_designs


class ChunkExecutor:
    """Runs designs through `program`, `chunk` at a time, on `threads`; each chunk has `shares`, of as many
    devices or one after another, that do not wait for each other.

    Attributes:
        results: leaves (B, ...) of (values, status, cost); nan for designs that have not run, with a status of
            theirs.
        unflatten: function of them to (values, status, cost).
        computed: cost of all designs () so far, including the idle steps of those that wait for others.
    """

    def __init__(
        self,
        program: Callable,
        chunk: int,
        shares: int,
        threads: int,
        designs: PyTree,
        batched: BatchedFunction,
    ) -> None:
        self.program, self.chunk, self.shares, self.threads = program, chunk, shares, threads
        self.designs, self.computed = designs, 0.0
        self.unflatten = batched.unflatten
        self.results = [_result_array(num_designs(designs), x) for x in jax.tree.leaves(batched.shape)]
        *_, self.status, self.costs = self.results
        self.status[:] = Status.NOT_RUN

    def run(self, feasible: np.ndarray, bar: tqdm) -> BaseException | None:
        """Run the feasible designs; returns the error or interrupt that ended the run early, once its calls ended.

        A part of the designs is sorted by expected cost only when a thread would be idle without it, so that no
        thread waits for the others and the costs of as many designs as possible are known.
        """
        self.status[~feasible] = Status.INFEASIBLE
        bar.update(int(np.sum(~feasible)))
        left = deque(growing_parts(np.flatnonzero(feasible), tuning.FIRST_CHUNKS * self.threads * self.chunk))
        ran, calls = [np.arange(0)], set()
        with ThreadPoolExecutor(self.threads) as pool:
            try:
                while left or calls:
                    if left and len(calls) < self.threads:
                        order = costliest_first(self.designs, left.popleft(), np.concatenate(ran), self.costs)
                        starts = range(0, len(order), self.chunk)
                        calls |= {pool.submit(self._run_chunk, order[k : k + self.chunk]) for k in starts}
                    done, calls = wait(calls, return_when=FIRST_COMPLETED)
                    for call in done:
                        index, computed = call.result()
                        ran.append(index)
                        self.computed += computed
                        bar.update(len(index))
            except (Exception, KeyboardInterrupt) as error:
                pool.shutdown(wait=True, cancel_futures=True)
                return error
        return None

    def _run_chunk(self, index: np.ndarray) -> tuple[np.ndarray, float]:
        """Run one chunk, padded with its last design; returns its designs and their cost with idle steps."""
        filled = np.pad(index, (0, self.chunk - len(index)), "edge")
        found = self.program(*jax.tree.leaves(select_designs(self.designs, filled)))
        for column, part in zip(self.results, found, strict=True):
            column[index] = np.asarray(part)[: len(index)]
        together = np.asarray(found[-1]).reshape(self.shares, -1)
        return index, float(np.sum(together.max(axis=1)) * together.shape[1])


def _result_array(number: int, one: jax.ShapeDtypeStruct) -> np.ndarray:
    """Array for the results of all designs, nan if the type has it."""
    fill = math.nan if jax.dtypes.issubdtype(one.dtype, np.inexact) else 0
    return np.full((number, *one.shape), fill, one.dtype)
