"""Frequency weightings of human response to vibration.

Source: ISO 2631-1 (1997), ISO 8041-1 (2017).
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from ..blocks import StateSpace
from ..checks import no_such
from ..typing import ArrayLike


class WeightingFilter(NamedTuple):
    """Corner frequencies [Hz] and quality factors of a weighting; None: that part is left out.

    `limits`: of the band; `transition`: f3, f4, Q4; `step`: f5, Q5, f6, Q6.
    """

    limits: tuple[float, float]
    transition: tuple[float, float, float] | None
    step: tuple[float, float, float, float] | None

    def polynomials(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Numerator and denominator of each part in s, highest power first."""
        w = 2.0 * np.pi
        low, high = (w * f for f in self.limits)
        root = np.sqrt(2.0)
        parts = [
            (np.array([1.0, 0.0, 0.0]), np.array([1.0, root * low, low**2])),
            (np.array([0.0, 0.0, high**2]), np.array([1.0, root * high, high**2])),
        ]
        if self.transition is not None:
            f3, f4, Q4 = self.transition
            parts.append(
                (np.array([0.0, 1.0 / (w * f3), 1.0]), np.array([1.0 / (w * f4) ** 2, 1.0 / (Q4 * w * f4), 1.0]))
            )
        if self.step is not None:
            f5, Q5, f6, Q6 = self.step
            above = np.array([1.0 / (w * f5) ** 2, 1.0 / (Q5 * w * f5), 1.0]) * (f5 / f6) ** 2
            parts.append((above, np.array([1.0 / (w * f6) ** 2, 1.0 / (Q6 * w * f6), 1.0])))
        return parts

    def factor(self, frequencies: ArrayLike) -> Array:
        """Size of the weighting (...) at frequencies (...) [Hz]."""
        s = 2j * np.pi * np.asarray(frequencies, float)
        found: Any = 1.0
        for top, bottom in self.polynomials():
            found = found * np.polyval(top, s) / np.polyval(bottom, s)
        return jnp.asarray(np.abs(found))

    def state_space(self) -> StateSpace:
        """The filter as a block with one input and one output; parts in series."""
        A, B, C, D = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))
        for top, bottom in self.polynomials():
            a, b, c, d = _companion(top, bottom)
            A = np.block([[A, np.zeros((len(A), 2))], [b @ C, a]])
            B, C, D = np.vstack([B, b @ D]), np.hstack([d @ C, c]), d @ D
        return StateSpace(A, B, C, D)


#: By name: Wk vertical and Wd horizontal of seat and floor, Wf of motion sickness, Wc of backs, We of rotations, Wj
#: of heads that lie.
WEIGHTINGS = {
    "Wk": WeightingFilter((0.4, 100.0), (12.5, 12.5, 0.63), (2.37, 0.91, 3.35, 0.91)),
    "Wd": WeightingFilter((0.4, 100.0), (2.0, 2.0, 0.63), None),
    "Wf": WeightingFilter((0.08, 0.63), (1e9, 0.25, 0.86), (0.0625, 0.80, 0.1, 0.80)),
    "Wc": WeightingFilter((0.4, 100.0), (8.0, 8.0, 0.63), None),
    "We": WeightingFilter((0.4, 100.0), (1.0, 1.0, 0.63), None),
    "Wj": WeightingFilter((0.4, 100.0), None, (3.75, 0.91, 5.32, 0.91)),
}


def weighting(name: str) -> WeightingFilter:
    """A weighting by name.  Raises: ValueError."""
    if name not in WEIGHTINGS:
        raise ValueError(no_such("weighting", name, WEIGHTINGS))
    return WEIGHTINGS[name]


def _companion(top, bottom):
    """State space of a second-order part."""
    top, bottom = top / bottom[0], bottom / bottom[0]
    rest = top[1:] - top[0] * bottom[1:]
    A = np.array([[0.0, 1.0], [-bottom[2], -bottom[1]]])
    return A, np.array([[0.0], [1.0]]), rest[None, ::-1], np.array([[top[0]]])
