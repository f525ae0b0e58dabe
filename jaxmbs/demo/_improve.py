"""Design optimisation of the demo: counterweight and proportions for less shaking and bearing load."""

import jax.numpy as jnp
import numpy as np

from ..design import Limit, minimise
from ._loads import rms, simulate_drive, smooth_peak
from ._mechanism import BOUNDS, DESIGN, TURN

#: What the wrist pin and the motor can bear, over the peaks of the first design: no more than now.
WRIST, TORQUE = 1.0, 1.0


def improve(system, before, size, steps):
    """The optimum over one turn at `size` crank angles, where wrist pin and motor are not overloaded.

    Args:
        system: a concrete build of the mechanism.
        before: `Loads` of the first design, the unit of both objectives.
    """
    ts = np.arange(size) * TURN / size
    shaking, bearing = float(rms(before.shaking)), float(smooth_peak(before.main))

    def objective(design):
        loads = simulate_drive(design, ts, like=system)[-1]
        total = 0.5 * rms(loads.shaking) / shaking + 0.5 * smooth_peak(loads.main) / bearing
        return total, {"wrist": jnp.linalg.norm(loads.wrist, axis=1), "torque": loads.torque[:, 0]}

    torque = TORQUE * float(np.max(np.abs(before.torque)))
    limits = [
        Limit("wrist pin [N]", "wrist", upper=WRIST * float(np.max(np.linalg.norm(before.wrist, axis=1)))),
        Limit("driving torque [N m]", "torque", lower=-torque, upper=torque),
    ]
    options = {"bounds": BOUNDS, "limits": limits, "steps": steps, "tolerance": 1e-5, "gradient": "forward"}
    return minimise(objective, DESIGN, **options)
