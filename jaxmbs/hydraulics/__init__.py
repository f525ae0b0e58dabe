"""Hydraulic elements of circuits: nodes with a pressure, and orifices, valves, pumps and lines between them."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._accumulator import Accumulator
    from ._base import AbstractHydraulicElement, AbstractNode, AbstractStorage, AbstractTwoPort
    from ._check_valve import CheckValve
    from ._line import Line
    from ._orifice import Orifice
    from ._pump import Pump
    from ._relief_valve import ReliefValve
    from ._tank import Tank
    from ._valve import Valve
    from ._volume import Volume

__all__ = [
    "AbstractHydraulicElement",
    "AbstractNode",
    "AbstractStorage",
    "AbstractTwoPort",
    "Accumulator",
    "CheckValve",
    "Line",
    "Orifice",
    "Pump",
    "ReliefValve",
    "Tank",
    "Valve",
    "Volume",
]

import_when_asked(__name__, explain_arguments)
