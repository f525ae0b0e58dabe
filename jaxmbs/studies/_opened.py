"""Studies on disk, opened without the function that made them; the best designs of them."""

import io
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ..checks import distinct_names, place_of
from ..errors import ModelError
from ..status import succeeded
from ._plans import Designs
from ._results import NOT_COMPUTED, build_dataset, unknown_value
from ._store import StudyError, StudyStore, chunk_spans


def layout_bytes(
    plan: Designs,
    behind: Mapping[str, tuple[str, ...]],
    coords: Mapping[str, Any],
    units: Mapping[str, str],
) -> bytes:
    """Designs, dimensions, coordinates and units of a study, as an npz without pickles."""
    words = {
        "designs": list(plan.designs),
        "axes": [name for name, _ in plan.axes],
        "behind": behind,
        "coords": list(coords),
        "units": units,
    }
    arrays = {f"design {k}": x for k, x in enumerate(plan.designs.values())}
    arrays |= {f"axis {k}": values for k, (_, values) in enumerate(plan.axes)}
    arrays |= {f"coordinate {k}": np.asarray(values) for k, values in enumerate(coords.values())}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, words=np.asarray(json.dumps(words)), **arrays)
    return file.getvalue()


def open_study(path: str | os.PathLike) -> Any:
    """The `xarray.Dataset` of a study in a folder, as `sweep` returns it, without its function.

    The folder is only read: also while another process writes it, or after it was stopped.  Designs that are not
    computed yet have NaN (zero for integers), the status -1 and the reason "not computed".

    Args: path: folder that `sweep` was given.

    Raises: StudyError for a folder that holds no study, one that is damaged, or one of an earlier release, which did
    not keep the designs: run its `sweep` again, which computes nothing anew.
    """
    path = Path(path)
    try:
        about = dict(json.loads((path / "study.json").read_text()))
        shapes = {name: (tuple(shape), np.dtype(kind)) for name, (*shape, kind) in about["answers"].items()}
        rows, chunk = int(about["rows"]), int(about["chunk"])
    except FileNotFoundError:
        raise StudyError(f"{path} holds no study: there is no study.json in it") from None
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise StudyError(f"{path / 'study.json'} says no longer which study this is ({error!r})") from error
    plan, behind, coords, units = _read_layout(path / "layout.npz")
    own = {name: value for name, value in about.items() if name not in ("format", "rows", "chunk", "jax")}
    spans = chunk_spans(rows, chunk)
    one = {name: jax.ShapeDtypeStruct(*shape) for name, shape in shapes.items()}
    store = StudyStore(path, spans, one, own)
    found = {name: np.full((rows, *shape), unknown_value(kind), kind) for name, (shape, kind) in shapes.items()}
    found["status"][:] = NOT_COMPUTED
    for number, span in enumerate(spans):
        for name, values in (store.read(number) or {}).items():
            found[name][span] = values
    return build_dataset(plan, found, behind, coords, units)


def _read_layout(file):
    try:
        with np.load(file, allow_pickle=False) as stored:
            words = json.loads(str(stored["words"]))
            take = lambda what, names: {name: stored[f"{what} {k}"] for k, name in enumerate(names)}
            plan = Designs(take("design", words["designs"]), tuple(take("axis", words["axes"]).items()))
            behind = {name: tuple(dims) for name, dims in words["behind"].items()}
            return plan, behind, take("coordinate", words["coords"]), words["units"]
    except FileNotFoundError:
        raise StudyError(
            f"{file} is missing: the study was written by an earlier release; run its sweep again, which computes "
            "nothing anew"
        ) from None
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise StudyError(f"{file} is damaged ({error!r}): run the sweep of the study again") from error


def pareto_front(found: Any, objectives: Sequence[str], maximise: Sequence[str] = ()) -> Any:
    """The designs of a study that no other one beats in all objectives, by the first of them.

    Args:
        found: Dataset of `sweep` or `studies.open`.
        objectives: names of answers or variables, one number for each design; the smaller the better.
        maximise: those of them that are to be large.

    Returns: Dataset of these designs along "design", which `viz.plot_pareto_front` takes; designs that failed are
    none of them.

    Raises: UnknownNameError for names that are not there, ValueError for answers of more than a number.
    """
    if not {"data_vars", "coords", "isel"} <= set(dir(found)) or "status" not in found:
        raise ModelError(["found must be the Dataset of a study, with its status"], "the question")
    objectives = distinct_names("objectives", objectives)
    for name in objectives:
        place_of("answer or variable", name, {**found.data_vars, **found.coords})
    for name in distinct_names("maximise", maximise):
        place_of("objective", name, objectives)
    dims = found["status"].dims
    flat = found if dims == ("design",) else found.stack(design=dims)
    several = [name for name in objectives if flat[name].dims != ("design",)]
    if several:
        raise ValueError(f"{', '.join(several)}: one number for each design is needed, as by .max(...) of an answer")
    signs = np.where([name in maximise for name in objectives], -1.0, 1.0)
    values = np.stack([np.asarray(flat[name], float) for name in objectives], axis=1) * signs
    ok = np.asarray(succeeded(np.asarray(flat["status"]))) & np.all(np.isfinite(values), axis=1)
    front = flat.isel(design=_not_dominated(values, np.flatnonzero(ok)))
    return front.assign_attrs(objectives=tuple(objectives))


def _not_dominated(values, rows):
    """The rows that no other beats, in the order of the first objective; of equal ones the first."""
    rows = rows[np.lexsort(values[rows].T[::-1])]
    front = []
    while rows.size:  # the first one left is beaten by none: no later row is smaller in the first objective
        best, rows = rows[0], rows[1:]
        front.append(best)
        rows = rows[np.any(values[rows] < values[best], axis=1)]
    return np.asarray(front, int)
