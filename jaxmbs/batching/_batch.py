"""`batch`: one function over many designs, compiled once, chunk by chunk on all cores or devices."""

import math
import os
import time
from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PyTree
from tqdm import tqdm

from ..checks import as_flag
from ..errors import BatchError
from ..quantities import Axis, Quantity, entries
from ..reports import Report, Reported, failures
from ..runtime import check_kind, may_run_on_tapes, step_bar, tuning
from ..status import Status, succeeded
from ._executor import ChunkExecutor
from ._program import BatchedFunction, batched_function, round_to_devices
from ._result import compare_branches, count_steps
from ._table import is_traced, num_designs, read_designs
from ._tapes import designs_on_tape

#: How designs that are not on tapes are compiled.
_COMPILED = {"auto": "full", "tape": "quick"}


class Batch(Reported, eqx.Module):
    """Return values of a function for B designs, and the status of each.

    Attributes:
        values: like one result of the function, with a leading axis B; arrays of the host (NumPy), or traced ones.
        status: codes (B,) of `Status`; BRANCH for designs whose states are on another branch than those of the first
            successful design.
        cost: of each design (B,): by default the integrator's steps.
        computed: steps computed for all designs (), including idle steps of designs that wait for others in their
            chunk.
        seconds: wall time of the run () [s] after compilation; nan when traced, like `computed`.
    """

    values: PyTree
    status: Int[Array, "..."] | Int[np.ndarray, "..."]
    cost: Float[Array, "..."] | Float[np.ndarray, "..."]
    computed: float | Float[Array, "..."] = math.nan
    seconds: float | Float[Array, "..."] = math.nan

    def report(self) -> Report:
        """The results by design, their statuses and costs; designs by status in words."""
        design = Axis("design", np.arange(len(self.status)))
        values = [
            entries(jax.tree_util.keystr(path, simple=True, separator=" ") or "value", leaf, "", (design,))
            for path, leaf in jax.tree_util.tree_leaves_with_path(self.values)
        ]
        found = {"status": self.status, "cost": self.cost, "ok": self.ok}
        summary, *statuses = self.summary().splitlines()
        summary += "".join(f"; {' '.join(line.split())}" for line in statuses if len(statuses) > 1)
        return Report(
            [*values, *(Quantity(*pair, "", (design,)) for pair in found.items())],
            summary,
            failures(self.ok, "designs failed"),
        )

    @property
    def ok(self) -> Array | np.ndarray:
        """True (B,) for the designs that succeeded."""
        return succeeded(self.status)

    def summary(self) -> str:
        """Number of designs by status, designs per second, and steps computed per step needed (concrete batches)."""
        status = np.asarray(self.status)
        codes, counts = np.unique(status, return_counts=True)
        ran, needed = np.count_nonzero(status > Status.NOT_RUN), np.sum(self.cost, where=self.ok)
        rate = f", {ran / self.seconds:.3g} designs/s" if self.seconds > 0 else ""
        rate += f", steps computed / needed {self.computed / needed:.2f}" if needed and self.computed > 0 else ""
        lines = [f"{count:8d}  {Status(int(code))}" for code, count in zip(codes, counts, strict=True)]
        return "\n".join([f"{status.size} designs, {np.count_nonzero(self.ok)} ok{rate}", *lines])


def batch(
    function: Callable[[PyTree], PyTree],
    designs: PyTree,
    *,
    chunk: int | None = None,
    progress: bool = True,
    devices: Sequence[jax.Device] | None = None,
    feasible: Callable[[PyTree], bool] | None = None,
    cost: Callable[[PyTree], float | Array] = count_steps,
    compile: str = "auto",
) -> Batch:
    """Evaluate a function for many designs, some of which may fail.

    The function is compiled once for chunks of one size and kept: keep the same function object to use it again
    (`gradient = jax.value_and_grad(f)` outside of the loop that calls `batch(gradient, ...)`).  Chunks run on all
    cores. Return only what is needed, peaks rather than whole motions: all results stay in memory.

    Args:
        function: function of one design that returns a pytree of arrays; it is traced.
        designs: a dict of columns or any pytree whose leaves share a leading axis B; a list of B dicts; or a table
            such as a pandas DataFrame.  If they are traced, or the function closes over traced numbers, so is the
            batch: it can be differentiated and compiled as a part of a larger program.
        chunk: designs side by side; by default 32 (on accelerators 32768), less for few designs, or where one chunk
            would take more than 256 MB of working memory (a quarter of an accelerator's).
        progress: show a progress bar (not when traced).
        devices: spread every chunk over these devices of this host, e.g. `jax.devices()`.
        feasible: cheap function of one design that returns True if it is worth running, e.g. `lambda d:
            mbs.State.at(build(d), A=0.3).ok`; other designs are not computed (in a trace they are), their results are
            nan.
        cost: function of one result that returns the work it took; by default the steps of all motions in it.  A
            chunk takes as long as its slowest design, so designs of similar cost are put in one chunk.  If no motion
            is
            returned, return its steps: `cost=lambda values: values["steps"]`.
        compile: "auto": up to a hundred designs run at once without a compiler, one on each core, unless that takes
            longer than compiling; the others are compiled.  "tape": all without a compiler, however long they take.
            "quick": as "auto", and more of them compiled in half the time, run two to four times as long.  "full":
            compiled, the same to the last bit whatever the number of designs.  Designs in a `chunk` of yours or on
            `devices` are compiled.

    Raises:
        TypeError, ValueError: naming the column, for designs that are not numbers or differ in length; no designs.
        BatchError: a chunk raised an error or was interrupted; carries the designs done so far as `.batch`.
    """
    check_kind(compile)
    return evaluate_batch(
        function, read_designs(designs), chunk, progress, tuple(devices or ()), feasible, cost, compile
    )


