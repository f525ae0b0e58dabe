"""The demo: a slider-crank simulated, its joint loads checked, its design improved by gradients."""

from ._story import run

__all__ = [
    "run",
]
