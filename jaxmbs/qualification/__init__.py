"""Qualification: responses to random, sine and shock tests, notching, load events."""

from typing import TYPE_CHECKING

from ..arguments import explain_arguments
from ..lazy import import_when_asked

if TYPE_CHECKING:
    from ._critical_plane import CriticalPlane, critical_plane
    from ._damage_spectrum import DamageSpectrum, damage_spectrum
    from ._inputs import BaseAcceleration, RandomForce
    from ._load_cases import Envelope, LoadCase, load_envelope
    from ._outputs import BaseForces, BondForces, Coordinates, Recovery
    from ._random_response import RandomResponse, random_response
    from ._random_spectrum import miles, random_spectrum
    from ._response_spectrum import ResponseSpectrum, response_spectrum
    from ._shock_spectrum import ShockSpectrum, shock_spectrum
    from ._sine_response import SineResponse, sine_response
    from ._stress_spectrum import StressSpectrum, stress_spectrum, von_mises_spectrum
    from ._white_noise import WhiteNoise

__all__ = [
    "BaseAcceleration",
    "BaseForces",
    "BondForces",
    "Coordinates",
    "CriticalPlane",
    "DamageSpectrum",
    "Envelope",
    "LoadCase",
    "RandomForce",
    "RandomResponse",
    "Recovery",
    "ResponseSpectrum",
    "ShockSpectrum",
    "SineResponse",
    "StressSpectrum",
    "WhiteNoise",
    "critical_plane",
    "damage_spectrum",
    "load_envelope",
    "miles",
    "random_response",
    "random_spectrum",
    "response_spectrum",
    "shock_spectrum",
    "sine_response",
    "stress_spectrum",
    "von_mises_spectrum",
]

import_when_asked(
    __name__, explain_arguments, dict.fromkeys(("PsdTable", "psd_table"), "jaxmbs.fatigue")
)  # these for one release
