"""Multipliers of limits and bounds: what holds an optimum, and how far a design is from one."""

from typing import NamedTuple

import numpy as np

from ._search import Point
from ._variables import Variables

#: Limits with less room than this, relative to their size, may carry a multiplier.
ACTIVE = 1e-5


class Multipliers(NamedTuple):
    """The conditions of Karush, Kuhn and Tucker at a point, multipliers by least squares and none negative.

    Attributes:
        limits: (k,) of the rows that the point has gradients of, in units of the objective per relative excess.
        bounds: (n,) of the variables, in units of the objective per variable; positive at a lower bound, negative at
            an upper one.
        residual: what is left of the gradient, as a fall of the objective if one variable moves by its scale, and of
            multipliers of limits that leave room.
    """

    limits: np.ndarray
    bounds: np.ndarray
    residual: float


def estimate_multipliers(point: Point, variables: Variables, rows: np.ndarray) -> Multipliers:
    """Those of a point; rows (k,): which limits its gradients belong to."""
    from scipy.optimize import nnls

    scale, excess = variables.reach(point.x), point.excess[rows]
    near = np.flatnonzero(excess > -ACTIVE)
    low = np.flatnonzero(point.x - variables.lower <= 1e-9 * scale)
    high = np.flatnonzero(variables.upper - point.x <= 1e-9 * scale)
    one = np.eye(len(scale))
    columns = np.concatenate([point.slopes[near] * scale, -one[low], one[high]]).T
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    slope = point.gradient * scale
    found = nnls(columns / size, -slope)[0] / size if columns.size else np.zeros(columns.shape[1])
    left = np.abs(slope + columns @ found)

    limits, bounds = np.zeros(len(rows)), np.zeros(len(scale))
    limits[near], (at_low, at_high) = found[: len(near)], np.split(found[len(near) :], [len(low)])
    np.add.at(bounds, low, at_low / scale[low])
    np.add.at(bounds, high, -at_high / scale[high])
    slack = float(np.max(limits * np.maximum(-excess, 0.0), initial=0.0))
    return Multipliers(limits, bounds, max(float(np.max(left, initial=0.0)), slack))
