"""`batch`: one function over many designs, compiled once, chunk by chunk on all cores or devices."""

import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float, Int, PyTree
from tqdm import tqdm

from jaxmbs.design.lanes import lanes_of, whole
from jaxmbs.design.status import NOT_RUN, status_text, succeeded
from jaxmbs.design.table import is_traced, length, read_designs, rows
from jaxmbs.errors import BatchError

#: Designs side by side: on the CPU as cheap each as 64, cheaper than 16 or 128 (benchmarks/batch_of_motions.py).
CHUNK = 32


class Batch(eqx.Module):
    """What a function returned for each of B designs, and how each of them ended.

    Attributes:
        values: like one result of the function, with a leading axis B; arrays of the host (NumPy), or traced ones.
        status: codes (B,): result codes of a `Motion`, -1 for designs that were not run.
        seconds: wall time of the run () [s] after compilation; nan when traced.
    """

    values: PyTree
    status: Int[Array, "..."] | Int[np.ndarray, "..."]
    seconds: float | Float[Array, "..."] = math.nan

    @property
    def ok(self):
        """Which designs (B,) were computed as asked."""
        return succeeded(self.status)

    def summary(self) -> str:
        """How many designs ended in which way, and how many ran each second (concrete batches)."""
        status = np.asarray(self.status)
        codes, counts = np.unique(status, return_counts=True)
        ran = np.count_nonzero(status != NOT_RUN)
        rate = f", {ran / self.seconds:.3g} designs/s" if self.seconds > 0 else ""
        lines = [f"{count:8d}  {status_text(int(code))}" for code, count in zip(codes, counts, strict=True)]
        return "\n".join([f"{status.size} designs, {np.count_nonzero(self.ok)} ok{rate}", *lines])

    def __repr__(self) -> str:
        return f"<Batch: {'traced' if is_traced(self) else self.summary().splitlines()[0]}>"


def batch(
    function: Callable[[PyTree], PyTree],
    designs: PyTree,
    *,
    chunk: int | None = None,
    progress: bool = True,
    devices: Sequence[jax.Device] | None = None,
) -> Batch:
    """Evaluate a function for many designs, of which some may fail.

    The function is compiled once for chunks of one size and kept: keep the same function object to use it again
    (`slopes = jax.value_and_grad(f)` outside of the loop that calls `batch(slopes, ...)`).  Chunks run on all cores.
    Return what you ask for, peaks rather than whole motions: all results stay in memory.

    Args:
        function: takes one design to a pytree of arrays; it is traced.
        designs: a dict of columns or any pytree whose leaves share a leading axis B; a list of B dicts; or a table
            such as a pandas DataFrame.  If they are traced, or the function holds traced numbers, so is the batch:
            it can be differentiated and compiled as a part of something larger.
        chunk: designs side by side; by default 32, less for few designs, or where one chunk would take more than
            256 MB of working memory.
        progress: show a progress bar (not when traced).
        devices: spread every chunk over these devices of this host, e.g. `jax.devices()`.

    Raises:
        TypeError, ValueError: naming the column, for designs that are no numbers or differ in length; no designs.
        BatchError: a chunk raised an error or was interrupted; carries the designs done so far as `.batch`.
    """
    if chunk is not None and chunk < 1:
        raise ValueError(f"chunk must be at least 1, got {chunk}")
    designs, devices = read_designs(designs), tuple(devices or ())
    with tqdm(total=length(designs), desc="batch: compiling", unit=" designs", disable=not progress) as bar:
        lanes = lanes_of(function, designs)
        if lanes.is_traced or is_traced(designs):
            bar.disable = True
            return Batch(*lanes.in_turn(designs, chunk or CHUNK))
        threads = 1 if devices else _threads()
        if chunk is None:
            program, chunk = lanes.fitting(whole(_share(length(designs), threads), devices), devices)
        else:
            chunk = whole(chunk, devices)
            program = lanes.program(chunk, devices)
        bar.set_description("batch")
        bar.reset()
        return _run(program, chunk, designs, lanes, threads, bar)


def _threads() -> int:
    """Threads that call the program: one per core; two elsewhere, so that a device never waits for the host."""
    return (os.cpu_count() or 1) if jax.default_backend() == "cpu" else 2


def _share(number: int, threads: int) -> int:
    """Power of two that gives each thread its share, up to `CHUNK`."""
    return min(CHUNK, 2 ** math.ceil(math.log2(math.ceil(number / threads))))


def _run(program, chunk, designs, lanes, threads, bar) -> Batch:
    """All chunks on the threads; results land in their places, whichever chunk ends first."""
    number, begin = length(designs), time.perf_counter()
    results = [_empty(number, x) for x in jax.tree.leaves(lanes.shape)]
    results[-1][:] = NOT_RUN

    def run(start):
        index = np.arange(start, min(start + chunk, number))
        padded = np.minimum(np.arange(start, start + chunk), number - 1)
        for whole_, part in zip(results, program(*jax.tree.leaves(rows(designs, padded))), strict=True):
            whole_[index] = np.asarray(part)[: len(index)]
        return len(index)

    error = _in_threads(run, range(0, number, chunk), threads, bar)
    found = Batch(*lanes.named(results), time.perf_counter() - begin)
    if error is not None:
        raise BatchError(f"the batch stopped early: {error!r}\n{found.summary()}", found) from error
    return found


def _in_threads(run, starts, threads, bar):
    """Call `run` for every start; the first error or interrupt, after the calls under way have ended, else None."""
    with ThreadPoolExecutor(threads) as pool:
        calls = [pool.submit(run, start) for start in starts]
        try:
            for call in as_completed(calls):
                bar.update(call.result())
        except (Exception, KeyboardInterrupt) as error:
            pool.shutdown(wait=True, cancel_futures=True)
            return error
    return None


def _empty(number: int, one) -> np.ndarray:
    """Array for the results of all designs, nan where it can be."""
    fill = np.nan if jax.dtypes.issubdtype(one.dtype, np.inexact) else 0
    return np.full((number, *one.shape), fill, one.dtype)
