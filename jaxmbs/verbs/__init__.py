"""Verbs that take either noun: each dispatches on its first argument, a mechanism or a linear system."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._check import check
    from ._equilibrium import equilibrium
    from ._frequency_response import frequency_response
    from ._modes import modes
    from ._random_response import random_response
    from ._reactions import reactions
    from ._simulate import simulate

__all__ = ["check", "equilibrium", "frequency_response", "modes", "random_response", "reactions", "simulate"]

import_when_asked(__name__, explain_arguments)
