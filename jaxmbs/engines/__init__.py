"""Engines: gas pressure by crank angle, flywheels, orders of torques, crank trains in torsion."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._crank_train import CrankTrain
    from ._cylinder import CylinderPressure
    from ._flywheel import Flywheel, flywheel
    from ._orders import Orders, orders

__all__ = ["CrankTrain", "CylinderPressure", "Flywheel", "Orders", "flywheel", "orders"]

import_when_asked(__name__, explain_arguments)
