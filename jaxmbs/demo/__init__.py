"""The demo: a slider-crank simulated, its joint loads checked, its design improved by gradients."""

from ..arguments import explain_arguments
from ._story import run

__all__ = [
    "run",
]

explain_arguments(globals(), __all__)
