"""Counterweight and proportions that shake less and load the main bearing less, found by gradients."""

import numpy as np

from ..design import minimise
from .loads import drive, rms, smooth_peak
from .mechanism import BOUNDS, DESIGN, TURN


def improve(system, before, size, steps):
    """The optimum over one turn at `size` crank angles.

    Args:
        system: a concrete build of the mechanism.
        before: `Loads` of the first design, the unit of both aims.
    """
    ts = np.arange(size) * TURN / size
    shaking, bearing = float(rms(before.shaking)), float(smooth_peak(before.main))

    def objective(design):
        loads = drive(design, ts, like=system)[-1]
        return 0.5 * rms(loads.shaking) / shaking + 0.5 * smooth_peak(loads.main) / bearing

    return minimise(objective, DESIGN, bounds=BOUNDS, steps=steps, tolerance=1e-5, gradient="forward")
