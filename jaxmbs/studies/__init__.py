"""Studies: a function of a design over a grid, a table or samples, written to disk as it runs."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._opened import open_study as open
    from ._opened import pareto_front
    from ._plans import Designs, grid, latin_hypercube, normal, sobol
    from ._sobol_shares import SobolShares, sobol_shares
    from ._study import StudyError, sweep

__all__ = [
    "Designs",
    "SobolShares",
    "StudyError",
    "grid",
    "latin_hypercube",
    "normal",
    "open",
    "pareto_front",
    "sobol",
    "sobol_shares",
    "sweep",
]

import_when_asked(__name__, explain_arguments)
