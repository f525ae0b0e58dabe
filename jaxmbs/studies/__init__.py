"""Studies: a function of a design over a grid, a table or samples, written to disk as it runs."""

from ..arguments import explain_arguments
from ._plans import Designs, grid, latin_hypercube, normal, sobol
from ._study import StudyError, sweep

__all__ = [
    "Designs",
    "StudyError",
    "grid",
    "latin_hypercube",
    "normal",
    "sobol",
    "sweep",
]

explain_arguments(globals())
