"""Poses and twists of the frames that ports act on."""

from typing import NamedTuple

import numpy as np
from jax import Array

from ..math._linalg import skew
from ..runtime import gather_static


class FrameMotion(NamedTuple):
    """A frame: rotation (3, 3), position (3,) and twist (6,) of its body, all about one origin."""

    R: Array
    x: Array
    V: Array

    @property
    def spin(self):
        return self.V[:3]

    @property
    def velocity(self):
        """Velocity of the frame's own origin."""
        return self.V[3:] + skew(self.V[:3]) @ self.x


def frame_motions(side, at, V):
    """The frames of all elements on one side."""
    return FrameMotion(*(gather_static(part, np.asarray(side)) for part in (at.R, at.x, V)))
