"""Words for a motion that failed: how it ended, how far it came, and the size of its steps."""

import numpy as np

from ..status import Status
from ..typing import AnyArray


def describe_end(status: Status, t0: float, t_end: AnyArray, saved: AnyArray, num_steps: AnyArray) -> str:
    """A sentence on one failed motion.

    Args:
        t0, t_end: times of its start and its end [s].
        saved: times of the saved states that are finite.
    """
    text = f"the motion failed: {status}"
    if np.ndim(t_end):
        return text
    text += f"; it reached t = {float(t_end):.6g} s"
    if len(saved):
        text += f", last saved state at t = {saved[-1]:.4g} s"
    if status in (Status.MAX_STEPS, Status.STEP_SIZE):
        taken = max(int(num_steps), 1)
        text += f", by {taken} steps of {mean_step(t0, t_end, num_steps):.2g} s in the mean"
    return text


def mean_step(t0: float, t_end: AnyArray, num_steps: AnyArray) -> float:
    """Mean step of a motion [s]."""
    return (float(t_end) - t0) / max(int(num_steps), 1)
