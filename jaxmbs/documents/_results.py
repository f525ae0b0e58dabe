"""Sections of results: each says of itself what its numbers are, by `report()`."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..dynamics import validity
from ..errors import ModelError
from ..model._system import System
from ..quantities import Axis, Quantity
from ..reports import Report
from ._page import Passage
from ._plots import curves

_MOST = 200  # rows of a table


def result_sections(system: Any, results: Mapping[str, Any]) -> list[Passage]:
    """Sections of results by name; of a motion of a mechanism the margins of all models too."""
    found = [section for name, value in results.items() for section in _sections(_words(name), value)]
    motion: Any = results.get("motion")
    if isinstance(system, System) and hasattr(motion, "states"):
        margins = validity(system, motion)
        found.append(result_section("Validity", margins))
    return found


def _words(name):
    text = name.replace("_", " ")
    return text[:1].upper() + text[1:]


def _sections(name, value) -> Iterator[Passage]:
    if value is None:
        return
    if isinstance(value, str):
        yield Passage(name, value.splitlines())
    elif isinstance(value, Mapping) and not hasattr(value, "report") and not hasattr(value, "data_vars"):
        for key, one in value.items():
            yield from _sections(f"{name}: {key}", one)
    else:
        yield result_section(name, value)


def result_section(name: str, value: Any) -> Passage:
    """Passage of a result with a `report()`, or of a data set of xarray.  Raises: ModelError for anything else."""
    found = _report_of(name, value)
    summary, rows = found.parts(_MOST)
    solver = getattr(value, "solver", "")
    lines = [line for line in (summary.partition("; ")[2] if found.fault else summary, solver) if line]
    return Passage(name, lines, rows, found.fault, curves(found))


def _report_of(name, value) -> Report:
    if hasattr(value, "report"):
        return value.report()
    if hasattr(value, "data_vars"):
        return _of_dataset(value)
    raise ModelError(
        [f"{name} is a {type(value).__name__}: a report takes results of jaxmbs, data sets of xarray, texts"],
        "the report",
    )


def _of_dataset(data):
    """Report of a data set of xarray, as studies store it."""
    axes = {
        dim: Axis(str(dim), _labels(data, dim), str(data[dim].attrs.get("units", "")) if dim in data.coords else "")
        for dim in data.dims
    }
    quantities = [
        Quantity(
            str(name), np.asarray(array.values), str(array.attrs.get("units", "")), tuple(axes[d] for d in array.dims)
        )
        for name, array in data.data_vars.items()
        if np.asarray(array.values).dtype.kind in "biufcUSO"
    ]
    return Report(quantities, ", ".join(f"{size} {dim}s" for dim, size in data.sizes.items()))


def _labels(data, dim):
    labels = np.asarray(data[dim].values) if dim in data.coords else np.arange(data.sizes[dim])
    return labels if labels.dtype.kind in "iuf" else tuple(map(str, labels))
