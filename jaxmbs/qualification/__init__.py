"""Qualification: responses to random and sine tests, notching, load events."""

from ._inputs import BaseAcceleration, RandomForce
from ._outputs import BaseForces, BondForces, Coordinates, Recovery
from ._psd import PsdTable, WhiteNoise, psd_table
from ._random_response import RandomResponse, random_response

__all__ = [
    "BaseAcceleration",
    "BaseForces",
    "BondForces",
    "Coordinates",
    "PsdTable",
    "RandomForce",
    "RandomResponse",
    "Recovery",
    "WhiteNoise",
    "psd_table",
    "random_response",
]
