"""Curves over one axis: histories over time, levels over frequency; spectra of them."""

from collections.abc import Iterable
from os import PathLike, fspath

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from ...atomic_write import atomic_file
from ...checks import distinct_names, list_faults, no_such
from ...errors import ModelError, ModelFileError, UnknownNameError
from ...fatigue._arrays import float_array
from ...fatigue._psd import STANDARD_GRAVITY, UNITS, PsdTable, psd_table
from ...quantities import Axis, Quantity
from ...reports import Report, Reported
from ...typing import ArrayLike
from ._csv_curves import csv_curves, csv_text
from ._table import AXES, CurveTable, normalise_unit, table_faults
from ._uff_curves import uff_curves, uff_text

_UNIVERSAL = (".uff", ".unv", ".u58")
_UNITS = {normalise_unit(unit): unit for unit in UNITS}
#: Unit in which spectra are written, by quantity.
_WRITTEN = {"acceleration": "(m/s^2)^2/Hz", "force": "N^2/Hz", "any": ""}


class Curves(Reported, eqx.Module):
    """Curves over a common axis, as they stand in a file.

    Attributes:
        axis: (points,) times [s] or frequencies [Hz].
        values: (points, curves) in the units of the file.
        quantity: "time" or "frequency" (static).
        names, units: of the curves (static); "" where the file has no unit.

    Raises: ModelError for shapes that do not fit.
    """

    axis: Float[Array, " points"]
    values: Float[Array, "points curves"]
    quantity: str = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)

    def __init__(
        self, axis: ArrayLike, values: ArrayLike, quantity: str, names: Iterable[str], units: Iterable[str]
    ) -> None:
        self.axis, self.values = float_array(axis), float_array(values)
        self.quantity, self.names = quantity, distinct_names("names", names)
        if isinstance(units, str):
            raise ModelError(list_faults("units", units), "the curves")
        self.units = tuple(units)
        count = (len(self.axis), len(self.names))
        if self.values.shape != count or len(self.units) != count[1] or quantity not in AXES:
            shape = (*self.values.shape, len(self.units))
            raise ModelError(
                [f"values and units of shape {shape} do not fit points and names {count} over time or frequency"],
                "the curves",
            )

    def report(self) -> Report:
        axis = (Axis(self.quantity, np.asarray(self.axis), "s" if self.quantity == "time" else "Hz"),)
        values = np.asarray(self.values).T
        found = [Quantity(name, x, unit, axis) for name, unit, x in zip(self.names, self.units, values, strict=True)]
        return Report(found, f"{len(self.names)} curves of {len(self.axis)} points")

    def __getitem__(self, name: str) -> Array:
        """Values (points,) of a curve.  Raises: UnknownNameError."""
        if name not in self.names:
            raise UnknownNameError(no_such("curve", name, self.names))
        return self.values[:, self.names.index(name)]

    @property
    def step(self) -> float:
        """Distance of the points [s or Hz].  Raises: ValueError where they are not even."""
        steps = np.diff(np.asarray(self.axis))
        mean = float(np.mean(steps))
        if np.max(np.abs(steps - mean)) > 1e-3 * mean:
            raise ValueError(f"the points are not even: they are from {steps.min():.6g} to {steps.max():.6g} apart")
        return mean


def read_curves(path: str | PathLike) -> Curves:
    """Curves of a CSV file, or of a universal file (`.uff`, `.unv`) of real functions in data sets 58.

    A CSV file has a first line of names and units, `time [s], bolt x [N], bolt y [N]` or `frequency [Hz], level
    [g^2/Hz]`, and numbers below it, apart by commas, semicolons or tabs; lines that begin with `#` are skipped.
    Times in ms and frequencies in kHz are converted, values stand as they are.

    Raises: ModelFileError with every fault and its line.
    """
    faults: list[str] = []
    reader = uff_curves if _is_universal(path) else csv_curves
    table = reader(path, faults)
    if table is not None and not faults:
        faults += table_faults(table)
    if faults or table is None:
        raise ModelFileError(path, faults)
    size = AXES[table.quantity][table.axis_unit]
    return Curves(table.axis * size, table.values, table.quantity, table.names, table.units)


def write_curves(path: str | PathLike, curves: Curves) -> None:
    """Write curves as `read_curves` reads them; a universal file has six digits of the axis, twelve of the values.

    Raises: ModelError for names that the file cannot hold, with every fault; OSError where it cannot be written.
    """
    table = CurveTable(
        np.asarray(curves.axis, float),
        np.asarray(curves.values, float),
        curves.quantity,
        "s" if curves.quantity == "time" else "Hz",
        curves.names,
        curves.units,
        (),
    )
    faults = table_faults(table)
    text = "" if faults else (uff_text if _is_universal(path) else csv_text)(table, faults)
    if faults:
        raise ModelError(faults, "the curves")
    with atomic_file(path) as file:
        file.write(text)


def read_psd(path: str | PathLike, name: str | None = None, unit: str | None = None) -> PsdTable:
    """Power spectral density of a file, one-sided and per Hz, as `psd_table` makes one.

    Args:
        name: of the curve; None where the file has one.
        unit: in place of that of the file, as of `psd_table`; "any" for levels that stay as they are.

    Raises: ModelFileError with every fault: no frequencies, several curves and no name, an unknown unit, levels that
    are not positive; UnknownNameError.
    """
    curves = read_curves(path)
    faults = []
    if curves.quantity != "frequency":
        faults.append("it has curves over time: a spectrum is over frequencies [Hz]")
    if name is None and len(curves.names) > 1:
        faults.append(f"it has several curves: give the name of one of {', '.join(map(repr, curves.names))}")
    if faults:
        raise ModelFileError(path, faults)
    name = curves.names[0] if name is None else name
    levels = curves[name]
    own = curves.units[curves.names.index(name)] if unit is None else unit
    known = "any" if own == "any" else _UNITS.get(normalise_unit(own))
    if known is None:
        raise ModelFileError(path, [f"{name!r} is in {own!r}: give `unit`, one of {', '.join(UNITS)}, or 'any'"])
    try:
        return psd_table(curves.axis, levels, None if known == "any" else known)
    except ModelError as error:
        raise ModelFileError(path, [f"{name!r}: {fault}" for fault in error.faults]) from None


def write_psd(path: str | PathLike, table: PsdTable, name: str = "level", unit: str | None = None) -> None:
    """Write a power spectral density, by default in SI units.

    Args: unit: "g^2/Hz" converts an acceleration.

    Raises: ModelError for a unit that does not fit the quantity.
    """
    unit = _WRITTEN[table.quantity] if unit is None else unit
    if unit and UNITS.get(unit, ("", 0.0))[0] != table.quantity:
        raise ModelError([f"unit {unit!r} does not fit a spectrum of {table.quantity}"], "the spectrum")
    size = STANDARD_GRAVITY**2 if unit == "g^2/Hz" else 1.0
    levels = np.asarray(table.levels)[:, None] / size
    write_curves(path, Curves(table.frequencies, levels, "frequency", (name,), (unit,)))


def _is_universal(path):
    return fspath(path).lower().endswith(_UNIVERSAL)
