"""The answers of a study as an `xarray.Dataset`."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..status import Status
from .plans import Designs


def dataset(
    plan: Designs,
    answers: Mapping[str, np.ndarray],
    dims: Mapping[str, tuple[str, ...]],
    coords: Mapping[str, Any],
    units: Mapping[str, str],
) -> Any:
    """Answers (B, ...) on the dimensions of a plan; see `sweep`.

    Raises: ValueError for dims of an answer that has others.
    """
    import xarray

    named = tuple(name for name, _ in plan.axes)
    data = {}
    for name, values in answers.items():
        behind = tuple(dims.get(name, (f"{name}_{k}" for k in range(values.ndim - 1))))
        if len(behind) != values.ndim - 1:
            raise ValueError(f"dims of {name!r}: {behind}, but an answer has the shape {values.shape[1:]}")
        data[name] = (named + behind, values.reshape(*plan.shape, *values.shape[1:]), _unit(units, name))
    status = data["status"][1]
    words = {code: str(Status(int(code))) for code in np.unique(status)}
    data["reason"] = (named, np.vectorize(words.get, otypes=[object])(status), {})
    if named == ("design",):
        data |= {
            name: (("design", *(f"{name}_{k}" for k in range(x.ndim - 1))), x, _unit(units, name))
            for name, x in plan.designs.items()
        }
    places = {name: (name, np.asarray(values), _unit(units, name)) for name, values in (*plan.axes, *coords.items())}
    return xarray.Dataset(data, places)


def _unit(units, name):
    return {"units": units[name]} if name in units else {}
