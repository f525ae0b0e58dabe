"""Cycles: periodic motions of mechanisms with their loads, stability and derivatives."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._branch import Branch, StabilityChange
    from ._cycle import Cycle
    from ._cycles_along import cycles_along
    from ._harmonic_balance import harmonic_balance
    from ._harmonic_cycles import HarmonicCycles
    from ._periodic import periodic

__all__ = ["Branch", "Cycle", "HarmonicCycles", "StabilityChange", "cycles_along", "harmonic_balance", "periodic"]

import_when_asked(__name__, explain_arguments)
