"""Inertias of files that no body can have: principal values A, B, C with A + B < C."""

import numpy as np

from ...checks import in_range

_EXACT = 1e-6  # short of the rule by this much, relative to C, a builder takes an inertia as it is
_ROUNDING = 1e-3  # A, B and C printed with four digits: 5e-4 of each where it begins with a 1


def check_inertia(where: str, inertia: np.ndarray, mode: str, faults: list[str], notes: list[str]) -> np.ndarray:
    """An inertia (3, 3) as it stands or mended, with a note; "refuse" makes a fault of more than rounding.

    Mended is the second moment, `tr(I) / 2 - I`, whose negative principal values become zero: C stays, A or B grows.
    """
    if not in_range(inertia):  # the builder refuses it
        return inertia
    a, b, c = values = np.linalg.eigvalsh((inertia + inertia.T) / 2)
    short = (c - a - b) / max(abs(c), 1e-300)
    if short <= _EXACT or a < -_ROUNDING * c:  # what is negative the builder refuses
        return inertia
    said = f"{where}: principal inertias {', '.join(f'{value:.6g}' for value in values)} break A + B >= C by "
    said += f"{100 * short:.2g} %"
    if mode == "accept":
        notes.append(f"{said}; they are taken as they are")
        return inertia
    if mode == "refuse" and short > _ROUNDING:
        faults.append(f"{said}: inertias='repair' takes the nearest that a body can have, 'accept' leaves them")
        return inertia
    notes.append(f"{said}; the nearest that a body can have are taken")
    moments, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - (inertia + inertia.T) / 2)
    moments = np.maximum(moments, 0.0)
    return np.sum(moments) * np.eye(3) - (axes * moments) @ axes.T
