"""Friction: models of resistance to slip per load, the same in joints, contacts, cables, worm gears and laws."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._base import AbstractBristles, AbstractFriction
    from ._bearing import BearingFriction
    from ._brown_mcphee import BrownMcPhee
    from ._coulomb import SmoothCoulomb
    from ._lugre import LuGre

__all__ = [
    "AbstractBristles",
    "AbstractFriction",
    "BearingFriction",
    "BrownMcPhee",
    "LuGre",
    "SmoothCoulomb",
]

import_when_asked(__name__, explain_arguments)
