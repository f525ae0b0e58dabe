"""Fatigue: rainflow cycles, damage of histories and of spectra, all with derivatives."""

from ._cycles import Cycles, rainflow
from ._damage import damage, equivalent_load
from ._sn import SN
from ._spectral_damage import spectral_damage
from ._spectrum import Spectrum

__all__ = ["SN", "Cycles", "Spectrum", "damage", "equivalent_load", "rainflow", "spectral_damage"]
