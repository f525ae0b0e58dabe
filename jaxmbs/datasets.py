"""Datasets: a report as `xarray.Dataset` and as `pandas.DataFrame`, which are imported when asked for."""

from typing import Any

import numpy as np

from .quantities import Axis, columns


def as_xarray(report: Any) -> Any:
    """An `xarray.Dataset`: a variable for each quantity with its unit, a coordinate for each axis.

    An axis that stands for other labels in another quantity is called "... of" that quantity.
    """
    import xarray

    places: dict[str, Axis] = {}
    data: dict = {}
    taken = {quantity.name for quantity, _ in report.named()}
    for quantity, axes in report.named():
        names = []
        for axis in axes:
            name = axis.name
            if name in places and not _same(places[name], axis) or name in taken:
                name = f"{name} of {quantity.name}"
            places[name] = axis
            names.append(name)
        data[quantity.name] = (names, np.asarray(quantity.values), _units(quantity.unit))
    coordinates = {name: (name, np.asarray(axis.labels), _units(axis.unit)) for name, axis in places.items()}
    said = {"summary": report.summary, "fault": report.fault}
    return xarray.Dataset(data, coordinates, {name: text for name, text in said.items() if text})


def as_pandas(report: Any) -> Any:
    """A `pandas.DataFrame` over the swept axes of the first quantity with any; without such a row for each number."""
    import pandas

    listed = list(report.named())
    swept = next((found for _, axes in listed if (found := _swept(axes))), [])
    kept = [
        (name, values, quantity.unit)
        for quantity, axes in listed
        if _all_same(_swept(axes), swept)
        for name, values in columns(quantity, axes)
    ]
    units = {name: unit for name, _, unit in kept}
    if not swept:
        rows = {name: (values[0], units[name]) for name, values, _ in kept}
        return pandas.DataFrame.from_dict(rows, orient="index", columns=["value", "unit"])
    labels = [np.asarray(axis.labels) for axis in swept]
    index: Any = pandas.Index(labels[0], name=swept[0].name)
    if len(swept) > 1:
        index = pandas.MultiIndex.from_product(labels, names=[axis.name for axis in swept])
    frame = pandas.DataFrame({name: values for name, values, _ in kept}, index)
    frame.attrs["units"] = units
    return frame


def _units(unit):
    return {"units": unit} if unit else {}


def _swept(axes):
    return [axis for axis in axes if axis.is_swept]


def _all_same(first, second):
    return len(first) == len(second) and all(_same(a, b) for a, b in zip(first, second, strict=True))


def _same(a, b):
    return a.name == b.name and np.array_equal(a.labels, b.labels)
