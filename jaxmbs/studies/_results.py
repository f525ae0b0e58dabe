"""The answers of a study as an `xarray.Dataset`."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..checks import distinct_names, place_of
from ..status import Status
from ._plans import Designs

NOT_COMPUTED = -1  # status of designs that a study on disk has not got yet


def answer_dimensions(
    plan: Designs,
    answers: Mapping[str, Any],
    dims: Mapping[str, tuple[str, ...]],
    coords: Mapping[str, Any],
    units: Mapping[str, str],
) -> dict[str, tuple[str, ...]]:
    """Names of the dimensions of every answer behind those of the designs; `answers` are shapes for one design.

    Raises: ValueError for an answer with the name of a variable, or dims and coords that do not fit the shapes;
    UnknownNameError for dims, coords or units of what there is not.
    """
    own = {"reason", *plan.designs, *(name for name, _ in plan.axes)}
    taken = [name for name in plan.designs if name in ("status", "reason")]
    if taken:
        raise ValueError(f"a variable is called {taken[0]!r}, as a column of the result is: give it another name")
    for name in answers:
        if name in own:
            raise ValueError(f"the answer {name!r} has the name of a variable or of the study: give it another name")
    for name in dims:
        place_of("answer", name, answers)
    taken = {name for name, _ in plan.axes}
    found = {name: _own_dimensions(name, dims, shape.ndim, taken) for name, shape in answers.items()}
    lengths = {dim: n for name, shape in answers.items() for dim, n in zip(found[name], shape.shape, strict=True)}
    for name, values in coords.items():
        place_of("dimension", name, lengths)
        if np.shape(values) != (lengths[name],):
            raise ValueError(f"coords of {name!r} have the shape {np.shape(values)}, the answers ({lengths[name]},)")
    for name in units:
        place_of("answer, variable or coordinate", name, [*answers, *plan.designs, *coords])
    return found


def _own_dimensions(name, dims, count, taken):
    behind = distinct_names(f"dims of {name!r}", dims.get(name, [f"{name}_{k}" for k in range(count)]))
    if len(behind) != count:
        raise ValueError(f"dims of {name!r}: {behind}, but each answer has {count} dimensions")
    if len({*behind, *taken}) < len(behind) + len(taken):
        raise ValueError(f"dims of {name!r}: {behind}, names that differ from each other and from {sorted(taken)}")
    return behind


def build_dataset(
    plan: Designs,
    answers: Mapping[str, np.ndarray],
    behind: Mapping[str, tuple[str, ...]],
    coords: Mapping[str, Any],
    units: Mapping[str, str],
) -> Any:
    """Answers (B, ...) on the dimensions of a plan and those `behind` them; see `sweep`."""
    import xarray

    named = tuple(name for name, _ in plan.axes)
    data = {
        name: (named + behind[name], values.reshape(*plan.shape, *values.shape[1:]), _unit_attribute(units, name))
        for name, values in answers.items()
    }
    status = data["status"][1]
    words = {code: "not computed" if code == NOT_COMPUTED else str(Status(int(code))) for code in np.unique(status)}
    data["reason"] = (named, np.vectorize(words.get, otypes=[object])(status), {})
    if named == ("design",):
        data |= {
            name: (("design", *(f"{name}_{k}" for k in range(x.ndim - 1))), x, _unit_attribute(units, name))
            for name, x in plan.designs.items()
            if name != "design"  # it is the coordinate
        }
    places = {
        name: (name, np.asarray(values), _unit_attribute(units, name))
        for name, values in (*plan.axes, *coords.items())
    }
    return xarray.Dataset(data, places)


def _unit_attribute(units, name):
    return {"units": units[name]} if name in units else {}


def unknown_value(kind):
    """Value of an answer that was not computed."""
    return np.nan if np.issubdtype(kind, np.inexact) else 0
