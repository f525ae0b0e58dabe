"""Qualification: responses to random, sine and shock tests, notching, load events."""

from ._inputs import BaseAcceleration, RandomForce
from ._load_cases import Envelope, LoadCase, load_envelope
from ._outputs import BaseForces, BondForces, Coordinates, Recovery
from ._psd import PsdTable, WhiteNoise, psd_table
from ._random_response import RandomResponse, random_response
from ._random_spectrum import miles, random_spectrum
from ._response_spectrum import ResponseSpectrum, correlation, response_spectrum
from ._shock_spectrum import ShockSpectrum, shock_spectrum
from ._sine_response import SineResponse, sine_response

__all__ = [
    "BaseAcceleration",
    "BaseForces",
    "BondForces",
    "Coordinates",
    "Envelope",
    "LoadCase",
    "PsdTable",
    "RandomForce",
    "RandomResponse",
    "Recovery",
    "ResponseSpectrum",
    "ShockSpectrum",
    "SineResponse",
    "WhiteNoise",
    "correlation",
    "load_envelope",
    "miles",
    "psd_table",
    "random_response",
    "random_spectrum",
    "response_spectrum",
    "shock_spectrum",
    "sine_response",
]
