"""Kinks at the end of a search: slopes on both sides of a short step that differ, however short it becomes."""

import functools

import numpy as np

from ._search import Point, Search
from ._variables import AT_BOUND

#: Share of the objective by which it still falls per scale, to first order: with less no kink is looked for.
_STEEP = 1e-3
#: Lengths of the step, of the variables' scales: searches stop at a kink some 1e-8 before it.
_LENGTHS = (1e-6, 1e-4)
#: Change of a slope, of its larger side, that may be a kink.
_CHANGE = 0.5
#: Halvings of the step towards the side that changes, in which a slope without kink loses all of its change.
_HALVINGS = 16


def describe_kink(search: Search) -> str:
    """The kink at the best point of a search that has ended, in words; empty where there is none."""
    best, v = search.best, search.variables
    if not best.finite or search.remaining_decrease <= _STEEP * search.objective_scale(best):
        return ""
    if search.kink is not None:
        return _sentence(search, 0, *search.kink)
    scale = v.move_scale(best.x)
    step = -search.stationarity(best) * scale**2
    at_lower, at_upper = best.x - v.lower <= AT_BOUND * scale, v.upper - best.x <= AT_BOUND * scale
    step = np.where((at_lower & (step < 0)) | (at_upper & (step > 0)) | (v.lower == v.upper), 0.0, step)
    size = np.max(np.abs(step / scale), initial=0.0)
    if not size > 0.0:
        return ""
    step = step / size

    def slopes(length: float) -> np.ndarray:
        return _slopes(search.evaluate(best.x + length * step), step)

    near = slopes(0.0)
    for length in _LENGTHS:
        far = slopes(length)
        which = _changed(search, near, far)
        if which is not None:
            ends = near[which], far[which]
            along = functools.partial(_slope_of, slopes, which)
            return _sentence(search, which, *ends) if _stays(along, length, *ends) else ""
    return ""


def _slope_of(slopes, which, length):
    return slopes(length)[which]


def _slopes(point: Point, step: np.ndarray) -> np.ndarray:
    """Slopes (1 + k,) of the objective and of the constraints of the working set along a step."""
    return np.concatenate([point.gradient[None] @ step, point.jacobian.reshape(-1, len(step)) @ step])


def _changed(search, near, far) -> int | None:
    """Number of the function whose slope changes most, if it does."""
    if not np.all(np.isfinite(far)):
        return None
    unit = np.ones(len(near))
    unit[0] = search.objective_scale(search.best)
    size = np.maximum(np.abs(near), np.abs(far))
    change = np.where(size > _STEEP * unit, np.abs(far - near) / np.where(size > 0.0, size, 1.0), 0.0)
    return int(np.argmax(change)) if np.max(change) > _CHANGE else None


def _stays(slope, length, a, b) -> bool:
    """True if the change of a slope from a to b stays while the step is halved towards it."""
    low, high, whole = 0.0, length, abs(b - a)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        between = slope(middle)
        if not np.isfinite(between):
            return False
        if abs(between - a) > abs(b - between):
            high, b = middle, between
        else:
            low, a = middle, between
    return bool(abs(b - a) > _CHANGE * whole)


def _sentence(search, which, a, b):
    name = search.functions[0][which]
    what = "the objective" if which == 0 else f"limit {name!r}"
    return (
        f"a kink: the slope of {what} jumps from {a:.3g} to {b:.3g} at the design found, so that it has no gradient "
        "there and better designs may lie along the kink; give the largest of several numbers as design.Worst"
    )
