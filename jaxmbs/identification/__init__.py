"""Identification: unknowns of a model from measurements, and a verdict on what the measurements can tell."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._best_excitation import Excitation, best_excitation
    from ._fourier import FourierMotion
    from ._identification import Identification
    from ._identify import identify
    from ._log_cholesky import from_log_cholesky, log_cholesky
    from ._shooting import multiple_shooting
    from ._verdict import Direction

__all__ = [
    "Direction",
    "Excitation",
    "FourierMotion",
    "Identification",
    "best_excitation",
    "from_log_cholesky",
    "identify",
    "log_cholesky",
    "multiple_shooting",
]

import_when_asked(__name__, explain_arguments)
