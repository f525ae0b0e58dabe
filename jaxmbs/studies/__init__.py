"""Studies: a function of a design over a grid, a table or points spread over a box, written to disk as it runs."""

from .plans import Designs, grid, latin_hypercube, normal, sobol
from .study import StudyError, sweep

__all__ = [
    "Designs",
    "StudyError",
    "grid",
    "latin_hypercube",
    "normal",
    "sobol",
    "sweep",
]
