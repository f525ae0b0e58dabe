"""Qualification loads: shock spectra and vibration response spectra."""

from ._random_spectrum import miles, random_spectrum
from ._shock_spectrum import ShockSpectrum, shock_spectrum

__all__ = ["ShockSpectrum", "miles", "random_spectrum", "shock_spectrum"]
