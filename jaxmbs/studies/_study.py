"""`sweep`: a function over many designs, chunk by chunk into a store, on this machine or on dask workers."""

import functools
import os
from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np
from jaxtyping import Array

from ..batching._batch import Batch, evaluate_batch
from ..batching._program import batched_function
from ..batching._result import count_steps
from ..batching._table import design_shape, select_designs
from ..checks import as_flag
from ..errors import BatchError
from ..runtime import check_kind, fingerprint, garbage_collection_paused, step_bar, tuning
from ..typing import ArrayLike
from ._opened import layout_bytes
from ._plans import Designs, read_plan
from ._results import NOT_COMPUTED, answer_dimensions, build_dataset, unknown_value
from ._store import StudyError, StudyStore, chunk_spans, hash_columns

_IN_MEMORY = "without a folder only `study` of this error has what was computed (sys.last_value.study)"


def sweep(
    function: Callable[[dict], Any],
    designs: Any,
    path: str | os.PathLike | None = None,
    *,
    chunk: int = 1024,
    client: Any = None,
    progress: bool = True,
    dims: Mapping[str, tuple[str, ...]] | None = None,
    coords: Mapping[str, ArrayLike] | None = None,
    units: Mapping[str, str] | None = None,
    key: str = "",
    cost: Callable[[dict], float | Array] = count_steps,
    compile: str = "auto",
) -> Any:
    """Evaluate a function for many designs into an `xarray.Dataset`, written to disk as it runs.

    Args:
        function: of one design, a dict of numbers, to a dict of arrays; traced, as by `mbs.batch`.
        designs: `grid(...)`, `sobol(...)`, `latin_hypercube(...)`, a dict of columns, a list of dicts or a table.
        path: folder of the study.  Where it holds the same study, that goes on: a process that is killed
            loses at most the chunk being computed.  Default: a temporary folder, gone at the end.
        chunk: designs that are computed and written together.
        client: a `dask.distributed.Client`: chunks run on its workers, written here.
        progress: show a progress bar with rate and time left.
        dims: names of the dimensions of an answer behind those of the designs, `{"load": ("time", "component")}`.
        coords: values along such a dimension, `{"time": ts}`.
        units: of answers, variables and coordinates, by name.
        key: what distinguishes this study from others with the same designs and answers, such as a version.
        cost, compile: as of `mbs.batch`; `cost=lambda answers: answers["steps"]` puts designs of like cost side by
            side.

    Returns: a Dataset with one dimension for every axis of the grid, or "design"; beside the answers `status` (codes
    of `mbs.Status`) and `reason`.  Designs that fail keep their row.

    Raises: StudyError for a folder that holds something else, another study (of other designs, or of a function that
    computes something else), or is being written; for an interrupt, a full disk or a worker that raises, with what
    was written kept.  As `mbs.batch` for designs that are no numbers.
    """
    check_kind(compile)
    if chunk < 1:
        raise ValueError(f"chunk must be at least 1, got {chunk}")
    plan, coords, units = read_plan(designs), dict(coords or {}), dict(units or {})
    one = _answers(function, plan, cost, compile)
    behind = answer_dimensions(plan, one, dims or {}, coords, units)
    size = int(np.prod(plan.shape))
    spans = chunk_spans(size, min(chunk, size))
    found = {name: np.full((size, *a.shape), unknown_value(a.dtype), a.dtype) for name, a in one.items()}
    found["status"][:] = NOT_COMPUTED
    compute = functools.partial(evaluate_chunk, function, cost=cost, compile=compile, total=size)
    run = _run_locally(compute, plan, spans) if client is None else _run_on_dask(compute, plan, spans, client)
    try:
        if path is None:
            _compute_chunks(found, spans, None, run, size, progress)
        else:
            about: dict[str, Any] = {
                "designs": hash_columns(plan.designs),
                "answers": {n: [*a.shape, str(a.dtype)] for n, a in one.items()},
            }
            about |= {"function": fingerprint(_traced(function, plan)), "key": key}
            store = StudyStore(path, spans, one, about)
            layout = layout_bytes(plan, behind, coords, units)
            if _load_chunks(found, spans, store) or not store.has_layout:  # one that is done asks nothing of the disk
                with store.writing():
                    store.write_layout(layout)
                    _compute_chunks(found, spans, store, run, size, progress)
    except StudyError as error:
        if np.any(found["status"] != NOT_COMPUTED):
            error.study = build_dataset(plan, found, behind, coords, units)
        raise
    return build_dataset(plan, found, behind, coords, units)


def _load_chunks(found: dict, spans: list[slice], store: StudyStore) -> list[int]:
    """Load the finished chunks into `found`; returns the indices of the others."""
    left = []
    for number, span in enumerate(spans):
        arrays = store.read(number)
        if arrays is None:
            left.append(number)
        else:
            for name, values in arrays.items():
                found[name][span] = values
    return left


