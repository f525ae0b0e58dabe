"""`sweep`: a function over many designs, chunk by chunk into a store, on this machine or on the workers of dask."""

import contextlib
import functools
import os
import tempfile
from collections.abc import Callable, Mapping
from typing import Any

import jax
import numpy as np
from tqdm import tqdm

from ..design.batches import CHUNK, batch
from ..design.outcome import lane_cost
from ..design.table import row_shape, rows
from ..errors import BatchError
from ..typing import ArrayLike
from .plans import Designs, plan_of
from .results import dataset, dimensions
from .store import Store, StudyError, digest


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
    cost: Callable[[dict], float] = lane_cost,
    compile: str = "full",
) -> Any:
    """The answers of a function for many designs as an `xarray.Dataset`, written to disk as they come.

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

    Raises: StudyError for a folder that holds something else, another study (also one whose first design has other
    answers now), or is being written; for a full disk or a worker that raises, with what was written kept.  As
    `mbs.batch` for designs that are no numbers.
    """
    plan, coords, units = plan_of(designs), dict(coords or {}), dict(units or {})
    one = _answers(function, plan)
    behind = dimensions(plan, one, dims or {}, coords, units)
    about = {"designs": digest(plan.designs), "answers": {n: [*a.shape, str(a.dtype)] for n, a in one.items()}}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory()) if path is None else path
        chunk = min(chunk, len(next(iter(plan.designs.values()))))
        size = int(np.prod(plan.shape))
        store = stack.enter_context(Store(folder, size, chunk, one, {**about, "key": key}))
        compute = functools.partial(computed, function, cost=cost, compile=compile)
        _check_same(store, compute, plan, chunk)
        run = _here(compute, plan, store) if client is None else _there(compute, plan, store, client)
        left = store.left
        done = size - sum(store.span(k).stop - store.span(k).start for k in left)
        with tqdm(total=size, initial=done, desc="sweep", unit=" designs", disable=not progress) as bar:
            for number, arrays in run(left):
                store.write(number, arrays)
                bar.update(store.span(number).stop - store.span(number).start)
        return dataset(plan, {name: store.read(name) for name in one}, behind, coords, units)


def computed(
    function: Callable, designs: dict, number: int, cost: Callable = lane_cost, compile: str = "full"
) -> dict[str, np.ndarray]:
    """The answers and `status` of designs, of which there are `number` in most chunks; few are filled up so that one
    program serves all chunks."""
    count = len(next(iter(designs.values())))
    least = min(number, CHUNK * (os.cpu_count() or 1))
    filled = rows(designs, np.minimum(np.arange(max(count, least)), count - 1))
    found = batch(function, filled, progress=False, cost=cost, compile=compile)
    named = _named(found.values) | {"status": np.asarray(found.status)}
    return {name: np.asarray(values)[:count] for name, values in named.items()}


def _answers(function, plan: Designs) -> dict:
    """Shape and type of every answer to one design."""
    shape = jax.eval_shape(function, row_shape(plan.designs))
    found = _named(shape)
    if not found or "status" in found:
        raise TypeError("the function of a study returns a dict of arrays by name, other than 'status'")
    return found | {"status": jax.ShapeDtypeStruct((), np.int32)}


def _named(values) -> dict:
    paths = jax.tree_util.tree_flatten_with_path(values)[0]
    return {jax.tree_util.keystr(path, simple=True, separator=".") or "value": leaf for path, leaf in paths}


def _check_same(store: Store, compute, plan: Designs, chunk: int) -> None:
    """The first design of a study that goes on must have the answers that stand in the store."""
    if 0 in store.left:
        return
    again = compute(rows(plan.designs, np.arange(1)), chunk)
    for name, values in again.items():
        before = store.group[name][:1]
        if not np.allclose(before, values, rtol=1e-6, atol=1e-9, equal_nan=True):
            raise StudyError(
                f"{store.path} holds answers of another function: {name!r} of the first design was "
                f"{np.ravel(before)[:3]}, it is {np.ravel(values)[:3]} now; choose another folder or delete this one"
            )


def _here(compute, plan: Designs, store: Store) -> Callable:
    def run(left):
        for number in left:
            span = store.span(number)
            try:
                found = compute(rows(plan.designs, np.arange(span.start, span.stop)), store.chunk)
            except BatchError as error:
                raise StudyError(f"{store.path}: designs {span.start} to {span.stop - 1} failed: {error}") from error
            yield number, found

    return run


def _there(compute, plan: Designs, store: Store, client) -> Callable:
    from distributed import as_completed

    def run(left):
        x64, tasks = bool(jax.config.jax_enable_x64), {}
        for number in left:
            span = store.span(number)
            designs = rows(plan.designs, np.arange(span.start, span.stop))
            tasks[client.submit(_on_worker, compute, designs, store.chunk, x64, pure=False)] = number
        try:
            for task in as_completed(tasks):
                try:
                    yield tasks[task], task.result()
                except Exception as error:
                    raise StudyError(f"{store.path}: chunk {tasks[task]} failed on its worker: {error!r}") from error
        finally:
            client.cancel(list(tasks))

    return run


def _on_worker(compute, designs, chunk, x64):
    jax.config.update("jax_enable_x64", x64)
    return compute(designs, chunk)
