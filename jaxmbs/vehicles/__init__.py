"""Vehicles: tyres and roads."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._convention import CONVENTIONS, Convention
    from ._magic_formula import MagicFormula
    from ._plain_tyres import BrushTyre, FialaTyre, LinearTyre
    from ._road import AbstractRoad, FlatRoad
    from ._tir import TirFile, read_tir
    from ._tyre import Tyre
    from ._tyre_model import AbstractTyreModel, Compression, ContactForces, Slip, SlipSlopes

__all__ = [
    "AbstractRoad",
    "AbstractTyreModel",
    "BrushTyre",
    "CONVENTIONS",
    "Compression",
    "ContactForces",
    "Convention",
    "FialaTyre",
    "FlatRoad",
    "LinearTyre",
    "MagicFormula",
    "Slip",
    "SlipSlopes",
    "TirFile",
    "Tyre",
    "read_tir",
]

import_when_asked(__name__, explain_arguments)
