"""Multipliers of limits and bounds, and the residual of the Karush-Kuhn-Tucker (KKT) conditions."""

from typing import NamedTuple

import numpy as np

from ._search import Point
from ._variables import Variables

#: Constraints above minus this, relative to the limit, may carry a multiplier, and bounds that are as near over the
#: scale of their variable.  Far above the 1e-7 to which limits are satisfied: interior-point methods stop a little
#: inside of an active constraint.
ACTIVE = 1e-5


class LimitMultipliers(NamedTuple):
    """Non-negative multipliers at a point, by least squares.

    Attributes:
        limits: (k,) of the constraints in the working set, in units of the objective per relative constraint value.
        bounds: (n,) of the variables, in units of the objective per variable; positive at a lower bound, negative at
            an upper one.
        residual: largest violation of stationarity, as a fall of the objective if one variable moves by its scale,
            or of complementarity (multiplier times margin).
    """

    limits: np.ndarray
    bounds: np.ndarray
    residual: float


def estimate_multipliers(point: Point, variables: Variables, working_set: np.ndarray) -> LimitMultipliers:
    """Estimate the multipliers at a point; working_set (k,): the constraints that its Jacobian has rows of."""
    from scipy.optimize import nnls

    scale, constraints = variables.move_scale(point.x), point.constraints[working_set]
    near = np.flatnonzero(constraints > -ACTIVE)
    below, above = point.x - variables.lower, variables.upper - point.x
    low, high = np.flatnonzero(below <= ACTIVE * scale), np.flatnonzero(above <= ACTIVE * scale)
    one = np.eye(len(scale))
    columns = np.concatenate([point.jacobian[near] * scale, -one[low], one[high]]).T
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    slope = point.gradient * scale
    found = nnls(columns / size, -slope)[0] / size if columns.size else np.zeros(columns.shape[1])
    left = np.abs(slope + columns @ found)

    limits, bounds = np.zeros(len(working_set)), np.zeros(len(scale))
    limits[near], (at_low, at_high) = found[: len(near)], np.split(found[len(near) :], [len(low)])
    np.add.at(bounds, low, at_low / scale[low])
    np.add.at(bounds, high, -at_high / scale[high])
    slack = max(
        float(np.max(limits * np.maximum(-constraints, 0.0), initial=0.0)),
        float(np.max(np.maximum(bounds, 0.0)[low] * below[low], initial=0.0)),
        float(np.max(np.maximum(-bounds, 0.0)[high] * above[high], initial=0.0)),
    )
    return LimitMultipliers(limits, bounds, max(float(np.max(left, initial=0.0)), slack))
