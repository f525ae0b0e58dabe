"""Named numbers of a state: coordinates, velocities and internal states, with their units."""

from typing import Any

import numpy as np

from ..joints._coordinate_units import coordinate_units, velocity_units
from ..quantities import Quantity


def state_quantities(state: Any) -> list[Quantity]:
    """Coordinates "pin", or "ball 0" of a joint with several, their velocities "velocity of pin", internal states."""
    psi, u = np.asarray(state.coordinates), np.asarray(state.velocities)
    layout = state.structure or (("", "", psi.shape[-1], u.shape[-1]),)
    names, units = state_labels(state.structure, psi.shape[-1])
    found = [Quantity(name, psi[..., k], unit) for k, (name, unit) in enumerate(zip(names, units, strict=True))]
    rates = _labels(((name, size) for name, _, _, size in layout))
    units = [unit for _, kind, _, size in layout for unit in velocity_units(kind, size)]
    found += [
        Quantity(f"velocity of {name}", u[..., k], unit)
        for k, (name, unit) in enumerate(zip(rates, units, strict=True))
    ]
    if state.internal is not None:
        values = np.asarray(state.internal.values)
        units = [record.unit for record in state.internal.records for _ in record.entries]
        found += [
            Quantity(name, values[..., k], unit)
            for k, (name, unit) in enumerate(zip(state.internal.entries, units, strict=True))
        ]
    return found


def state_labels(structure: Any, count: int) -> tuple[list[str], list[str]]:
    """Names and units of all coordinates of a layout; their numbers for a state made by hand."""
    layout = structure or (("", "", count, 0),)
    units = [unit for _, kind, size, _ in layout for unit in coordinate_units(kind, size)]
    return _labels((name, size) for name, _, size, _ in layout), units


def _labels(sizes):
    return [name if size == 1 and name else f"{name} {k}".strip() for name, size in sizes for k in range(size)]
