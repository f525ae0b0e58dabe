"""Named numbers of a state: coordinates, velocities and internal states, with their units."""

from typing import Any

import numpy as np

from ..joints._coordinate_units import coordinate_units, velocity_units
from ..quantities import Quantity

_TURNS = ("rx", "ry", "rz")  # of a rotation vector, for the four numbers of a quaternion


def state_quantities(state: Any, at_rest: bool = False) -> list[Quantity]:
    """Coordinates "pin", or "plate x" of a joint with several, their velocities "velocity of pin", internal states.

    Rotations of balls are rotation vectors [rad].  Args: at_rest: leave out the velocities.
    """
    found = [Quantity(*column) for column in shown_coordinates(state)]
    if not at_rest:
        u = np.asarray(state.velocities)
        layout = state.structure or (("", "", 0, u.shape[-1], ()),)
        units = [unit for _, kind, _, size, _ in layout for unit in velocity_units(kind, size)]
        names = velocity_names(state.structure, u.shape[-1])
        found += [Quantity(f"velocity of {n}", u[..., k], unit) for k, (n, unit) in _numbered(names, units)]
    if state.internal is not None:
        values = np.asarray(state.internal.values)
        units = [record.unit for record in state.internal.records for _ in record.entries]
        found += [Quantity(n, values[..., k], unit) for k, (n, unit) in _numbered(state.internal.entries, units)]
    return found


def _numbered(names, units):
    return enumerate(zip(names, units, strict=True))


def shown_coordinates(state: Any) -> list[tuple[str, np.ndarray, str]]:
    """Name, values (...) and unit of each coordinate of a state as a table shows it: of quaternions the rotation
    vector."""
    psi, found, first = np.asarray(state.coordinates), [], 0
    for name, kind, size, speeds, labels in state.structure or (("", "", psi.shape[-1], 0, ()),):
        own, units = psi[..., first : first + size], coordinate_units(kind, size)
        first += size
        if size == speeds + 1:  # its last four numbers are a quaternion
            own = np.concatenate([own[..., :-4], _rotation_vectors(own[..., -4:])], axis=-1)
            units, labels = (*units[:-4], *("rad",) * 3), (*labels[: size - 4], *_TURNS)
        found += [(n, own[..., k], unit) for k, (n, unit) in _numbered(_names(name, own.shape[-1], labels), units)]
    return found


def _rotation_vectors(q):
    """Rotation vectors (..., 3) [rad] of quaternions (..., 4); their angles lie in [0, pi]."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., :1])
    return q[..., 1:] * np.where(sine > 0.0, 2.0 * half / np.where(sine > 0.0, sine, 1.0), 2.0)


def coordinate_names(structure: Any, count: int) -> list[str]:
    """Names of all coordinates of a layout, "ball w" of a quaternion; their numbers for a state made by hand."""
    layout = structure or (("", "", count, 0, ()),)
    return [found for name, _, size, _, labels in layout for found in _names(name, size, labels)]


def velocity_names(structure: Any, count: int) -> list[str]:
    """Names of all velocities of a layout; their numbers for a state made by hand."""
    found = []
    for name, _, size, speeds, labels in structure or (("", "", 0, count, ()),):
        found += _names(name, speeds, (*labels[: size - 4], *_TURNS) if size == speeds + 1 else labels)
    return found


def _names(name, size, labels):
    labels = labels if len(labels) == size else range(size)
    return [name] if size == 1 and name else [f"{name} {label}".strip() for label in labels]
