"""Strokes of sliding joints: blocks on rails, barrels and rods of telescopes."""

import numpy as np

from ..palette import COLORS
from ._drawable import Slide
from ._strokes import DARK, STEEL, Stroke

_RAIL = 5.0  # of a rail beyond its block, in symbol sizes


class SlideStrokes:
    """A sliding joint along a trajectory, seen in a projection; `body` is its child's index, -1 the ground."""

    def __init__(self, slide: Slide, film, look, size, body):
        self.slide, self.film, self.look, self.size = slide, film, look, size
        self.color = COLORS[body % len(COLORS)] if body >= 0 else STEEL

    def line(self, k: int, near, far, side: int = 0) -> np.ndarray:
        """Two points of the picture on the axis, at distances from the first (second) frame."""
        first, frame = self.slide.joint.frames[0], self.slide.joint.frames[side]
        return self.look(
            self.film.x[k, frame] + np.array([[near], [far]]) * (self.film.R[k, first] @ self.slide.axis)
        )

    def block(self, k: int) -> np.ndarray:
        """The middle (2,) of the block."""
        return self.line(k, self.slide.offset, self.slide.offset, 1)[0]

    def ends(self, k: int) -> np.ndarray:
        """Ends (2, 2) of an element on the joint: from the end of the rail to the block."""
        if self.slide.is_telescope:
            return self.look(self.film.x[k, list(self.slide.joint.frames)])
        start = min(0.0, self.slide.reach[0] - 3 * _RAIL * self.size)
        return np.stack([self.line(k, start, start)[0], self.block(k)])

    def rail(self, k: int) -> list[Stroke]:
        """The rail of a block; none of a telescope."""
        low, high = self.slide.reach
        if self.slide.is_telescope:
            return []
        style = {"color": STEEL, "linewidth": 1.2, "linestyle": (0, (6, 2)), "zorder": 2}
        return [Stroke(self.line(k, low - _RAIL * self.size, high + _RAIL * self.size), style)]

    def strokes(self, k: int) -> list[Stroke]:
        """Barrel and rod of a telescope, or a block."""
        return self._telescope(k) if self.slide.is_telescope else self._block(k)

    def _telescope(self, k):
        low, high = self.slide.reach
        least, most = sorted(map(abs, (low, high)))
        sign, barrel = 1.0 if low > 0 else -1.0, 0.9 * least
        rod = max(0.96 * least, most - 0.85 * barrel)
        thin = {"color": DARK, "linewidth": 2.2, "zorder": 2.9}
        thick = {"color": STEEL, "linewidth": 6.0, "solid_capstyle": "butt", "zorder": 3}
        return [Stroke(self.line(k, 0.0, -sign * rod, 1), thin), Stroke(self.line(k, 0.0, sign * barrel), thick)]

    def _block(self, k):
        middle, (start, end) = self.block(k), self.line(k, -self.size, self.size, 1)
        along, length = end - start, np.linalg.norm(end - start)
        along = along / length if length > 1e-3 * self.size else np.array([1.0, 0.0])
        across = self.size * np.array([-along[1], along[0]])
        ends = middle + 1.6 * self.size * np.stack([-along, along])
        corners = np.stack([ends[0] - across, ends[1] - across, ends[1] + across, ends[0] + across])
        style = {"facecolor": self.color, "edgecolor": "white", "linewidth": 0.8, "zorder": 3.5}
        return [Stroke(corners, style, True)]