def _compute_chunks(
    found: dict, spans: list[slice], store: StudyStore | None, run: Callable, size: int, progress: bool
) -> None:
    """Compute the missing chunks and write each into the store, if there is one."""
    left = list(range(len(spans))) if store is None else _load_chunks(found, spans, store)
    done = size - sum(spans[k].stop - spans[k].start for k in left)
    where = "the study" if store is None else store.path
    is_quiet = not as_flag("progress", progress)
    try:
        with step_bar(size, "sweep", is_wanted=not is_quiet, initial=done, unit=" designs") as bar:
            for number, arrays in run(left):
                for name, values in arrays.items():
                    found[name][spans[number]] = values
                if store is not None:
                    store.write(number, arrays)
                done += len(arrays["status"])
                bar.update(len(arrays["status"]))
    except (KeyboardInterrupt, OSError, _ChunkError) as error:
        if isinstance(error, _ChunkInterrupt) and error.part is not None:
            for name, values in _named_answers(error.part).items():
                found[name][spans[error.number]] = values[: spans[error.number].stop - spans[error.number].start]
        said = "interrupted" if isinstance(error, KeyboardInterrupt) else getattr(error, "strerror", None) or error
        kept = f"{done} of {size} designs are kept, run the same study again to go on"
        raise StudyError(f"{where}: {said}; {kept if store else _IN_MEMORY}") from error


def evaluate_chunk(
    function: Callable,
    designs: dict,
    number: int,
    cost: Callable = count_steps,
    compile: str = "auto",
    total: int | None = None,
) -> dict[str, np.ndarray]:
    """The answers and `status` of designs, of which there are `number` in most chunks; few are filled up so that one
    program serves all chunks.

    Args: total: number of designs of the study.
    """
    count = len(next(iter(designs.values())))
    few = total is not None and total <= tuning.TAPE_DESIGNS and compile != "full"
    least = count if few else min(number, tuning.CHUNK * (os.cpu_count() or 1))
    filled = select_designs(designs, np.minimum(np.arange(max(count, least)), count - 1))
    found = evaluate_batch(function, filled, progress=False, cost=cost, compile=compile, total=total)
    return {name: values[:count] for name, values in _named_answers(found).items()}


def _named_answers(batch: Batch) -> dict[str, np.ndarray]:
    """Answers and `status` of a batch by name."""
    named = _flatten_names(batch.values) | {"status": batch.status}
    return {name: np.asarray(values) for name, values in named.items()}


def _answers(function, plan: Designs, cost, compile) -> dict:
    """Shape and type of every answer to one design."""
    kind = "tape" if compile != "full" and int(np.prod(plan.shape)) <= tuning.TAPE_DESIGNS else "full"
    shape, *_ = batched_function(function, plan.designs, cost, kind).shape
    found = _flatten_names(shape)
    if not found or "status" in found:
        raise TypeError("the function of a study returns a dict of arrays by name, other than 'status'")
    return found | {"status": jax.ShapeDtypeStruct((), np.int32)}


def _traced(function, plan: Designs) -> Any:
    """The equations of the function."""
    with garbage_collection_paused():
        return jax.make_jaxpr(function)(design_shape(plan.designs))


def _flatten_names(values) -> dict:
    paths = jax.tree_util.tree_flatten_with_path(values)[0]
    return {jax.tree_util.keystr(path, simple=True, separator=".") or "value": leaf for path, leaf in paths}


class _ChunkError(Exception):
    """A chunk whose designs raised an error."""


class _ChunkInterrupt(KeyboardInterrupt):
    """An interrupt of a chunk, and the part of it that was computed."""

    def __init__(self, number: int, part: Batch | None):
        super().__init__()
        self.number, self.part = number, part


def _run_locally(compute, plan: Designs, spans: list[slice]) -> Callable:
    def run(left):
        for number in left:
            span = spans[number]
            try:
                found = compute(select_designs(plan.designs, np.arange(span.start, span.stop)), spans[0].stop)
            except BatchError as error:
                if isinstance(error.__cause__, KeyboardInterrupt):
                    raise _ChunkInterrupt(number, error.batch) from None
                raise _ChunkError(f"designs {span.start} to {span.stop - 1} failed: {error}") from error
            yield number, found

    return run


def _run_on_dask(compute, plan: Designs, spans: list[slice], client) -> Callable:
    from distributed import as_completed

    def run(left):
        x64, tasks = bool(jax.config.jax_enable_x64), {}
        for number in left:
            designs = select_designs(plan.designs, np.arange(spans[number].start, spans[number].stop))
            tasks[client.submit(_on_worker, compute, designs, spans[0].stop, x64, pure=False)] = number
        try:
            for task in as_completed(tasks):
                try:
                    found = task.result()
                except Exception as error:
                    raise _ChunkError(f"chunk {tasks[task]} failed on its worker: {error!r}") from error
                yield tasks[task], found
        finally:
            client.cancel(list(tasks))

    return run


def _on_worker(compute, designs, chunk, x64):
    jax.config.update("jax_enable_x64", x64)
    return compute(designs, chunk)