def evaluate_batch(
    function: Callable[[PyTree], PyTree],
    designs: PyTree,
    chunk: int | None = None,
    progress: bool = True,
    devices: tuple[jax.Device, ...] = (),
    feasible: Callable[[PyTree], bool] | None = None,
    cost: Callable[[PyTree], float | Array] = count_steps,
    compile: str = "auto",
    total: int | None = None,
) -> Batch:
    """As `batch`; the same program for all parts of `total` designs that are asked for one after another."""
    many = num_designs(designs) if total is None else total
    if chunk is not None and chunk < 1:
        raise ValueError(f"chunk must be at least 1, got {chunk}")
    batched = batched_function(function, designs, cost, _COMPILED.get(compile, compile))
    if batched.is_traced or is_traced(designs):
        return _traced_batch(batched, designs, chunk or _largest_chunk(), feasible)
    good = np.full(num_designs(designs), True)
    is_quiet = not as_flag("progress", progress)
    with step_bar(len(good), "batch: compiling", is_wanted=not is_quiet, unit=" designs") as bar:
        on_tape = None
        if may_run_on_tapes(compile) and chunk is None and not devices:
            small = batched_function(function, designs, cost, "tape")
            on_tape = designs_on_tape(small, designs, many, compile == "tape")
        if on_tape is None:
            executor = _compiled_executor(batched, designs, many, chunk, devices, cost)
        else:
            executor = ChunkExecutor(on_tape, 1, 1, _num_threads(), designs, small)
        if feasible is not None:
            good = np.asarray(batch(feasible, designs, progress=False, devices=devices, compile=compile).values, bool)
        bar.set_description("batch")
        bar.reset()
        found = _run_chunks(executor, good, bar)
    if on_tape is not None and total is None and compile == "auto":
        on_tape.compile_beside(lambda: _compiled_executor(batched, designs, many, chunk, devices, cost))
    return found


def _compiled_executor(batched, designs, many, chunk, devices, cost) -> ChunkExecutor:
    threads, turns, number = 1 if devices else _num_threads(), 1, num_designs(designs)
    if chunk is None:
        chunk = round_to_devices(_chunk_size(number, threads), devices)
        scheduled = bool(devices) or cost is not count_steps  # chunk by chunk
        turns = 1 if scheduled else batched.chunks_in_turn(number, threads, chunk)
        program, chunk = batched.program_within_memory(chunk, devices, turns)
    else:
        chunk = round_to_devices(chunk, devices)
        program = batched.program(chunk, devices)
    return ChunkExecutor(program, chunk * turns, max(len(devices), turns), threads, designs, batched)


def _run_chunks(executor: ChunkExecutor, good: np.ndarray, bar: tqdm) -> Batch:
    begin = time.perf_counter()
    error = executor.run(good, bar)
    values, status, cost = executor.unflatten(executor.results)
    status = np.asarray(compare_branches(values, status))
    found = Batch(values, status, cost, executor.computed, time.perf_counter() - begin)
    if error is not None:
        raise BatchError(f"the batch stopped early: {error!r}\n{found.summary()}", found) from error
    return found


def _traced_batch(
    batched: BatchedFunction, designs: PyTree, chunk: int, feasible: Callable[[PyTree], bool] | None
) -> Batch:
    """A batch inside of a trace; results of infeasible designs become nan by a product, as do their derivatives."""
    values, status, cost = batched.map_chunks(designs, chunk)
    status = compare_branches(values, status)
    if feasible is not None:
        good = jnp.asarray(batch(feasible, designs, progress=False).values, bool)
        factor = jnp.where(good, 1.0, jnp.nan)
        mark = lambda x: x * factor.reshape(-1, *[1] * (x.ndim - 1)).astype(x.dtype)
        values = jax.tree.map(lambda x: mark(x) if jnp.issubdtype(x.dtype, jnp.inexact) else x, values)
        status = jnp.where(good, status, Status.INFEASIBLE)
    return Batch(values, status, cost)


def _num_threads() -> int:
    """Number of threads that call the program: one per core; two elsewhere, so that no device waits for the host."""
    return (os.cpu_count() or 1) if jax.default_backend() == "cpu" else 2


def _chunk_size(number: int, threads: int) -> int:
    """Largest chunk that gives work to each thread: a power of two up to what the backend takes at once."""
    return min(_largest_chunk(), 2 ** math.ceil(math.log2(math.ceil(number / threads))))


def _largest_chunk() -> int:
    return tuning.CHUNK if jax.default_backend() == "cpu" else tuning.DEVICE_CHUNK
