"""Limits of joints, as robot files give them."""

from typing import NamedTuple

import numpy as np


class JointLimits(NamedTuple):
    """Limits of a joint: coordinates [m or rad], velocity, effort [N or N m]; infinite if not given."""

    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    effort: float = np.inf
