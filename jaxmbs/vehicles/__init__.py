"""Vehicles: tyres and roads."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._axle_tyres import AxleTyres
    from ._convention import CONVENTIONS, Convention
    from ._magic_formula import MagicFormula
    from ._plain_tyres import BrushTyre, FialaTyre, LinearTyre
    from ._random_road import RandomRoad
    from ._ride import Ride, ride, wheel_inputs
    from ._road import AbstractRoad, FlatRoad
    from ._road_shapes import CleatRoad, SineRoad, SurfaceRoad, TandemCams
    from ._single_track import ForwardSpeed, SingleTrack
    from ._tir import TirFile, read_tir
    from ._tyre import Tyre
    from ._tyre_model import AbstractTyreModel, Compression, ContactForces, Slip, SlipSlopes
    from ._weighting import WEIGHTINGS, WeightingFilter, weighting

__all__ = [
    "AbstractRoad",
    "AbstractTyreModel",
    "AxleTyres",
    "BrushTyre",
    "CONVENTIONS",
    "CleatRoad",
    "Compression",
    "ContactForces",
    "Convention",
    "FialaTyre",
    "FlatRoad",
    "ForwardSpeed",
    "LinearTyre",
    "MagicFormula",
    "RandomRoad",
    "Ride",
    "SineRoad",
    "SingleTrack",
    "Slip",
    "SlipSlopes",
    "SurfaceRoad",
    "TandemCams",
    "TirFile",
    "Tyre",
    "WEIGHTINGS",
    "WeightingFilter",
    "read_tir",
    "ride",
    "weighting",
    "wheel_inputs",
]

import_when_asked(__name__, explain_arguments)
